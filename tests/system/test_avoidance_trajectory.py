"""AvoidanceTrajectory: to rest at a configuration, each joint as fast as its limits allow."""

import copy

import numpy as np
import pytest

import sidestep as ss
from sidestep.robot import planar_arm
from sidestep.system import AvoidanceTrajectory

START = np.array([0.0, -0.5, 0.3, -1.5, 0.0, 1.5, 0.5])
AT_REST = np.zeros(7)
WAY = np.array(
    [2.5, -0.05, 0.4, 1.0, -2.0, 0.001, 0.0]
)  # long ones, at full speed for a while, and short ones


@pytest.fixture(scope="module")
def robot():
    return ss.Robot.named("fr3")


def references(flight, period, duration):
    """Positions and velocities (T, 2, nv) of the reference, a row per period."""
    rows = []
    for _ in range(round(duration / period)):
        rows.append((flight.position, flight.velocity))
        flight.advance(period)
    return np.array(rows)


@pytest.mark.parametrize("period", [0.001, 0.01, 0.05])
def test_it_is_as_quick_as_nine_tenths_of_the_limits_allow(robot, period):
    rows = references(AvoidanceTrajectory(robot, START, AT_REST, START + WAY), period, 4.0)
    fastest, hardest = 0.9 * robot.limits.velocity, 0.9 * robot.limits.acceleration
    q, v = rows[:, 0], rows[:, 1]
    assert np.all(np.abs(v) <= fastest + 1e-9)
    assert np.all(np.abs(np.diff(v, axis=0)) <= hardest * period + 1e-9)
    assert np.all((q - START) * np.sign(WAY) <= np.abs(WAY) + 1e-9)  # never beyond
    np.testing.assert_allclose(q[-1], START + WAY, atol=1e-6)
    # The trapezoid of a long way, the triangle of a short one; the end takes some periods more.
    distance = np.abs(WAY)
    ramp = fastest / hardest
    ideal = np.where(distance > fastest * ramp, distance / fastest + ramp, 2.0 * np.sqrt(distance / hardest))
    near = np.abs(q - START - WAY) <= 0.01 * distance
    assert np.all(period * near.argmax(axis=0) <= ideal + 6.0 * period)


def test_a_joint_that_is_too_fast_to_stop_in_time_comes_back(robot):
    v = 0.9 * robot.limits.velocity
    rows = references(AvoidanceTrajectory(robot, START, v, START + 0.01), 0.001, 3.0)
    stop = v**2 / (1.8 * robot.limits.acceleration)
    np.testing.assert_allclose(rows[:, 0].max(axis=0), START + stop, atol=0.01)
    np.testing.assert_allclose(rows[-1, 0], START + 0.01, atol=1e-6)


def test_an_arm_follows_it_and_comes_back_to_it(robot):
    flight = AvoidanceTrajectory(robot, START, AT_REST, START + 1.0)
    q, v = START.copy(), AT_REST.copy()
    np.testing.assert_allclose(flight.acceleration(q, v, 0.001), 0.9 * robot.limits.acceleration)
    pull = flight.acceleration(q + 0.01 * np.eye(7)[0], v + 0.1 * np.eye(7)[1], 0.001) - flight.acceleration(
        q, v, 0.001
    )
    np.testing.assert_allclose(pull, [-1.0, -2.0, 0.0, 0.0, 0.0, 0.0, 0.0], atol=1e-12)
    q += 0.05  # put aside
    for _ in range(4000):
        v = v + 0.001 * flight.acceleration(q, v, 0.001)
        q = q + 0.001 * v
        flight.advance(0.001)
    np.testing.assert_allclose(q, START + 1.0, atol=1e-4)


def test_steps_may_be_of_any_length(robot):
    one, many = (AvoidanceTrajectory(robot, START, 0.1 * WAY, START + WAY) for _ in range(2))
    one.advance(0.01)
    for _ in range(10):
        many.advance(0.001)
    hardest = 0.9 * robot.limits.acceleration
    assert np.all(np.abs(one.velocity - 0.1 * WAY) <= 0.01 * hardest + 1e-12)
    assert np.all(np.abs(many.velocity - one.velocity) <= 0.01 * hardest)
    assert np.all(np.abs(many.position - one.position) <= 0.01**2 * hardest)
    copied = copy.copy(one)
    copied.advance(0.01)
    assert np.any(copied.position != one.position)


def test_what_has_no_limits_is_flown_at_a_finite_acceleration():
    free = ss.Robot.from_urdf(planar_arm(1), acceleration_limits=np.inf)
    assert np.isinf(free.limits.acceleration).all()
    flight = AvoidanceTrajectory(free, np.zeros(1), np.zeros(1), np.ones(1))
    np.testing.assert_allclose(flight.acceleration(np.zeros(1), np.zeros(1), 0.001), 90.0)


def test_bad_input_is_named(robot):
    with pytest.raises(ValueError, match=r"target has shape \(3,\), expected \(7,\)"):
        AvoidanceTrajectory(robot, START, START, np.zeros(3))
    with pytest.raises(ValueError, match=r"q\[0\] is nan, must be a finite number"):
        AvoidanceTrajectory(robot, START * np.nan, START, START)
    for period in (0.0, np.nan):
        with pytest.raises(ValueError, match=r"period is .* s, must be positive and finite"):
            AvoidanceTrajectory(robot, START, START, START).acceleration(START, START, period)
        with pytest.raises(ValueError, match=r"period is .* s, must be positive and finite"):
            AvoidanceTrajectory(robot, START, START, START).advance(period)
