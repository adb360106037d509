"""The parts of a run by the numbers of a scenario: the settings of the controller, the thesis's torque program."""

from __future__ import annotations

from sidestep._core import ControllerSettings, TorqueController
from sidestep.robot import Robot
from sidestep.scenario.scenario import Scenario
from sidestep.scenario.settings import program_from, settings_from


def controller_settings_of(scenario: Scenario, *, synchronous: bool = True) -> ControllerSettings:
    """The settings of the `Controller` that a scenario asks for.

    Raises:
        ValueError: names the number at fault and what is allowed.
    """
    run = scenario.simulation
    if run.integrator != "semi_implicit_euler":
        raise ValueError(
            f"simulation.integrator is {run.integrator!r}; the controller's commands are held for a "
            "period: allowed is semi_implicit_euler"
        )
    return settings_from(
        scenario.controller,
        scenario.method,
        synchronous=synchronous,
        period=run.period,
        output="torque" if run.mode == "torque" else "acceleration",
    )


def torque_program_of(scenario: Scenario, robot: Robot) -> TorqueController:
    """The torque program that a scenario asks for; raises ValueError that names the number at fault."""
    return TorqueController(robot, period=scenario.simulation.period, **program_from(scenario.controller))
