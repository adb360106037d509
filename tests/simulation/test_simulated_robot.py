"""`SimulatedRobot`, `JointDrives` and `LimitWatch`: what commands do, and what happens without."""

from __future__ import annotations

import numpy as np
import pytest

from sidestep import Robot, SceneObject
from sidestep._core import JointLimits
from sidestep.simulation.evaluation import outside_of
from sidestep.simulation.joint_drives import FREQUENCY, VELOCITY_GAIN
from sidestep.simulation.limit_watch import LimitWatch
from sidestep.simulation.motion_record import MotionRecord
from sidestep.simulation.simulated_robot import Mode, SimulatedRobot

PERIOD = 1e-3
START = np.deg2rad([0.0, 45.0, 0.0, -66.0, 0.0, 66.0, 45.0])


@pytest.fixture(scope="module")
def fr3() -> Robot:
    return Robot.named("fr3_arm")


def run(robot: SimulatedRobot, values, cycles: int, first: int = 0) -> None:
    """So many cycles, each with a command; values: (nv,), or a function of the cycle."""
    for k in range(first, first + cycles):
        robot.take(k + 1, np.asarray(values(k) if callable(values) else values, dtype=float))
        robot.advance()


def test_the_world_stands_still_until_somebody_starts(fr3: Robot) -> None:
    ball = SceneObject.ball("ball", [0.5, 0.5, 0.5], radius=0.05, motion="moving", velocity=(0.1, 0.0, 0.0))
    robot = SimulatedRobot(fr3, (ball,), START)
    for _ in range(50):
        robot.advance()
    assert (robot.time, robot.mode) == (0.0, Mode.waiting)
    robot.start("torque")
    for _ in range(50):
        robot.advance()
    assert robot.time == pytest.approx(0.05)
    # driven objects are where they are at the beginning of the cycle
    assert robot.sample().object_poses[0, 0] == pytest.approx(0.5 + 0.1 * 0.05, abs=1e-9)


def test_it_adds_gravity_to_torques(fr3: Robot) -> None:
    robot = SimulatedRobot(fr3, (), START)
    robot.start("torque")
    run(robot, np.zeros(7), 200)
    sample = robot.sample()
    np.testing.assert_allclose(sample.q, START, atol=1e-9)  # rounding of two models of one arm
    np.testing.assert_allclose(sample.torque, fr3.bias(START, np.zeros(7)), atol=1e-6)


def test_an_acceleration_is_carried_out(fr3: Robot) -> None:
    robot = SimulatedRobot(fr3, (), START)
    robot.start("acceleration")
    a = np.array([0.5, -0.4, 0.3, 0.2, -0.6, 0.7, 0.8])
    run(robot, a, 300)
    # semi-implicit Euler, exact model
    np.testing.assert_allclose(robot.sample().v, 0.3 * a, atol=1e-6)
    np.testing.assert_allclose(robot.sample().q, START + 0.5 * a * 0.3 * (0.3 + PERIOD), atol=1e-6)


def test_a_velocity_is_approached_with_the_gain_of_the_drive(fr3: Robot) -> None:
    robot = SimulatedRobot(fr3, (), START)
    robot.start("velocity")
    wanted = np.full(7, 0.001)  # by less than 1 Nm in a cycle
    run(robot, wanted, 10)
    share = 1.0 - (1.0 - VELOCITY_GAIN * PERIOD) ** 10
    np.testing.assert_allclose(robot.sample().v, share * wanted, rtol=1e-4)


def test_positions_are_followed_and_moved_on_where_one_is_missing(fr3: Robot) -> None:
    robot = SimulatedRobot(fr3, (), START)
    robot.start("position")
    speed = 0.2

    def at(k: int) -> np.ndarray:  # begins and goes on smoothly
        time = (k + 1) * PERIOD
        return START + speed * (time - np.tanh(20.0 * time) / 20.0)

    run(robot, at, 600)
    error = np.abs(robot.sample().q - at(599)).max()
    assert error < speed / FREQUENCY * 0.05  # a critically damped drive with velocity feedforward
    robot.advance()  # without a command
    np.testing.assert_allclose(robot.sample().q, at(600), atol=1.1 * error)  # it goes on at the same velocity
    np.testing.assert_allclose(robot.sample().v, speed, rtol=1e-2)


