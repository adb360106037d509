"""A start inside a margin: the arm gets out within its jerk limits, and no nearer."""

from __future__ import annotations

import numpy as np
import pytest

import sidestep as ss
from sidestep.obstacles import pose_at

RADIUS = 0.05  # [m] of the ball beside the hand
PERIOD = 1e-3  # [s]


@pytest.mark.parametrize("seed", [1, 2])  # with 2 the jerk was 3.9 times its limit
@pytest.mark.parametrize("gap", [0.001, 0.003])  # [m]; the margin is 5 mm
def test_the_way_out_of_a_margin_keeps_the_jerk_limits(gap: float, seed: int) -> None:
    arm = ss.Arm.load("fr3")
    rng = np.random.default_rng(seed)
    q = arm.neutral + rng.uniform(-0.3, 0.3, 7)
    v, acceleration = np.zeros(7), np.zeros(7)
    robot = arm.robot
    assert isinstance(robot, ss.Robot)
    hand = robot.pose(q, robot.frames[-1].name)[:3, 3]
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)

    def beside_a_ball(distance: float) -> ss.Controller:
        controller = ss.Controller(arm)
        controller.set_obstacles([ss.Sphere(RADIUS, pose_at(hand + distance * direction))])
        return controller

    near, far = RADIUS, 0.5
    for _ in range(40):
        middle = 0.5 * (near + far)
        near, far = (near, middle) if beside_a_ball(middle).step(q, v).clearance > gap else (middle, far)

    controller, clearances = beside_a_ball(far), []
    for period in range(1000):  # the arm moves on by a period a step, whatever the machine's clock says
        command = controller.step(q, v, time=period * PERIOD)
        clearances.append(command.clearance)
        assert (np.abs(command.acceleration - acceleration) <= arm.limits.jerk * PERIOD).all()
        q, v, acceleration = command.position, command.velocity, command.acceleration
    assert clearances[0] == pytest.approx(gap, abs=1e-6)
    assert min(clearances) >= gap - 1e-6
    assert clearances[-1] > controller.settings.safety.margin
