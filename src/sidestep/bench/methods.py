"""What moves an arm by the methods that the benchmark compares."""

from __future__ import annotations

from typing import Protocol

from sidestep._core import BarrierSettings, Controller, ControllerSettings, GeometricSystem
from sidestep.arm import Arm
from sidestep.bench.method import Method
from sidestep.bench.motion import ControllerRunner, ProblemRunner
from sidestep.body import Body
from sidestep.body.cover import CoverProgress
from sidestep.plugins import plugins
from sidestep.robot import Robot
from sidestep.scenario.config import ABLATIONS


class BenchMethod(Protocol):
    """A method beside the controller, which an entry point of the group "sidestep.bench" brings."""

    def body(self, robot: Robot) -> Body:
        """The body that it needs, from the user's cache or made now."""

    def runner(self, robot: Robot, body: Body) -> ProblemRunner:
        """What moves a robot through problems."""


def build_body(
    method: Method, robot: Robot, *, draft: bool = False, progress: CoverProgress | None = None
) -> Body:
    """The body that a method needs, from the user's cache or made now; draft: where it covers, coarser, in seconds."""
    if method.safe:
        return Body.cover(robot, effort="draft" if draft else "fine", progress=progress)
    return _brought(method).body(robot)


def build_runner(method: Method, robot: Robot, body: Body | None = None) -> ProblemRunner:
    """What moves a robot by a method; by default with the body of `build_body`."""
    body = build_body(method, robot) if body is None else body
    if not method.safe:
        return _brought(method).runner(robot, body)
    return ControllerRunner(robot, Arm.from_robot(robot, body), dict.fromkeys(ABLATIONS[method]))


def _brought(method: Method) -> BenchMethod:
    found: dict[str, BenchMethod] = plugins("sidestep.bench")
    if method not in found:
        raise ValueError(f"method {method.value!r} needs the room sidestep.thesis; it is not installed")
    return found[method]


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


build_mover = build_runner  # its name in 0.2
