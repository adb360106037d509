"""The parts of a run beside body and system, by the numbers of a scenario: sub-goals, flights, guide, torque."""

from __future__ import annotations

import dataclasses

from sidestep._core import (
    Escape,
    Evasion,
    GeometricSystem,
    PlannerSettings,
    RouteSettings,
    SafetySettings,
    TorqueController,
)
from sidestep.body import Body
from sidestep.guidance import GuidedMotion
from sidestep.robot import Robot
from sidestep.scenario.settings import EscapeChoice, EvasionChoice, GuideChoice, TorqueChoice


def escape_of(choice: EscapeChoice, robot: Robot) -> Escape:
    """Sub-goals where the arm is stuck; raises ValueError that names the number at fault."""
    return Escape(robot, **dataclasses.asdict(choice))


def evasion_of(choice: EvasionChoice, system: GeometricSystem) -> Evasion:
    """Flights out of the way of what moves; raises ValueError that names the number at fault."""
    return Evasion(system, **dataclasses.asdict(choice))


def guide_of(
    choice: GuideChoice, robot: Robot, body: Body, system: GeometricSystem, *, synchronous: bool
) -> GuidedMotion:
    """What leads the arm along a path; raises ValueError that names the number at fault."""
    return GuidedMotion(
        robot,
        body,
        system=system,
        planner=PlannerSettings(**dataclasses.asdict(choice.planner)),
        route=RouteSettings(**dataclasses.asdict(choice.route)),
        synchronous=synchronous,
    )


def torque_program_of(choice: TorqueChoice, robot: Robot, period: float) -> TorqueController:
    """The torque program with a period [s]; raises ValueError that names the number at fault."""
    numbers = dataclasses.asdict(choice) | {"safety": SafetySettings(**dataclasses.asdict(choice.safety))}
    return TorqueController(robot, period=period, **numbers)