def test_positions_too_fast_for_a_joint_stop_the_arm(fr3: Robot) -> None:
    robot = SimulatedRobot(fr3, (), START)
    robot.start("position")
    run(robot, START, 10)
    jump = 1.5 * PERIOD * fr3.limits.velocity[2] * np.eye(7)[2]
    run(robot, START + jump, 1, first=10)
    assert robot.mode == Mode.stopped
    assert robot.trouble == (
        "positions told to joint 'fr3_joint3' cannot be followed: a speed of 1.5 times its limit"
    )
    run(robot, START, 300, first=11)
    assert robot.at_rest
    np.testing.assert_allclose(robot.sample().q, START, atol=1e-3)


def test_a_joint_that_cannot_follow_its_positions_stops_the_arm(fr3: Robot) -> None:
    robot = SimulatedRobot(fr3, (), START)
    robot.start("position")
    half = 0.5 * fr3.limits.velocity[0] * np.eye(7)[0]  # from rest at once: the motors take longer than that
    run(robot, lambda k: START + (k + 1) * PERIOD * half, 60)
    assert robot.mode == Mode.stopped
    assert robot.trouble.startswith("positions told to joint 'fr3_joint1' cannot be followed: it is 0.00")
    assert robot.limits.to_dict()["velocity"]["largest"] < 1.0
    run(robot, START, 800, first=60)
    assert robot.at_rest
    assert robot.limits.to_dict()["torque rate"]["largest"] < 1.0 + 1e-6  # also where the drive changes


def test_torques_hold_for_a_while_and_then_the_arm_brakes_within_its_limits(fr3: Robot) -> None:
    robot = SimulatedRobot(fr3, (), START, hold_cycles=20)
    robot.start("acceleration")
    run(robot, lambda k: np.full(7, 1.5 * min(1.0, k / 50)), 400)
    for _ in range(19):
        robot.advance()
    assert robot.mode == Mode.controlled
    robot.limits = LimitWatch(fr3.limits, PERIOD)
    for _ in range(800):
        robot.advance()
    assert robot.mode == Mode.stopped
    assert robot.trouble == "no command for 20 cycles"
    assert robot.at_rest
    assert robot.limits.broken == ()
    assert robot.limits.to_dict()["acceleration"]["cycles"] == 0
    rested = robot.sample().q
    for _ in range(300):
        robot.advance()
    np.testing.assert_allclose(robot.sample().q, rested, atol=1e-3)  # it holds
    robot.take(10_000, np.full(7, 5.0))  # too late: control has ended
    robot.advance()
    assert robot.sample().taken < 10_000


def test_it_waits_for_the_first_command_as_long_as_it_takes(fr3: Robot) -> None:
    robot = SimulatedRobot(fr3, (), START, hold_cycles=5)
    robot.start("torque")
    for _ in range(100):
        robot.advance()
    assert robot.mode == Mode.controlled
    assert robot.sample().lost == 0


def test_a_command_that_cannot_be_is_refused_and_an_old_one_left(fr3: Robot) -> None:
    robot = SimulatedRobot(fr3, (), START)
    robot.start("torque")
    robot.take(5, np.zeros(7))
    robot.take(4, np.full(7, 50.0))
    assert robot.sample().taken == 5
    with pytest.raises(ValueError, match="command 6 has 7 values, 6 of them finite; allowed: 7"):
        robot.take(6, np.array([0.0, np.nan, *np.zeros(5)]))
    with pytest.raises(ValueError, match="command 7 has 2 values"):
        robot.take(7, np.zeros(2))


