"""Errata 4, 5, 6 and 21: the derivatives of chapter 4."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import multivariate_normal

from sidestep import Obstacles
from sidestep._core import Body
from sidestep.thesis import CollisionDensity
from sidestep.thesis.reproduce import planar

MEAN = np.array([0.3, -0.2, 0.1])
POINT = np.array([0.5, 0.1, -0.2])
COVARIANCE = np.array([[0.20, 0.03, 0.01], [0.03, 0.10, -0.02], [0.01, -0.02, 0.15]])
STEP = 1e-5


def gaussian(mean=MEAN, covariance=COVARIANCE):
    return multivariate_normal(mean, covariance).pdf(POINT)


def test_dimension_is_that_of_the_task_space():
    body = Body(links=["link1"], weights=[1.0], means=[MEAN], covariances=[COVARIANCE])
    found = (
        CollisionDensity(planar.arm(), body)
        .evaluate([0.0, 0.0], [0.0, 0.0], Obstacles(POINT[None]))
        .values[0]
    )
    X = planar.arm().pose([0.0, 0.0], "link1")
    y = X[:3, :3].T @ (POINT - X[:3, 3])
    e = y - MEAN
    quadratic = np.exp(-0.5 * e @ np.linalg.solve(COVARIANCE, e)) / np.sqrt(np.linalg.det(COVARIANCE))
    assert found == pytest.approx(quadratic / (2 * np.pi) ** 1.5, rel=1e-12)
    joints = 2
    assert abs(found / (quadratic / (2 * np.pi) ** (joints / 2)) - 1.0) > 0.5


def test_derivative_by_the_mean():
    numeric = np.array(
        [(gaussian(MEAN + STEP * e) - gaussian(MEAN - STEP * e)) / (2 * STEP) for e in np.eye(3)]
    )
    # T4.9 as it ends; central differences of step 1e-5 are good to about 1e-9 here.
    exact = gaussian() * np.linalg.solve(COVARIANCE, POINT - MEAN)
    np.testing.assert_allclose(numeric, exact, rtol=1e-7)


def test_derivative_by_covariance_has_the_determinant():
    L = np.linalg.inv(COVARIANCE)
    w = L @ (POINT - MEAN)
    printed = 0.5 * gaussian() * np.outer(w, w)
    right = 0.5 * gaussian() * (np.outer(w, w) - L)
    rng = np.random.default_rng(0)
    for _ in range(20):
        change = rng.normal(size=(3, 3))
        change = change + change.T
        numeric = (
            gaussian(covariance=COVARIANCE + STEP * change) - gaussian(covariance=COVARIANCE - STEP * change)
        ) / (2 * STEP)
        assert np.sum(right * change) == pytest.approx(numeric, rel=1e-5, abs=1e-7)
    assert np.abs(printed - right).max() > 0.1 * np.abs(right).max()
    # A rotation keeps the determinant, so there the two agree: that is why the thesis's psi(q) is not hurt.
    S = np.array([[0.0, -0.3, 0.5], [0.3, 0.0, -0.2], [-0.5, 0.2, 0.0]])
    turning = S @ COVARIANCE + COVARIANCE @ S.T
    assert np.sum(printed * turning) == pytest.approx(np.sum(right * turning), abs=1e-12)


def test_second_derivative_of_a_covariance():
    def rotation(q):
        return (Rotation.from_rotvec([q[0], 0, 0]) * Rotation.from_rotvec([0, q[1], 0])).as_matrix()

    def covariance(q):
        return rotation(q) @ COVARIANCE @ rotation(q).T

    q, h = np.array([0.4, 0.7]), 1e-4
    ex, ey = h * np.eye(2)

    def mixed(f):
        return (f(q + ex + ey) - f(q + ex - ey) - f(q - ex + ey) + f(q - ex - ey)) / (4 * h * h)

    R = rotation(q)
    dR = [(rotation(q + e) - rotation(q - e)) / (2 * h) for e in (ex, ey)]
    ends = mixed(rotation) @ COVARIANCE @ R.T
    ends = ends + ends.T
    right = ends + dR[0] @ COVARIANCE @ dR[1].T + dR[1] @ COVARIANCE @ dR[0].T
    printed = ends + 2.0 * dR[0] @ COVARIANCE @ dR[1].T
    # Differences of differences with step 1e-4: rounding of 1e-16 / 1e-8, truncation 1e-8.
    np.testing.assert_allclose(right, mixed(covariance), atol=1e-7)
    assert np.abs(printed - mixed(covariance)).max() > 1e-2
    assert np.abs(printed - printed.T).max() > 1e-2
