"""The systems of the methods that the benchmark compares."""

from __future__ import annotations

from collections.abc import Callable

from sidestep import presets
from sidestep._core import GeometricSystem
from sidestep.bench.method import Method
from sidestep.body import Body
from sidestep.guidance import GuidedMotion
from sidestep.link_pairs import tables_and_pairs
from sidestep.robot import Robot


def build_body(method: Method, robot: Robot) -> Body:
    """The body that a method needs, from the user's cache or made now."""
    if method.safe:
        return Body.cover(robot)
    return Body.fit(robot, components=presets.Thesis().components)


def build_system(method: Method, robot: Robot, body: Body | None = None) -> GeometricSystem:
    """The system of a method for a robot; by default with the body of `build_body`."""
    body = build_body(method, robot) if body is None else body
    match method:
        case Method.thesis:
            return presets.thesis_system(robot, body)
        case Method.unswitched:
            return presets.thesis_system(robot, body, switched=False)
        case Method.barrier | Method.guided:
            return presets.barrier_system(robot, body)


def build_guide(
    method: Method, robot: Robot, system: GeometricSystem, body: Body | None = None
) -> Callable[[int], GuidedMotion] | None:
    """What makes a guided motion of a seed, the same every time; None where the method has no guide."""
    if method is not Method.guided:
        return None
    covering = build_body(method, robot) if body is None else body
    tables, pairs = tables_and_pairs(robot, covering)
    return lambda seed: GuidedMotion(
        robot, covering, system=system, pairs=pairs, tables=tables, seed=seed, synchronous=True
    )
