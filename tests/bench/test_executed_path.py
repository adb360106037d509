"""Smooth curves through executed samples."""

import numpy as np
from numpy.testing import assert_allclose

from sidestep.bench.executed_path import DEVIATION, ExecutedPath


def arc(count: int = 2000, noise: float = 0.0) -> np.ndarray:
    angle = np.linspace(0.0, np.pi, count)
    q = np.column_stack([np.cos(angle), np.sin(angle)])
    return q + noise * np.random.default_rng(0).standard_normal(q.shape)


def test_the_curve_stays_close_and_its_derivatives_are_those_of_the_arc():
    path = ExecutedPath.through(arc())
    assert path is not None
    assert path.deviation < DEVIATION
    sigma = np.linspace(0.1, 0.9, 9)
    first, second, _ = path.derivatives(sigma)
    assert_allclose(np.linalg.norm(first, axis=1), np.pi, rtol=0.02)  # DEVIATION allows no closer
    assert_allclose(np.linalg.norm(second, axis=1), np.pi**2, rtol=0.1)


def test_derivatives_are_those_of_the_curve():
    path = ExecutedPath.through(arc())
    assert path is not None
    sigma, eps = np.linspace(0.05, 0.95, 50), 1e-5
    before = (path(sigma - eps), *path.derivatives(sigma - eps))
    after = (path(sigma + eps), *path.derivatives(sigma + eps))
    for order, value in enumerate(path.derivatives(sigma)):
        by_differences = (after[order] - before[order]) / (2.0 * eps)
        assert_allclose(value, by_differences, rtol=1e-6, atol=1e-5 * np.abs(value).max())


def test_waiting_leaves_the_curve_as_it_is():
    q = arc()
    waiting = np.concatenate([q[:700], np.repeat(q[700:701], 500, axis=0), q[700:]])
    sigma = np.linspace(0.0, 1.0, 30)
    assert_allclose(ExecutedPath.through(waiting)(sigma), ExecutedPath.through(q)(sigma))


def test_noise_within_the_deviation_is_smoothed():
    rough, smooth = ExecutedPath.through(arc(200, noise=1e-4)), ExecutedPath.through(arc(200))
    sigma = np.linspace(0.0, 1.0, 300)
    largest = [np.abs(path(sigma, 3)).max() for path in (rough, smooth)]
    assert largest[0] < 3.0 * largest[1]  # interpolated, noise of 1e-4 each 0.016 rad gives hundreds of times


def test_a_motion_that_does_not_move_has_no_path():
    assert ExecutedPath.through(np.ones((10, 2))) is None


def test_a_jump_is_not_smoothed_away():
    q = np.concatenate([np.zeros((1, 2)), np.ones((1, 2)), np.array([[1.0, 0.0]])])
    path = ExecutedPath.through(q)
    assert path is None or path.deviation < DEVIATION
