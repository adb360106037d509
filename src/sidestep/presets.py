"""The geometric system that Sidestep recommends, with one set of numbers for every robot and scene."""

from __future__ import annotations

from sidestep._core import BarrierSettings, Controller, ControllerSettings, GeometricSystem
from sidestep.arm import Arm
from sidestep.body import Body
from sidestep.robot import Robot


def barrier_system(
    robot: Robot, body: Body | None = None, *, numbers: BarrierSettings | None = None
) -> GeometricSystem:
    """The geometric system of a `Controller`: a barrier for every part of the body, joint limit and pair of links.

    Args:
        robot: the arm. body: a covering body of it; by default `Body.cover(robot)`.
        numbers: in place of the defaults.
    """
    settings = ControllerSettings(synchronous=True, planner=None, barriers=numbers or BarrierSettings())
    return Controller(Arm.from_robot(robot, body), settings).system
