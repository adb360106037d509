"""From a method and its numbers to a body and a system, and from a scenario file back to a method."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

from sidestep._core import ControllerSettings
from sidestep.arm import Arm
from sidestep.body import Body
from sidestep.robot import Robot, tip_of
from sidestep.scenario import Scenario
from sidestep.scenario.assembly import description_of
from sidestep.scenario.controller_settings import controller_settings_of
from sidestep.scenario.scenario import BodyConfig, MethodChoice
from sidestep.studio.adapter import Adapter, ControllerAdapter
from sidestep.studio.methods import METHODS
from sidestep.studio.other_methods import methods_of_custom
from sidestep.studio.parameters import Method, Numbers

if TYPE_CHECKING:
    from sidestep.arm import Progress


@dataclass(frozen=True)
class Covering:
    """A covering body with so many ellipsoids per link; None: as many as it takes. draft: made in seconds, coarser."""

    ellipsoids: int | None
    draft: bool = False


Recipe = Covering | BodyConfig  # of a body


def as_file(method: Method, numbers: Mapping[str, Any], scenario: Scenario) -> Scenario:
    """The scenario with a method and its numbers as a file has them; what the method has no numbers for stays."""
    if method.controlled:
        held = dataclasses.replace(scenario.simulation, integrator="semi_implicit_euler")
        written = dataclasses.replace(scenario, method=cast("MethodChoice", method.name), simulation=held)
    else:
        written = methods_of_custom().custom_scenario(method.name, numbers, scenario)
    return method.write(numbers, written)


def recipe_of(
    method: Method, numbers: Mapping[str, Any], scenario: Scenario, *, draft: bool = False
) -> Recipe:
    """The body that a method needs; draft: where as many ellipsoids as it takes are wanted, a draft of them."""
    written = as_file(method, numbers, scenario)
    body = written.body
    if method.controlled:
        return Covering(body.ellipsoids, draft=draft and body.ellipsoids is None)
    return dataclasses.replace(body, ellipsoids=None)


def make_body(robot: Robot, recipe: Recipe, progress: Callable[[str, int, int], None] | None = None) -> Body:
    """The body, from the cache or made now."""
    if isinstance(recipe, Covering) and recipe.draft:
        return Body.cover(robot, effort="draft", progress=progress)
    if isinstance(recipe, Covering):
        return Body.cover(robot, components=recipe.ellipsoids, progress=progress)
    return Body.fit(robot, **fit_arguments(recipe), progress=progress)


def draft_arm(scenario: Scenario, progress: Progress | None = None) -> Arm:
    """The arm of a description file, prepared in seconds; the fine one where it is in the cache."""
    file, options = description_of(scenario)
    return Arm.load(file, draft=True, progress=progress, **options)


def fit_arguments(choice: BodyConfig) -> dict[str, Any]:
    """The arguments of `Body.fit` for a body of a scenario file."""
    return {
        name: value
        for name, value in dataclasses.asdict(choice).items()
        if name not in ("ellipsoids", "draft")
    }


def settings_of(written: Scenario, *, synchronous: bool = False) -> ControllerSettings:
    """The settings of the controller that moves the arm in physics, of a scenario of `as_file`."""
    torque = dataclasses.replace(written.simulation, mode="torque")
    return controller_settings_of(dataclasses.replace(written, simulation=torque), synchronous=synchronous)


def build_adapter(
    method: Method,
    robot: Robot,
    body: Body,
    numbers: Mapping[str, Any],
    scenario: Scenario,
    *,
    arm: Arm | None = None,
    synchronous: bool = False,
) -> Adapter:
    """What moves the arm by a method, with a body of its recipe, and the arm that is prepared with it, if it is.

    Raises:
        ValueError: names the number at fault.
    """
    written, tip = as_file(method, numbers, scenario), tip_of(robot)
    if method.controlled:
        settings = settings_of(written, synchronous=synchronous)
        return ControllerAdapter(robot, arm or Arm.from_robot(robot, body), settings, tip)
    return methods_of_custom().adapter_of(written, robot, body, tip)


def numbers_of(scenario: Scenario) -> tuple[str, Numbers]:
    """The method that a scenario file asks for, and the numbers it has for it.

    See `OtherMethods` for the method custom.
    """
    if scenario.method != "custom":
        method = METHODS[scenario.method]
        return method.name, {parameter.name: parameter.of(scenario) for parameter in method.parameters}
    return methods_of_custom().numbers_of_custom(scenario)
