"""The torque program of a scenario that is not moved by a `Controller`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sidestep._core import MotionProgram, SafetySettings
from sidestep.robot import Robot
from sidestep.scenario.config import PROGRAM, made, value_in
from sidestep.scenario.scenario import Scenario


def torque_qp_of(scenario: Scenario, robot: Robot) -> MotionProgram:
    """The torque QP that a scenario asks for; raises ValueError that names the number at fault."""
    return MotionProgram(robot, period=scenario.simulation.period, **program_from(scenario.controller))


def program_from(section: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments of a `MotionProgram`, but for robot and period.

    Raises:
        ValueError: names the setting, its value and what is allowed.
    """
    numbers = {name: value_in(section, name) for name in PROGRAM}
    return numbers | {"safety": made(SafetySettings(), section.get("safety", {}))}
