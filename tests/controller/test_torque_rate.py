"""The torque's rate is kept where clearances brake an arm, until one is lost."""

from __future__ import annotations

import numpy as np
import pytest

import sidestep as ss

PERIOD = 0.001


@pytest.mark.parametrize("order", [[2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [2.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0]])
@pytest.mark.parametrize("angle", [0.6, 1.0])
def test_an_arm_that_is_driven_at_a_ball_brakes_within_the_rate(order: list[float], angle: float) -> None:
    """At one of the four the torque once changed 25 times as fast as it may: the row began to brake too late."""
    arm = ss.Arm.load("fr3")
    tip = arm.robot.pose(arm.neutral, "fr3_hand_tcp")[:3, 3]
    c, s = np.cos(angle), np.sin(angle)
    ball = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ tip
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True))
    controller.set_obstacles(ss.Obstacles([ball], radii=0.06))
    q, v = arm.neutral.copy(), np.zeros(arm.num_coordinates)
    torques, least, fastest = [], np.inf, 0.0
    for _ in range(1500):
        controller.set_velocity(order)
        command = controller.step(q, v)
        torques.append(command.torque.copy())
        least = min(least, command.clearance)
        v = v + PERIOD * np.linalg.solve(arm.mass_matrix(q), command.torque - arm.bias(q, v))
        q = q + PERIOD * v
        fastest = max(fastest, v[0])
    rate = np.abs(np.diff(torques, axis=0)) / PERIOD
    assert (rate <= arm.limits.effort_rate * (1.0 + 1e-9)).all()
    assert fastest > 1.0  # [rad/s] before it braked
    assert 0.0045 < least < 0.015  # [m] the margin is 0.005
