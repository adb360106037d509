"""The thesis's methods in the studio, their numbers, and how a scenario file has them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from sidestep.scenario.scenario import (
    BodyConfig,
    EmbeddingConfig,
    JointLimitConfig,
    Scenario,
    SwitchConfig,
    SystemConfig,
)
from sidestep.studio.parameters import SWITCH, TORQUE, Method, Numbers, Parameter, choice, default_of
from sidestep.thesis.system import ThesisNumbers

CUSTOM = "custom"  # the method of a scenario file that says itself how the arm is moved


def _number(kind: type, place: str, prefix: str = "") -> Any:
    def make(field: str, unit: str, lower: float, upper: float, sentence: str) -> Parameter:
        default = default_of(kind, field)
        name = field if field.startswith(prefix) else f"{prefix}{field}"
        whole = isinstance(default, int)
        return Parameter(name, place, field, unit, lower, upper, default, sentence, whole=whole)

    return make


_y = _number(SystemConfig, "system")


def spring(stiffness: str, damping: str) -> tuple[Parameter, ...]:
    """Stiffness, damping and its form, by sentences of what the first two trade, with the thesis's numbers."""
    return (
        dataclasses.replace(_y("stiffness", "1/s²", 0.1, 10.0, stiffness), default=ThesisNumbers.stiffness),
        dataclasses.replace(_y("damping", "1/s", 0.5, 10.0, damping), default=ThesisNumbers.damping),
        choice(
            SystemConfig,
            "system",
            "damping_form",
            ("plain", "metric"),
            "plain: D v, the same everywhere; metric: G⁻¹ D v, weaker where space is steep.",
        ),
    )


def switch(name: str, unit: str, lower: float, upper: float, default: float, sentence: str) -> Parameter:
    """A number of the switch of one of the thesis's methods."""
    return Parameter(name, SWITCH, name, unit, lower, upper, default, sentence)


_l = _number(JointLimitConfig, "embedding.joint_limits", "limit_")
DENSITY: tuple[Parameter, ...] = (
    choice(
        EmbeddingConfig,
        "embedding",
        "density",
        ("sum", "average"),
        "sum: every point adds to ψ, so finer views push harder; average: they do not, and few of many vanish.",
    ),
    choice(
        EmbeddingConfig,
        "embedding",
        "combine",
        ("sum", "stack"),
        "sum: obstacles and limits make one ψ, in which they can cancel; stack: one coordinate each.",
    ),
    _l("slope", "1/rad", 5.0, 100.0, "Higher rises later and steeper before a joint limit."),
    _l("height", "", 0.05, 10.0, "Higher turns away from joint limits more."),
    choice(
        BodyConfig,
        "body",
        "components",
        (1, 2, 3, 4, 5, 6, 8, "aic", "bic"),
        "Gaussians per link: more fit it closer, and cost time in every step; aic and bic choose.",
        default=ThesisNumbers.components,
        body=True,
    ),
    choice(
        BodyConfig,
        "body",
        "covariance",
        ("spherical", "diagonal", "full"),
        "Shape of the Gaussians: simpler ones need more of them.",
        body=True,
    ),
)


_SPRING = spring(
    "Higher arrives sooner, and climbs higher onto obstacles.",
    "Higher is calmer and slower; lower overshoots the goal.",
)
_THRESHOLD = switch("threshold", "psi", 0.01, 5.0, 0.5, "Lower lets go of the goal farther from obstacles.")
_DENSITY = (*DENSITY, *TORQUE)

METHODS = (
    Method(
        "thesis",
        "thesis: distance switch",
        "One summed density; near obstacles a switch takes the attraction to the goal away, joint by joint (T6.2).",
        (
            *_SPRING,
            switch(
                "outer",
                "m",
                0.02,
                0.5,
                ThesisNumbers.outer,
                "Distance at which the first two joints and the last let go.",
            ),
            switch(
                "inner",
                "m",
                0.02,
                0.5,
                ThesisNumbers.inner,
                "Distance at which the joints between let go.",
            ),
            switch("slope", "1/m", 1.0, 100.0, ThesisNumbers.slope, "Higher switches more abruptly."),
            *_DENSITY,
        ),
    ),
    Method(
        "unswitched",
        "thesis: unswitched",
        "One summed density, attraction and bending added without a switch (T2.12).",
        (*_SPRING, *_DENSITY),
    ),
    Method(
        "sigmoid",
        "thesis: sigmoid switch",
        "One summed density; where psi is high the attraction to the goal fades (thesis 6.1.1).",
        (
            *_SPRING,
            _THRESHOLD,
            switch("slope", "1/psi", 0.5, 50.0, 10.0, "Higher switches more abruptly."),
            *_DENSITY,
        ),
    ),
    Method(
        "binary",
        "thesis: binary switch",
        "One summed density; where psi is above the threshold there is no attraction to the goal (T5.5).",
        (*_SPRING, _THRESHOLD, *_DENSITY),
    ),
    Method(
        "harmonic_only",
        "spring alone: no avoidance",
        "The damped spring on the curved space without the bending of paths, for comparison: it touches.",
        (*_SPRING, *_DENSITY),
    ),
    Method(
        "geodesic_only",
        "geodesics alone: no goal",
        "Free fall along a geodesic of the curved space (T5.3), for comparison: it knows no goal.",
        _DENSITY,
    ),
    Method(
        CUSTOM,
        "as the scenario file says",
        "Body, embedding, switch and numbers of the scenario that was loaded, as its file has them; without any "
        "in a file, one density without a switch. Choose another method to tune it here.",
        (),
    ),
)


def custom_scenario(method: str, numbers: Mapping[str, Any], scenario: Scenario) -> Scenario:
    """The scenario by method custom with the switch of one of these methods, and every other number at its default."""
    if method == CUSTOM:
        return dataclasses.replace(scenario, method="custom")
    return dataclasses.replace(
        scenario,
        method="custom",
        body=dataclasses.replace(BodyConfig(), ellipsoids=scenario.body.ellipsoids),
        embedding=EmbeddingConfig(joint_limits=JointLimitConfig()),
        system=SystemConfig(switch=switch_of(method, numbers, len(scenario.start.position))),
    )


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


def numbers_of_custom(scenario: Scenario) -> tuple[str, Numbers]:
    """The method that a scenario of method custom is written for, and its numbers.

    That is one of these where the file says exactly what one of them with its numbers is; else `CUSTOM`.
    """
    switched = _switch_numbers(scenario.system.switch)
    for method in METHODS:
        numbers = {
            p.name: switched.get(p.name, p.default) if p.place == SWITCH else p.of(scenario)
            for p in method.parameters
        }
        if method.name == CUSTOM or not method.in_range(numbers):
            continue
        if method.write(numbers, custom_scenario(method.name, numbers, scenario)) == scenario:
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