def test_limits_that_a_command_exceeds_are_counted_by_value(fr3: Robot) -> None:
    robot = SimulatedRobot(fr3, (), START, ramps=False)
    robot.start("torque")
    run(robot, np.zeros(7), 10)
    run(robot, np.array([3.0, *np.zeros(6)]), 1, first=10)  # the limit is 1 Nm in a cycle
    found = robot.to_dict()
    assert found["limits_exceeded"] == ["torque rate"]
    rate = found["limits"]["torque rate"]
    assert rate["cycles"] == 1
    assert rate["worst"] == pytest.approx(3.0 / PERIOD - fr3.limits.effort_rate[0], rel=1e-3)
    run(robot, np.array([200.0, *np.zeros(6)]), 1, first=11)
    assert robot.to_dict()["limits"]["torque"]["worst"] == pytest.approx(
        200.0 - fr3.limits.effort[0], abs=1.0
    )
    assert robot.sample().torque[0] == fr3.limits.effort[0]  # what the motor gives


def test_larger_steps_of_the_torque_are_approached_at_the_rate_limit_and_counted(fr3: Robot) -> None:
    robot = SimulatedRobot(fr3, (), START)
    robot.start("torque")
    run(robot, np.zeros(7), 10)
    at_rest = robot.sample().torque
    torques = []
    for k in range(10, 14):
        run(robot, np.array([3.0, 0.0, 1.5, *np.zeros(4)]), 1, first=k)
        torques.append(robot.sample().torque - at_rest)
    # 1 Nm in a cycle, the third joint by the same share; gravity moves by less than a thousandth meanwhile
    np.testing.assert_allclose(
        [t[[0, 2]] for t in torques], [[1, 0.5], [2, 1], [3, 1.5], [3, 1.5]], atol=2e-3
    )
    found = robot.to_dict()
    assert found["limits_exceeded"] == []
    assert found["torque_leaps"]["cycles"] == 2
    assert found["torque_leaps"]["largest"] == pytest.approx(3.0, rel=1e-3)


def test_contacts_are_counted(fr3: Robot) -> None:
    ball = SceneObject.ball("ball", fr3.pose(START, fr3.frames[-1].name)[:3, 3], radius=0.05)
    robot = SimulatedRobot(fr3, (ball,), START)
    robot.start("torque")
    run(robot, np.zeros(7), 3)
    assert robot.to_dict()["contacts"] > 0
    assert all(pair.endswith("- ball") for pair in robot.contacts)


def test_the_motion_is_recorded_as_it_was(fr3: Robot, tmp_path) -> None:
    record = MotionRecord()
    robot = SimulatedRobot(fr3, (), START, record=record)
    robot.start("velocity")
    run(robot, np.full(7, 0.05), 20)
    record.save(tmp_path / "motion.npz")
    with np.load(tmp_path / "motion.npz") as rows:
        assert rows["q"].shape == rows["v"].shape == rows["torque"].shape == (20, 7)
        np.testing.assert_allclose(rows["time"], PERIOD * np.arange(20))
        np.testing.assert_array_equal(rows["q"][0], START)
        assert rows["object_poses"].shape == (20, 0, 7)


def test_position_limits_count_but_for_a_start_a_rounding_error_outside(fr3: Robot) -> None:
    watch = LimitWatch(fr3.limits, PERIOD)
    zero = np.zeros(7)
    q = START.copy()
    q[0] = fr3.limits.upper[0] + 1e-6
    watch.observe(q, zero, zero, zero)
    assert watch.found["position"].cycles == 0
    q[0] = fr3.limits.upper[0] + 0.01
    watch.observe(q, zero, zero, zero)
    assert watch.found["position"].cycles == 1
    assert watch.found["position"].worst == pytest.approx(0.01, abs=2e-6)


def test_a_start_outside_by_rounding_counts_once_it_has_come_in(fr3: Robot) -> None:
    watch = LimitWatch(fr3.limits, PERIOD)
    zero, inside = np.zeros(7), START.copy()
    outside = START.copy()
    outside[0] = fr3.limits.upper[0] + JointLimits.rounding
    for q in (outside, inside):
        watch.observe(q, zero, zero, zero)
    assert watch.found["position"].cycles == 0
    watch.observe(outside, zero, zero, zero)
    assert watch.found["position"].cycles == 1
    samples = np.array([outside, inside, outside])
    assert watch.found["position"].worst == pytest.approx(outside_of(samples, fr3.limits).max(), rel=1e-9)
