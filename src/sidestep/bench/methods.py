"""The systems of the methods that the benchmark compares."""

from __future__ import annotations

from sidestep import presets
from sidestep._core import GeometricSystem
from sidestep.bench.method import Method
from sidestep.robot import Robot


def build_system(method: Method, robot: Robot) -> GeometricSystem:
    """The system of a method for a robot; bodies come from the user's cache or are made now."""
    match method:
        case Method.thesis:
            return presets.thesis_system(robot)
        case Method.unswitched:
            return presets.thesis_system(robot, switched=False)
        case Method.barrier:
            return presets.barrier_system(robot)
