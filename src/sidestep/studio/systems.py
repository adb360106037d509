"""From a method and its numbers to a body and a system, and from a scenario file back to a method."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, cast

from sidestep._core import ControllerSettings
from sidestep.arm import Arm
from sidestep.body import Body
from sidestep.robot import Robot, tip_of
from sidestep.scenario import Scenario
from sidestep.scenario.config import controller_settings_of
from sidestep.scenario.scenario import (
    BodyConfig,
    EmbeddingConfig,
    JointLimitConfig,
    MethodChoice,
    SwitchConfig,
    SystemConfig,
)
from sidestep.studio.methods import CUSTOM, METHODS, Method, in_range
from sidestep.studio.mover import ControllerMover, Mover, SystemMover
from sidestep.studio.parameters import Numbers, Value, set_in
from sidestep.thesis.custom import custom_system, torque_qp_of

SWITCH = "system.switch"  # of several forms, with numbers of their own


@dataclass(frozen=True)
class Covering:
    """A covering body with so many ellipsoids per link; None: as many as it takes."""

    ellipsoids: int | None


Recipe = Covering | BodyConfig  # of a body


def as_file(method: Method, numbers: Mapping[str, Any], scenario: Scenario) -> Scenario:
    """The scenario with a method and its numbers as a file has them; what the method has no numbers for stays."""
    if method.name == CUSTOM:
        return dataclasses.replace(scenario, method="custom")
    if method.controlled:
        held = dataclasses.replace(scenario.simulation, integrator="semi_implicit_euler")
        written = dataclasses.replace(scenario, method=cast("MethodChoice", method.name), simulation=held)
    else:
        system = SystemConfig(switch=switch_of(method.name, numbers, len(scenario.start.position)))
        embedding = EmbeddingConfig(joint_limits=JointLimitConfig())
        written = dataclasses.replace(
            scenario,
            method="custom",
            body=dataclasses.replace(BodyConfig(), ellipsoids=scenario.body.ellipsoids),
            embedding=embedding,
            system=system,
        )
    places: dict[str, dict[str, Value]] = {}
    for parameter in method.parameters:
        if parameter.place != SWITCH:  # as a whole, above
            places.setdefault(parameter.place, {})[parameter.field] = numbers[parameter.name]
    for place, values in places.items():
        written = set_in(written, place, values)
    return written


def switch_of(method: str, numbers: Mapping[str, Any], num_coordinates: int) -> SwitchConfig:
    """The switch of one of the thesis's methods as a scenario file has it."""
    match method:
        case "thesis":
            ends = {0, 1, num_coordinates - 1}
            thresholds = tuple(numbers["outer" if k in ends else "inner"] for k in range(num_coordinates))
            return SwitchConfig("distance", thresholds=thresholds, slope=numbers["slope"])
        case "sigmoid":
            return SwitchConfig("sigmoid", threshold=numbers["threshold"], slope=numbers["slope"])
        case "binary":
            return SwitchConfig("binary", threshold=numbers["threshold"])
        case "harmonic_only":
            return SwitchConfig("harmonic_only")
        case "geodesic_only":
            return SwitchConfig("geodesic_only")
    return SwitchConfig("none")


def recipe_of(method: Method, numbers: Mapping[str, Any], scenario: Scenario) -> Recipe:
    """The body that a method needs."""
    written = as_file(method, numbers, scenario)
    body = written.body
    return Covering(body.ellipsoids) if method.controlled else dataclasses.replace(body, ellipsoids=None)


def make_body(robot: Robot, recipe: Recipe, progress: Callable[[str, int, int], None] | None = None) -> Body:
    """The body, from the cache or made now."""
    if isinstance(recipe, Covering):
        return Body.cover(robot, components=recipe.ellipsoids, progress=progress)
    return Body.fit(robot, **fit_arguments(recipe), progress=progress)


def fit_arguments(choice: BodyConfig) -> dict[str, Any]:
    """The arguments of `Body.fit` for a body of a scenario file."""
    return {name: value for name, value in dataclasses.asdict(choice).items() if name != "ellipsoids"}


def settings_of(written: Scenario, *, synchronous: bool = False) -> ControllerSettings:
    """The settings of the controller that moves the arm in physics, of a scenario of `as_file`."""
    torque = dataclasses.replace(written.simulation, mode="torque")
    return controller_settings_of(dataclasses.replace(written, simulation=torque), synchronous=synchronous)


def build_mover(
    method: Method,
    robot: Robot,
    body: Body,
    numbers: Mapping[str, Any],
    scenario: Scenario,
    *,
    synchronous: bool = False,
) -> Mover:
    """What moves the arm by a method, with a body of its recipe.

    Raises:
        ValueError: names the number at fault.
    """
    written, tip = as_file(method, numbers, scenario), tip_of(robot)
    if method.controlled:
        settings = settings_of(written, synchronous=synchronous)
        return ControllerMover(robot, Arm.from_robot(robot, body), settings, tip)
    system = custom_system(written.embedding, written.system, robot, body)
    program = torque_qp_of(written, robot)
    return SystemMover(robot, system, program, tip)


def numbers_of(scenario: Scenario) -> tuple[str, Numbers]:
    """The method that a scenario file asks for, and the numbers it has for it.

    That is one of the page's where the file says exactly what one of them with its numbers is; else `CUSTOM`.
    """
    if scenario.method != "custom":
        method = METHODS[scenario.method]
        return method.name, {parameter.name: parameter.of(scenario) for parameter in method.parameters}
    switched = _switch_numbers(scenario.system.switch)
    for method in METHODS.values():
        numbers = {
            p.name: switched.get(p.name, p.default) if p.place == SWITCH else p.of(scenario)
            for p in method.parameters
        }
        own = not method.controlled and method.name != CUSTOM
        if own and in_range(method, numbers) and as_file(method, numbers, scenario) == scenario:
            return method.name, numbers
    return CUSTOM, {}


def _switch_numbers(choice: SwitchConfig) -> Numbers:
    """The numbers of a file's switch by the names that the methods have for them."""
    values: Numbers = {}
    if choice.thresholds:
        values["outer"] = choice.thresholds[0]
        if len(choice.thresholds) > 3:  # with fewer joints there is none between the first two and the last
            values["inner"] = choice.thresholds[2]
    given = {name: getattr(choice, name) for name in ("threshold", "slope")}
    return values | {name: value for name, value in given.items() if value is not None}
