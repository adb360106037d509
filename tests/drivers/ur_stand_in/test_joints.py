"""How the stand-in's joints move, and what a UR would stop for."""

import numpy as np
import pytest

from sidestep import Arm
from sidestep.drivers.ur_stand_in.joints import BRAKE, DRIVE_LAG, Brake, Joints, Servo, Speed

PERIOD = 0.002
START = np.array([0.0, -1.6, 1.6, -1.6, -1.6, 0.0])


@pytest.fixture(scope="module")
def arm() -> Arm:
    return Arm.load("ur10")


@pytest.fixture
def joints(arm: Arm) -> Joints:
    return Joints(arm, START, PERIOD)


def steps(joints: Joints, count: int) -> list[str]:
    said = [joints.step() for _ in range(count)]
    return [words for words in said if words]


def test_they_rest_until_they_are_told(joints: Joints) -> None:
    assert steps(joints, 100) == []
    assert joints.resting
    np.testing.assert_array_equal(joints.position, START)


def test_a_servo_comes_to_its_target(joints: Joints) -> None:
    joints.motion = Servo(START + 0.01, lookahead=0.1, gain=300.0)
    assert steps(joints, 1000) == []
    np.testing.assert_allclose(joints.position, START + 0.01, atol=1e-9)  # 30 time constants


def test_a_servo_that_is_told_ahead_follows_without_delay(joints: Joints) -> None:
    lookahead, gain, far, rate = 0.03, 2000.0, 0.3, 2.0
    late, worst = 0.0, 0.0
    for number in range(1, 2000):
        time = number * PERIOD
        share = min(1.0, number / 200)  # the motion begins smoothly
        angle, speed = far * (1 - np.cos(rate * time)), far * rate * np.sin(rate * time)
        ahead = lookahead * share * speed + share * far * rate**2 * np.cos(rate * time) / gain
        joints.motion = Servo(START + share * angle + ahead, lookahead, gain)
        assert joints.step() is None
        if number > 400:
            worst = max(worst, float(np.abs(joints.target - START - angle).max()))
            late = max(late, float(np.abs(joints.position - joints.target).max()))
    assert worst < 2.0 * PERIOD * far * rate  # two cycles of the largest speed; a servo without it is 15 late
    assert late == pytest.approx(
        DRIVE_LAG * far * rate, rel=0.3
    )  # less the half period by which samples differ


def test_speeds_change_by_the_acceleration_of_the_joint_that_needs_longest(joints: Joints) -> None:
    wanted = np.array([1.0, 0.5, 0.0, 0.0, 0.0, -0.2])
    joints.motion = Speed(wanted, acceleration=2.0)
    assert steps(joints, 125) == []  # 0.25 s: half of it
    np.testing.assert_allclose(joints.target_velocity, 0.5 * wanted, atol=1e-12)
    assert steps(joints, 200) == []
    np.testing.assert_allclose(joints.target_velocity, wanted, atol=1e-12)


def test_a_brake_ends_every_motion(joints: Joints) -> None:
    joints.motion = Speed(np.full(6, 1.0), acceleration=40.0)
    steps(joints, 100)
    joints.motion = Brake()
    assert steps(joints, round(1.0 / BRAKE / PERIOD)) == []
    assert not joints.target_velocity.any()
    steps(joints, 100)
    assert joints.resting


@pytest.mark.parametrize(
    ("motion", "words"),
    [
        (
            Servo(START + 0.1 * np.eye(6)[2], 0.03, 2000.0),
            "elbow_joint: a sudden change of the target: 200.0 rad/s²",
        ),
        (
            Speed(np.array([2.5, 0, 0, 0, 0, 0]), 40.0),
            "shoulder_pan_joint: the joint is too fast: 2.40 rad/s",
        ),
        (Speed(np.array([0, 0, 3.0, 0, 0, 0]), 10.0), "elbow_joint: the joint is beyond its limit by 0.00"),
    ],
)
def test_they_say_what_a_ur_would_stop_for(joints: Joints, motion: Servo | Speed, words: str) -> None:
    joints.motion = motion
    said = steps(joints, 500)
    assert said[0].startswith(words)


def test_they_say_where_the_torque_is_too_large(arm: Arm) -> None:
    joints = Joints(arm, np.zeros(6), PERIOD)  # stretched out horizontally
    joints.motion = Speed(np.array([0, -1.0, 0, 0, 0, 0]), acceleration=40.0)
    assert steps(joints, 10)[0].startswith("shoulder_lift_joint: the joint needs too much torque")


def test_the_torque_at_rest_is_that_of_gravity(joints: Joints, arm: Arm) -> None:
    joints.step()
    np.testing.assert_allclose(joints.torque, arm.bias(START, np.zeros(6)), atol=1e-9)
