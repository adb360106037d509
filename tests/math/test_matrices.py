"""Small matrices by plain sums, against NumPy's, which call LAPACK."""

from __future__ import annotations

import numpy as np
import pytest

from sidestep.math.matrices import determinant, inverse, principal_axes, product, transformed
from sidestep.math.pose import about_axis, pose_at


def test_products_inverses_and_determinants_by_value() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(50, 3, 3)), rng.normal(size=(50, 3, 3))
    np.testing.assert_allclose(product(a, b), a @ b, atol=1e-14)  # rounding
    np.testing.assert_allclose(product(a[0], b), a[0] @ b, atol=1e-14)
    np.testing.assert_allclose(determinant(a), np.linalg.det(a), rtol=1e-12)  # rounding of near-singular ones
    np.testing.assert_allclose(inverse(a), np.linalg.inv(a), rtol=1e-10)
    X = pose_at([1.0, 2.0, 3.0], about_axis(np.array([0.0, 0.0, 1.0]), 0.5 * np.pi))
    np.testing.assert_allclose(transformed(np.array([[1.0, 0.0, 0.0]]), X), [[1.0, 3.0, 3.0]], atol=1e-15)


def test_principal_axes_are_those_of_lapack_where_the_eigenvalues_differ() -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        root = rng.normal(size=(3, 3))
        values, axes = principal_axes(root @ root.T)
        expected, others = np.linalg.eigh(root @ root.T)
        np.testing.assert_allclose(
            values, expected, atol=1e-8 * expected[2]
        )  # off-diagonals of 1e-9 are left
        np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-14)
        if np.diff(expected).min() > 0.1:
            assert np.abs(axes.T @ others) == pytest.approx(np.eye(3), abs=1e-7)


@pytest.mark.parametrize("values", [(1.0, 1.0, 1.0), (1.0, 1.0, 4.0), (1.0, 4.0, 4.0), (0.0, 0.0, 1.0)])
def test_rounding_does_not_choose_axes(values: tuple[float, float, float]) -> None:
    for seed in range(20):
        noise = np.random.default_rng(seed).uniform(-1e-15, 1e-15, (3, 3))
        _, axes = principal_axes(np.diag(values) + noise * np.sqrt(np.outer(values, values)))
        assert np.abs(axes) == pytest.approx(np.eye(3)[:, np.argsort(values, kind="stable")], abs=1e-12)
