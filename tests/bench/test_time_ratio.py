"""Times of motions over those of TOPP-RA."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sidestep._core import JointLimits
from sidestep.bench import jerk_limited_optimum
from sidestep.bench.executed_path import SHORTEST
from sidestep.bench.time_ratio import KNOTS, ratio_to_jerk_limited_optimum, ratio_to_optimum


def limits(velocity: float, acceleration: float) -> JointLimits:
    pair = np.ones(2)
    return JointLimits(
        lower=-9.0 * pair,
        upper=9.0 * pair,
        velocity=velocity * pair,
        acceleration=acceleration * pair,
        effort=pair,
        jerk=100.0 * acceleration * pair,
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


def test_with_a_limit_of_jerk_the_ratio_is_smaller_and_nan_where_none_is_found(
    monkeypatch: pytest.MonkeyPatch,
):
    q, duration = straight(1.0, 4.0)
    found = ratio_to_jerk_limited_optimum(q, 2.0 * duration, limits(5.0, 4.0))
    assert found is not None
    # 10 ms for each ramp of acceleration: 1 s becomes 1.01 s; jerk switches at nodes alone
    assert_allclose(found, 2.0 / 1.01, rtol=0.01)
    monkeypatch.setattr(jerk_limited_optimum, "ITERATIONS", 2)
    assert np.isnan(ratio_to_jerk_limited_optimum(q, duration, limits(5.0, 4.0)))


def test_with_a_limit_of_jerk_too_a_short_path_or_no_limit_has_none():
    q, duration = straight(1.0, 4.0)
    assert ratio_to_jerk_limited_optimum(q, duration, limits(np.inf, 4.0)) is None
    assert ratio_to_jerk_limited_optimum(0.9 * SHORTEST * q, duration, limits(5.0, 4.0)) is None
