"""The impedance around the reference: a spring of known stiffness, within limits and off obstacles."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import sidestep as ss

PERIOD = 0.001
Force = Callable[[float], np.ndarray]


@pytest.fixture(scope="module")
def arm() -> ss.Arm:
    return ss.Arm.load("fr3")


def pushed(
    arm: ss.Arm, stiffness: float, force: Force, seconds: float, obstacles: ss.Obstacles | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The arm holds its neutral configuration while torques push it: q, command.torque (K, nv), clearance (K,)."""
    settings = ss.ControllerSettings(synchronous=True)
    settings.tracking.stiffness = stiffness
    controller = ss.Controller(arm, settings)
    controller.set_goal(arm.neutral)
    controller.set_obstacles(ss.Obstacles.none() if obstacles is None else obstacles)
    q, v = arm.neutral.copy(), np.zeros(arm.num_coordinates)
    way, torques, clearances = [], [], []
    for k in range(round(seconds / PERIOD)):
        command = controller.step(q, v)
        torques.append(command.torque.copy())
        clearances.append(command.clearance)
        a = np.linalg.solve(arm.mass_matrix(q), command.torque + force(k * PERIOD) - arm.bias(q, v))
        v = v + PERIOD * a
        q = q + PERIOD * v
        way.append(q)
    return np.array(way), np.array(torques), np.array(clearances)


def on_joint(arm: ss.Arm, joint: int, torque: float, begin: float, end: float) -> Force:
    def force(time: float) -> np.ndarray:
        wrench = np.zeros(arm.num_coordinates)
        wrench[joint] = torque if begin <= time < end else 0.0
        return wrench

    return force


@pytest.mark.parametrize("joint", [0, 3, 6])
@pytest.mark.parametrize("stiffness", [2.0, 5.0, 20.0])
def test_a_push_moves_the_arm_as_far_as_the_spring_says(arm: ss.Arm, joint: int, stiffness: float) -> None:
    effort = arm.limits.effort[joint]
    q, torque, _ = pushed(arm, stiffness, on_joint(arm, joint, 0.1 * effort, 0.2, 1.2), 2.2)
    off = q - arm.neutral
    expected = 0.1 / stiffness  # τ/K, K = stiffness times effort limit
    assert off[1190, joint] == pytest.approx(expected, rel=0.02)
    assert np.abs(np.delete(off[1190], joint)).max() < 0.02 * expected
    assert np.abs(off[-1]).max() < 5e-4  # and back
    rate = np.abs(np.diff(torque, axis=0)) / PERIOD
    assert (rate <= arm.limits.effort_rate * (1.0 + 1e-9)).all()
    assert (np.abs(torque) <= arm.limits.effort).all()


def test_what_holds_the_arm_in_vain_is_not_made_up_for(arm: ss.Arm) -> None:
    """Stiff tracking takes a constant torque up, an impedance yields to it for as long as it lasts."""
    force = on_joint(arm, 0, 8.7, 0.2, 10.0)
    stiff, _, _ = pushed(arm, 0.0, force, 2.0)
    yields, _, _ = pushed(arm, 2.0, force, 2.0)
    assert abs(stiff[-1, 0] - arm.neutral[0]) < 1e-3
    assert yields[-1, 0] - arm.neutral[0] == pytest.approx(0.05, rel=0.02)


def test_a_push_towards_an_obstacle_ends_before_it(arm: ss.Arm) -> None:
    tip = arm.robot.pose(arm.neutral, "fr3_hand_tcp")[:3, 3]
    beside = np.array([-tip[1], tip[0], 0.0]) / np.hypot(tip[0], tip[1])  # where joint 1 moves the tip
    ball = ss.Obstacles([tip + 0.16 * beside], radii=0.05)
    force = on_joint(arm, 0, 30.0, 0.2, 1.2)
    free, _, _ = pushed(arm, 2.0, force, 1.2)
    there = ss.Controller(arm, ss.ControllerSettings(synchronous=True))
    there.set_obstacles(ball)
    at_rest = np.zeros(arm.num_coordinates)
    assert there.step(free[-1], at_rest).clearance < -0.01  # where the push would have taken it
    q, _, clearance = pushed(arm, 2.0, force, 2.2, ball)
    assert clearance[0] > 0.05
    assert clearance.min() > 0.0045  # [m] the margin is 0.005
    assert np.abs(q[-1] - arm.neutral).max() < 0.005


def test_only_an_arm_that_is_moved_by_torque_has_an_impedance(arm: ss.Arm) -> None:
    settings = ss.ControllerSettings(output="acceleration")
    settings.tracking.stiffness = 5.0
    with pytest.raises(ValueError, match=r"tracking\.stiffness is 5\.0*, .* not moved by torque, allowed: 0"):
        ss.Controller(arm, settings)
