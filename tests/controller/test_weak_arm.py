"""An arm whose efforts give far less than its acceleration limits moves all the same."""

import numpy as np
import pytest

import sidestep as ss

PERIOD = 0.001


@pytest.mark.parametrize("effort_margin", [0.05, 0.5])
def test_an_arm_with_a_weak_wrist_arrives_under_torque(effort_margin: float) -> None:
    arm = ss.Arm.load("planar3")  # 0.72 Nm at the wrist: a stop with 10 rad/s^2 takes eight times as much
    settings = ss.ControllerSettings(output="torque", synchronous=True, effort_margin=effort_margin)
    controller = ss.Controller(arm, settings)
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(arm.neutral + 0.3)
    q, v = np.array(arm.neutral), np.zeros(3)
    for _ in range(3000):
        command = controller.step(q, v)
        assert np.all(np.abs(command.torque) <= arm.limits.effort)
        v = v + PERIOD * command.acceleration
        q = q + PERIOD * v
    assert np.abs(q - 0.3).max() < 0.01  # before, it crept at 2 mrad/s
    assert controller.command.activity == ss.Activity.arrived
