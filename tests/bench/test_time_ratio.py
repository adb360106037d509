"""Times of motions over those of TOPP-RA."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sidestep._core import JointLimits
from sidestep.bench.time_ratio import KNOTS, ratio_to_optimum


def limits(velocity: float, acceleration: float) -> JointLimits:
    pair = np.ones(2)
    return JointLimits(
        lower=-9.0 * pair,
        upper=9.0 * pair,
        velocity=velocity * pair,
        acceleration=acceleration * pair,
        effort=pair,
    )


def straight(way: float, acceleration: float, period: float = 0.001) -> tuple[np.ndarray, float]:
    """The fastest motion of the first joint over a way, sampled: half of it at full acceleration, half back."""
    half = np.sqrt(way / acceleration)
    t = np.arange(0.0, 2.0 * half, period)
    s = np.where(t < half, 0.5 * acceleration * t**2, way - 0.5 * acceleration * (2.0 * half - t) ** 2)
    return np.column_stack([s, np.zeros_like(s)]), 2.0 * half


def test_the_fastest_motion_has_the_ratio_one_and_a_slow_one_more():
    q, duration = straight(1.0, 4.0)
    assert_allclose(ratio_to_optimum(q, duration, limits(5.0, 4.0)), 1.0, rtol=0.01)  # its grid
    assert_allclose(ratio_to_optimum(q, 2.0 * duration, limits(5.0, 4.0)), 2.0, rtol=0.01)
    # At most 1 rad/s: 1 s for the way and 0.25 s to get there and back.
    assert_allclose(ratio_to_optimum(q, 2.5, limits(1.0, 4.0)), 2.0, rtol=0.01)


def test_waiting_on_the_path_counts_as_time_alone():
    q, duration = straight(1.0, 4.0)
    waiting = np.concatenate([q[:300], np.repeat(q[300:301], 1000, axis=0), q[300:]])
    assert_allclose(ratio_to_optimum(waiting, duration + 1.0, limits(5.0, 4.0)), 2.0, rtol=0.01)


@pytest.mark.parametrize("way", [0.0, 3.0 * KNOTS])
def test_a_path_too_short_for_a_spline_has_none(way: float):
    q = np.linspace(0.0, way, 50)[:, None] * np.ones(2) / np.sqrt(2.0)
    assert ratio_to_optimum(q, 1.0, limits(1.0, 4.0)) is None


def test_without_limits_there_is_no_optimum():
    q, duration = straight(1.0, 4.0)
    assert ratio_to_optimum(q, duration, limits(np.inf, 4.0)) is None
