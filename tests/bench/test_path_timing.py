"""Timings along a path."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sidestep.bench.executed_path import ExecutedPath
from sidestep.bench.path_timing import PathTiming, smooth_timing, topp_ra_timing

LIMITS = SimpleNamespace(
    velocity=np.array([2.0, 2.0]), acceleration=np.array([6.0, 8.0]), jerk=np.array([60.0, 90.0])
)


@pytest.fixture(scope="module")
def path() -> ExecutedPath:
    s = np.linspace(0.0, 3.0, 1500)
    found = ExecutedPath.through(np.column_stack([s, np.sin(2.0 * s)]))
    assert found is not None
    return found


def test_the_smooth_timing_keeps_all_limits_and_reaches_one(path: ExecutedPath):
    timing = smooth_timing(path, LIMITS)
    assert timing.sigma[[0, -1]] == pytest.approx([0.0, 1.0], abs=1e-12)
    # its own polynomial, but for the chord of jerk between 400 nodes
    assert timing.excess(path, LIMITS, 10).max() == pytest.approx(0.0, abs=0.01)


def test_stretching_divides_derivatives(path: ExecutedPath):
    timing = smooth_timing(path, LIMITS)
    slower = timing.stretched(2.0)
    assert slower.duration == pytest.approx(2.0 * timing.duration)
    assert_allclose(np.gradient(slower.sigma, slower.times)[5:-5], slower.v[5:-5], rtol=0.01, atol=1e-4)


def test_what_breaks_a_limit_between_nodes_is_seen():
    """One joint, one interval of 1 s: a = 6 (1 - 2t), so |v| is largest in its middle, 1.5."""
    s = np.linspace(0.0, 1.0, 500)[:, None]
    path = ExecutedPath.through(s)
    assert path is not None
    timing = PathTiming(
        np.array([0.0, 1.0]), np.zeros(2), np.array([6.0, -6.0]), np.array([-12.0]), np.ones(1)
    )
    loose = np.array([1e3])
    limits = SimpleNamespace(velocity=np.array([1.0]), acceleration=loose, jerk=loose)
    assert timing.excess(path, limits, 10) == pytest.approx([0.5], abs=0.01)  # the path's deviation


def test_nodes_are_dense_where_the_path_turns(path: ExecutedPath):
    corner = np.concatenate(
        [np.linspace([0.0, 0.0], [1.0, 0.0], 500), np.linspace([1.0, 0.0], [1.0, 1.0], 500)]
    )
    turning = ExecutedPath.through(corner)
    assert turning is not None
    fastest = topp_ra_timing(turning, LIMITS)
    assert fastest is not None
    nodes = fastest.spread_nodes(turning, 100)
    assert len(nodes) == 101 + 6  # three more at each end
    assert nodes[[0, -1]] == pytest.approx([0.0, 1.0])
    assert np.all(np.diff(nodes) > 0.0)
    middle, aside = (np.sum(np.abs(nodes - at) < 0.05) for at in (0.5, 0.25))
    assert middle > 2 * aside
