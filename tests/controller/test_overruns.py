"""Overruns of velocity and acceleration, and position limits, are bounds: also where points jump into the arm."""

from __future__ import annotations

import numpy as np
import pytest

import sidestep as ss

PERIOD = 0.001
ROUNDING = 1e-6  # relative, of a program's solution


@pytest.mark.parametrize("told", [False, True])
@pytest.mark.parametrize(("name", "seed"), [("fr3", 0), ("panda", 0), ("panda", 3), ("ur10", 1)])
def test_nothing_exceeds_the_overruns(name: str, seed: int, told: bool) -> None:
    """Clouds that jump at 30 Hz: joints moved at 1.49 times their limits, and 1 mrad beyond position limits."""
    arm = ss.Arm.load(name)
    limits, settings = arm.limits, ss.ControllerSettings(synchronous=True, planner=None, look_ahead=None)
    controller = ss.Controller(arm, settings)
    random = np.random.default_rng(seed)
    q, v = arm.neutral.copy(), np.zeros(arm.num_coordinates)
    low, high = np.maximum(limits.lower, -3.0), np.minimum(limits.upper, 3.0)
    fastest = hardest = farthest = 0.0
    for k in range(2000):
        if k % 33 == 0:
            points = random.uniform([-1.0, -1.0, 0.0], [1.0, 1.0, 1.2], (100, 3))
            velocities = 0.3 * random.normal(size=(100, 3))
            controller.set_obstacles(ss.Obstacles(points, 0.02, velocities if told else None))
        if k % 700 == 0:
            controller.set_goal(random.uniform(low, high))
        command = controller.step(q, v)
        hardest = max(hardest, np.max(np.abs(command.velocity - v) / PERIOD / limits.acceleration))
        q, v = command.position, command.velocity
        fastest = max(fastest, np.max(np.abs(v) / limits.velocity))
        farthest = max(farthest, np.max(np.maximum(q - limits.upper, limits.lower - q)))
    assert fastest <= settings.velocity_overrun * (1.0 + ROUNDING)
    assert hardest <= settings.acceleration_overrun * (1.0 + ROUNDING)
    assert farthest <= 1e-9  # [rad]


@pytest.mark.parametrize("output", ["position", "velocity"])
def test_a_position_command_stays_within_the_limits_under_noise(output: str) -> None:
    """Measured at its limit, a joint seems to be 1 mrad beyond: that was commanded."""
    arm = ss.Arm.load("fr3")
    limits = arm.limits
    controller = ss.Controller(arm, ss.ControllerSettings(output=output, synchronous=True, planner=None))
    controller.set_obstacles(ss.Obstacles.none())
    random = np.random.default_rng(4)
    q = arm.neutral.copy()
    q[0], q[5] = limits.upper[0], limits.lower[5]
    goal = q.copy()
    controller.set_goal(goal)
    first = q + np.array([1e-3, 0.0, 0.0, 0.0, 0.0, -1e-3, 0.0])
    for k in range(300):
        measured = first if k == 0 else q + 1e-3 * random.normal(size=7)
        command = controller.step(measured, np.zeros(7))
        assert (command.position <= limits.upper).all()
        assert (command.position >= limits.lower).all()
        q = command.position
