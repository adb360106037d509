"""Noise of the measured state does not reach the streams that drives follow."""

from __future__ import annotations

import numpy as np
import pytest

import sidestep as ss

PERIOD = 1e-3


@pytest.mark.parametrize("output", ["velocity", "position"])
@pytest.mark.parametrize(("q_noise", "v_noise"), [(1e-4, 0.02), (1e-3, 0.05)])
def test_jerk_of_the_velocity_stream_is_within_its_limit_under_noise(
    output: str, q_noise: float, v_noise: float
) -> None:
    arm, rng = ss.Arm.load("fr3"), np.random.default_rng(0)
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True, output=output))
    controller.set_obstacles(ss.Obstacles.none())
    goal = arm.neutral + 0.4
    controller.set_goal(goal)
    q, v, sent = arm.neutral.copy(), np.zeros(7), []
    for _ in range(2500):
        command = controller.step(
            q + rng.normal(scale=q_noise, size=7), v + rng.normal(scale=v_noise, size=7)
        )
        sent.append(np.array(command.velocity))
        v = np.array(command.velocity) if output == "velocity" else (np.array(command.position) - q) / PERIOD
        q = q + PERIOD * v
    acceleration = np.diff(sent, axis=0) / PERIOD
    jerk = np.diff(acceleration, axis=0) / PERIOD
    assert (np.abs(acceleration) <= arm.limits.acceleration).all()
    assert (np.abs(jerk) <= arm.limits.jerk).all()
    np.testing.assert_allclose(q, goal, atol=0.01)
