"""Obstacles that are too old."""

from __future__ import annotations

import numpy as np
import pytest

import sidestep as ss
from sidestep.obstacles import pose_at

START, GOAL = np.array([0.0, 0.3, 0.3]), np.array([1.9, 0.3, 0.3])


@pytest.fixture(scope="module")
def planar() -> ss.Arm:
    return ss.Arm.load("planar3")


def test_old_obstacles_are_a_status_between_lost_margins_and_stops(planar: ss.Arm) -> None:
    assert ss.SafetyStatus.margin_lost < ss.SafetyStatus.stale < ss.SafetyStatus.stopping
    controller = ss.Controller(planar, ss.ControllerSettings(synchronous=True, obstacle_timeout=0.05))
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(GOAL)
    motion = ss.integrate(controller, START, np.zeros(3), steps=300)
    # the step that receives them is the first
    assert motion.statuses.index(ss.SafetyStatus.stale) == pytest.approx(51, abs=1)  # rounding of 50 periods
    assert (motion.statuses[-1], motion.activities[-1]) == (ss.SafetyStatus.stale, ss.Activity.stale)
    controller.set_obstacles(ss.Obstacles.none())
    command = controller.step(motion.last_q, motion.last_v)
    assert (command.status < ss.SafetyStatus.stale, command.activity) == (True, ss.Activity.moving)


def test_contact_is_worse_than_old_obstacles(planar: ss.Arm) -> None:
    controller = ss.Controller(planar, ss.ControllerSettings(synchronous=True, obstacle_timeout=0.05))
    controller.set_obstacles(ss.Sphere(0.2, pose_at(planar.robot.pose(START, "link2")[:3, 3])))
    motion = ss.integrate(controller, START, np.zeros(3), steps=60)
    assert motion.statuses[-1] == ss.SafetyStatus.clearance_lost
    assert motion.activities[-1] == ss.Activity.stale
