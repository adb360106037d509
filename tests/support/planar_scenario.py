"""A scenario under torque that physics and the controller share."""

from __future__ import annotations

from dataclasses import replace

from sidestep.scenario import Scenario
from sidestep.scenario.assembly import Assembly, assemble


def planar_scenario() -> tuple[Scenario, Assembly]:
    """planar-one-obstacle without its obstacle, led by the controller under torque at 1 kHz; and its parts."""
    scenario = Scenario.load("planar-one-obstacle")
    scenario = replace(
        scenario,
        method="controller",
        obstacles=(),
        simulation=replace(scenario.simulation, mode="torque", period=0.001),
    )
    return scenario, assemble(scenario)
