"""The settings of the `Controller` of a scenario."""

from __future__ import annotations

from sidestep._core import ControllerSettings
from sidestep.scenario.config import left_out, made
from sidestep.scenario.scenario import Scenario


def controller_settings_of(scenario: Scenario, *, synchronous: bool = True) -> ControllerSettings:
    """The settings of the `Controller` that a scenario asks for.

    Raises:
        ValueError: names the setting, its value and what is allowed.
    """
    run = scenario.simulation
    if run.integrator != "semi_implicit_euler":
        raise ValueError(
            f"simulation.integrator is {run.integrator!r}; the controller's commands are held for a "
            "period: allowed is semi_implicit_euler"
        )
    missing = dict.fromkeys(left_out(scenario.controller, scenario.method))
    output = "torque" if run.mode == "torque" else "acceleration"
    elsewhere = {"synchronous": synchronous, "period": run.period, "output": output}
    settings: ControllerSettings = made(ControllerSettings(), {**scenario.controller, **missing, **elsewhere})
    return settings
