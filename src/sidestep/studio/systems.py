"""From a method and its numbers to a body and a system, and from a scenario file back to a method."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from sidestep import presets
from sidestep._core import GeometricSystem
from sidestep.barriers import Barriers
from sidestep.body import Body
from sidestep.robot import Robot
from sidestep.scenario import Scenario
from sidestep.scenario.assembly import written_system
from sidestep.scenario.scenario import (
    BodyChoice,
    EmbeddingChoice,
    JointLimitChoice,
    SwitchChoice,
    SystemChoice,
)
from sidestep.studio.methods import METHODS, WRITTEN, Method, Numbers, in_range


@dataclass(frozen=True)
class Covering:
    """A covering body with so many ellipsoids per link; None: as many as it takes."""

    ellipsoids: int | None


Recipe = Covering | BodyChoice  # of a body


@dataclass(frozen=True)
class Parts:
    """What a scenario file says of a method without barriers."""

    body: BodyChoice
    embedding: EmbeddingChoice
    system: SystemChoice


def parts_of(method: Method, numbers: Mapping[str, float], scenario: Scenario) -> Parts:
    """Body, embedding and system of a method without barriers; those of the scenario where it says how to move."""
    if method.name == WRITTEN:
        return Parts(scenario.body, scenario.embedding, scenario.system)
    system = SystemChoice(switch=switch_of(method.name, numbers, len(scenario.start.position)))
    if method.parameters:
        system = dataclasses.replace(system, stiffness=numbers["stiffness"], damping=numbers["damping"])
    return Parts(
        BodyChoice(components=presets.Thesis.components),
        EmbeddingChoice(joint_limits=JointLimitChoice()),
        system,
    )


def switch_of(method: str, numbers: Mapping[str, float], num_coordinates: int) -> SwitchChoice:
    """The switch of one of the thesis's methods as a scenario file has it."""
    match method:
        case "thesis":
            ends = {0, 1, num_coordinates - 1}
            thresholds = tuple(numbers["outer" if k in ends else "inner"] for k in range(num_coordinates))
            return SwitchChoice("distance", thresholds=thresholds, slope=numbers["slope"])
        case "sigmoid":
            return SwitchChoice("sigmoid", threshold=numbers["threshold"], slope=numbers["slope"])
        case "binary":
            return SwitchChoice("binary", threshold=numbers["threshold"])
        case "harmonic_only":
            return SwitchChoice("harmonic_only")
        case "geodesic_only":
            return SwitchChoice("geodesic_only")
    return SwitchChoice("none")


def recipe_of(method: Method, scenario: Scenario, ellipsoids: int | None) -> Recipe:
    """The body that a method needs."""
    if method.covering:
        return Covering(ellipsoids)
    return parts_of(method, method.defaults, scenario).body


def make_body(robot: Robot, recipe: Recipe, progress: Callable[[str, int, int], None] | None = None) -> Body:
    """The body, from the cache or made now."""
    if isinstance(recipe, Covering):
        return Body.cover(robot, components=recipe.ellipsoids, progress=progress)
    return Body.fit(robot, **dataclasses.asdict(recipe), progress=progress)


def build_system(
    method: Method, robot: Robot, body: Body, numbers: Mapping[str, float], scenario: Scenario
) -> GeometricSystem:
    """The dynamical system of a method with a body of its recipe."""
    if method.covering:
        return presets.barrier_system(robot, body, numbers=Barriers(**numbers))
    parts = parts_of(method, numbers, scenario)
    return written_system(parts.embedding, parts.system, robot, body)


def numbers_of(scenario: Scenario) -> tuple[str, Numbers]:
    """The method that a scenario file asks for, and the numbers it has for it.

    That is one of the page's where the file says exactly what one of them with its numbers is; else `WRITTEN`.
    """
    if scenario.method != "written":
        return scenario.method, {
            entry.name: getattr(scenario.barriers, entry.name) for entry in dataclasses.fields(Barriers)
        }
    asked = Parts(scenario.body, scenario.embedding, scenario.system)
    values = _values(scenario.system)
    for method in METHODS.values():
        numbers = {name: values.get(name, number) for name, number in method.defaults.items()}
        own = not method.covering and method.name != WRITTEN
        if own and in_range(method, numbers) and parts_of(method, numbers, scenario) == asked:
            return method.name, numbers
    return WRITTEN, {}


def _values(system: SystemChoice) -> Numbers:
    """The numbers of a file's system by the names that the methods have for them."""
    switch: Any = system.switch
    values = {"stiffness": system.stiffness, "damping": system.damping}
    if switch.thresholds:
        values["outer"] = switch.thresholds[0]
        if len(switch.thresholds) > 3:  # with fewer joints there is none between the first two and the last
            values["inner"] = switch.thresholds[2]
    given = {name: getattr(switch, name) for name in ("threshold", "slope")}
    return values | {name: value for name, value in given.items() if value is not None}
