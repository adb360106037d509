"""Scenarios of method "custom": a geometric system that the file writes out moves the arm."""

from __future__ import annotations

from typing import Any, Protocol

from sidestep._core import GeometricSystem
from sidestep.body import Body
from sidestep.plugins import plugins
from sidestep.robot import Robot
from sidestep.scenario.scenario import EmbeddingConfig, SystemConfig
from sidestep.simulation.adapter import Adapter, KinematicAdapter


class RunAdapter(Adapter, KinematicAdapter, Protocol):
    """Drives the arm of a run, with physics or without."""


class CustomMethod(Protocol):
    """What a package brings for them, by an entry point of the group "sidestep.scenario" called "custom"."""

    def system_of(
        self, embedding: EmbeddingConfig, system: SystemConfig, robot: Robot, body: Body
    ) -> GeometricSystem:
        """The system that a file writes out; raises ValueError where it does not fit the robot."""

    def SystemAdapter(
        self, system: GeometricSystem, goal: Any, obstacles: Any, torque_qp: Any, *, integrator: Any
    ) -> RunAdapter:
        """What drives the arm by it, with a torque program."""


def custom_method() -> CustomMethod:
    """Raises ValueError where no package brings it."""
    found: dict[str, CustomMethod] = plugins("sidestep.scenario")
    if "custom" not in found:
        raise ValueError("method is custom, which needs the room sidestep.thesis; it is not installed")
    return found["custom"]
