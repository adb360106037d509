"""The methods that the benchmark compares."""

from __future__ import annotations

from enum import StrEnum

from sidestep import presets
from sidestep._core import GeometricSystem
from sidestep.robot import Robot


class Method(StrEnum):
    """How an arm is moved; each with one set of numbers for every robot and problem, see `sidestep.presets`."""

    thesis = "thesis"  #: one summed density, distance switch (T6.2)
    unswitched = "unswitched"  #: the same without the switch (T2.12)
    barrier = "barrier"  #: a barrier per ellipsoid of a covering body, per joint limit and per pair of links

    @property
    def safe(self) -> bool:
        """Whether clearances and limits bound the acceleration as well: part of the method, not of the thesis's."""
        return self is Method.barrier


def build_system(method: Method, robot: Robot) -> GeometricSystem:
    """The system of a method for a robot; bodies come from the user's cache or are made now."""
    match method:
        case Method.thesis:
            return presets.thesis_system(robot)
        case Method.unswitched:
            return presets.thesis_system(robot, switched=False)
        case Method.barrier:
            return presets.barrier_system(robot)
