"""What moves an arm by the methods that the benchmark compares."""

from __future__ import annotations

from sidestep._core import BarrierSettings, Controller, ControllerSettings, GeometricSystem
from sidestep.arm import Arm
from sidestep.bench.method import Method
from sidestep.bench.motion import ControllerMover, Mover
from sidestep.bench.thesis import SystemMover
from sidestep.body import Body
from sidestep.body.cover import CoverProgress
from sidestep.robot import Robot
from sidestep.scenario.config import ABLATIONS
from sidestep.thesis import ThesisNumbers, thesis_system


def build_body(
    method: Method, robot: Robot, *, draft: bool = False, progress: CoverProgress | None = None
) -> Body:
    """The body that a method needs, from the user's cache or made now; draft: where it covers, coarser, in seconds."""
    if method.safe:
        return Body.cover(robot, effort="draft" if draft else "fine", progress=progress)
    return Body.fit(robot, components=ThesisNumbers().components)


def build_mover(method: Method, robot: Robot, body: Body | None = None) -> Mover:
    """What moves a robot by a method; by default with the body of `build_body`."""
    body = build_body(method, robot) if body is None else body
    match method:
        case Method.thesis:
            return SystemMover(robot, thesis_system(robot, body))
        case Method.unswitched:
            return SystemMover(robot, thesis_system(robot, body, switched=False))
    return ControllerMover(robot, Arm.from_robot(robot, body), dict.fromkeys(ABLATIONS[method]))


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
