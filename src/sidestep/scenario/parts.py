"""The parts of a run by the numbers of a scenario: the settings of the controller, the thesis's torque program."""

from __future__ import annotations

import dataclasses

from sidestep._core import (
    BarrierSettings,
    ControllerSettings,
    LocalMinimumSettings,
    LookAheadSettings,
    OnlinePlannerSettings,
    PlannerSettings,
    RouteSettings,
    SafetySettings,
    TorqueController,
)
from sidestep.robot import Robot
from sidestep.scenario.scenario import Scenario
from sidestep.scenario.settings import TorqueChoice

OWN_OF_PROGRAM = (
    "torque_weight",
    "slack_weight",
    "safety_weight",
    "stop_damping",
)  # with method written alone


def controller_settings_of(scenario: Scenario, *, synchronous: bool = True) -> ControllerSettings:
    """The settings of the `Controller` that a scenario asks for.

    Raises:
        ValueError: names the number at fault and what is allowed.
    """
    torque = scenario.torque
    if scenario.simulation.integrator != "semi_implicit_euler":
        raise ValueError(
            f"simulation.integrator is {scenario.simulation.integrator!r}; the controller's commands are held for a "
            "period: allowed is semi_implicit_euler"
        )
    barriers = dataclasses.asdict(scenario.barriers)
    barriers.pop("ellipsoids")
    planner = OnlinePlannerSettings()
    planner.search = PlannerSettings(**dataclasses.asdict(scenario.guide.planner))
    planner.route = RouteSettings(**dataclasses.asdict(scenario.guide.route))
    reactive = scenario.method == "reactive"
    return ControllerSettings(
        synchronous=synchronous,
        period=scenario.simulation.period,
        output="torque" if scenario.simulation.mode == "torque" else "acceleration",
        position_margin=torque.position_margin,
        stop_time=torque.stop_time,
        stop_damping=torque.stop_damping,
        torque_weight=torque.torque_weight,
        slack_weight=torque.slack_weight,
        safety_weight=torque.safety_weight,
        barriers=BarrierSettings(**barriers),
        safety=SafetySettings(**dataclasses.asdict(torque.safety)),
        planner=planner if scenario.method == "controller" else None,
        look_ahead=None if reactive else LookAheadSettings(**dataclasses.asdict(scenario.evasion)),
        local_minimum=None if reactive else LocalMinimumSettings(**dataclasses.asdict(scenario.escape)),
    )


def torque_program_of(choice: TorqueChoice, robot: Robot, period: float) -> TorqueController:
    """The torque program with a period [s]; raises ValueError that names the number at fault."""
    numbers = dataclasses.asdict(choice) | {"safety": SafetySettings(**dataclasses.asdict(choice.safety))}
    return TorqueController(robot, period=period, **numbers)
