"""Errata 3, 7, 13, 15 and 18: distances, Christoffel symbols, curvature, graphs."""

import numpy as np
import pytest

from sidestep.thesis import christoffel_symbols, metric_matrix
from sidestep.thesis.reproduce import planar

Q, V = np.array([0.1, -0.3]), np.array([0.7, 0.4])


@pytest.fixture
def surface():
    """Slope, Hessian, metric and its derivative dG[l, i, j] at Q on the two-joint arm's surface."""
    density = planar.density()
    slope = density.evaluate(Q, V, planar.point()).jacobian[0]
    hessian = density.hessian(Q, planar.point())
    product = hessian[:, :, None] * slope[None, None, :]
    return slope, hessian, np.eye(2) + np.outer(slope, slope), product + product.transpose(0, 2, 1)


def first_kind(dG):
    """[l, i, j] of T2.7."""
    return 0.5 * (dG.transpose(2, 1, 0) + dG.transpose(2, 0, 1) - dG)


def test_distance_adds_squares():
    x, y = np.array([1.0, 2.0, 3.0]), np.array([1.5, 4.0, 2.0])
    squares = (x - y) ** 2
    assert np.sqrt(squares.sum()) == pytest.approx(np.linalg.norm(x - y), rel=1e-15)
    assert squares[0] - squares[1] - squares[2] < 0.0  # the printed root does not exist


def test_geodesic_keeps_its_speed_only_with_one_inverse(surface):
    _, _, G, dG = surface
    pull = first_kind(dG) @ V @ V

    def change(acceleration):
        """d/dt of v'Gv."""
        return 2.0 * V @ G @ acceleration + V @ np.tensordot(V, dG, axes=1) @ V

    scale = np.abs(V @ np.tensordot(V, dG, axes=1) @ V)
    once = -np.linalg.solve(G, pull)
    twice = np.linalg.solve(G, once)
    assert abs(change(once)) < 1e-10 * scale  # rounding
    assert abs(change(twice)) > 0.1 * scale


def test_second_kind_contracts_the_inner_index(surface):
    slope, hessian, G, dG = surface
    first = first_kind(dG)
    right = np.einsum("lm,mij->lij", np.linalg.inv(G), first)
    core = christoffel_symbols(slope[None], hessian[None])
    np.testing.assert_allclose(core, right, atol=1e-10 * np.abs(right).max())
    as_printed = np.linalg.inv(G).sum(axis=1)[:, None, None] * first
    assert np.abs(as_printed - right).max() > 0.1 * np.abs(right).max()


def test_curvature_does_not_follow_height():
    def curvature(r):
        """Gaussian curvature of z = exp(-r²/2) on the radius r."""
        z = np.exp(-0.5 * r * r)
        slope, radial, around = -r * z, (r * r - 1.0) * z, -z
        return radial * around / (1.0 + slope * slope) ** 2

    assert curvature(0.0) == pytest.approx(1.0)
    assert curvature(1.0) == pytest.approx(0.0, abs=1e-15)  # steepest slope, at 61 % of the height
    assert curvature(1.5) < -0.05
    assert abs(curvature(1.5)) > abs(curvature(1.0))  # lower, yet more curved


def test_a_graph_has_a_metric_of_rank_one_beyond_the_identity():
    rng = np.random.default_rng(3)
    for _ in range(20):
        one = metric_matrix(rng.normal(size=(1, 4))) - np.eye(4)
        assert np.linalg.matrix_rank(one, tol=1e-10) == 1
        two = metric_matrix(rng.normal(size=(2, 4))) - np.eye(4)
        assert np.linalg.matrix_rank(two, tol=1e-10) == 2
    # So the metric diag(2, 3) of a flat plane with other units is not that of a graph over those coordinates.
    assert np.linalg.matrix_rank(np.diag([2.0, 3.0]) - np.eye(2)) == 2
