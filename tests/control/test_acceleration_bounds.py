"""Acceleration bounds on the limits of real arms. The C++ tests cover millions of single-joint cases."""

import numpy as np
import pytest

import sidestep as ss
from sidestep._core import JointLimits
from sidestep.control import acceleration_bounds

PERIOD = 0.001


def limits_of_one_joint(lower=-1.0, upper=1.0):
    return JointLimits(lower=[lower], upper=[upper], velocity=[2.0], acceleration=[10.0], effort=[50.0])


@pytest.mark.parametrize("name", ["fr3", "ur5", "planar3"])
def test_extreme_accelerations_never_leave_the_limits(name):
    robot = ss.Robot.named(name)
    limits = robot.limits
    rng = np.random.default_rng(0)
    q, v = robot.neutral.copy(), np.zeros(robot.num_coordinates)
    high = rng.random(robot.num_coordinates) < 0.5
    for _ in range(5000):
        lower, upper = acceleration_bounds(robot, q, v, PERIOD)
        assert np.all(lower <= upper)
        high ^= rng.random(robot.num_coordinates) < 0.002  # long pushes, so that every limit is reached
        a = np.where(high, upper, lower)
        v = v + PERIOD * a
        q = q + PERIOD * v
        # Rounding of q, up to 10, added up over a few hundred periods of braking.
        assert np.all((q <= limits.upper + 1e-12) & (q >= limits.lower - 1e-12))
        assert np.all(np.abs(v) <= limits.velocity + 1e-12)


@pytest.mark.parametrize(
    ("q", "v", "lower", "upper"),
    [
        (0.0, 0.0, -10.0, 10.0),  # free
        (0.99, 1.0, -10.0, -10.0),  # needs 0.05 rad to stop and has 0.01: full braking
        (1.0, 0.0, -10.0, 0.0),  # on the limit
        (1.2, 0.0, -10.0, -10.0),  # outside: back with all there is
        (-1.2, 0.0, 10.0, 10.0),
        (0.0, 1.995, -10.0, 5.0),  # (2 - 1.995)/0.001 to the velocity limit
        (0.0, 2.5, -10.0, -10.0),  # too fast
    ],
)
def test_bounds_by_hand(q, v, lower, upper):
    got = acceleration_bounds(limits_of_one_joint(), [q], [v], PERIOD)
    np.testing.assert_allclose(np.concatenate(got), [lower, upper], atol=1e-9)  # 1e-16/period of rounding


def test_continuous_joint_has_velocity_and_acceleration_bounds_only():
    limits = limits_of_one_joint(-np.inf, np.inf)
    np.testing.assert_array_equal(
        np.concatenate(acceleration_bounds(limits, [1e3], [0.0], PERIOD)), [-10.0, 10.0]
    )


def test_bad_input_raises():
    limits = limits_of_one_joint()
    with pytest.raises(ValueError, match="finite"):
        acceleration_bounds(limits, [np.nan], [0.0], PERIOD)
    with pytest.raises(ValueError, match="period"):
        acceleration_bounds(limits, [0.0], [0.0], 0.0)
    with pytest.raises(ValueError, match=r"v has shape \(2,\)"):
        acceleration_bounds(limits, [0.0], [0.0, 0.0], PERIOD)
    with pytest.raises(TypeError, match="Robot or JointLimits"):
        acceleration_bounds("fr3", [0.0], [0.0], PERIOD)
