"""The methods that the studio switches between, and their parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from sidestep import presets

Numbers = dict[str, float]

WRITTEN = "written"  # the method of a scenario file that says itself how the arm is moved


@dataclass(frozen=True)
class Parameter:
    """A number of a method.

    Attributes:
        name: of the argument. unit: "" without one. lower, upper, default: of the slider.
        sentence: what it trades.
    """

    name: str
    unit: str
    lower: float
    upper: float
    default: float
    sentence: str


@dataclass(frozen=True)
class Method:
    """A way to move the arm.

    Attributes:
        name: on the command line. label: on the page. sentence: what it is.
        parameters: its numbers. covering: needs a covering body, otherwise a fitted one.
        safe: the torque program keeps clearances as well. escapes: takes sub-goals where it is stuck.
        guided: a guide searches a path in the background and leads the goal along it.
    """

    name: str
    label: str
    sentence: str
    parameters: tuple[Parameter, ...]
    covering: bool
    safe: bool
    escapes: bool = False
    guided: bool = False

    @property
    def defaults(self) -> Numbers:
        """The numbers as they are recommended, or stated in the thesis."""
        return {parameter.name: parameter.default for parameter in self.parameters}


def _default(kind: type, name: str) -> float:
    default: Any = next(field.default for field in fields(kind) if field.name == name)
    return float(default)


def _barrier(name: str, unit: str, lower: float, upper: float, sentence: str) -> Parameter:
    return Parameter(name, unit, lower, upper, _default(presets.Barriers, name), sentence)


def _thesis(name: str, unit: str, lower: float, upper: float, sentence: str) -> Parameter:
    return Parameter(name, unit, lower, upper, _default(presets.Thesis, name), sentence)


BARRIER_PARAMETERS = (
    _barrier("stiffness", "1/s²", 0.1, 10.0, "Higher arrives sooner, with more speed near obstacles."),
    _barrier("damping", "1/s", 0.5, 10.0, "Higher is calmer and slower; lower overshoots the goal."),
    _barrier("activation", "m", 0.02, 0.3, "Higher reacts earlier and gentler, and closes narrow passages."),
    _barrier("strength", "", 0.01, 1.0, "Higher turns away earlier within the activation distance."),
    _barrier("power", "", 2.0, 4.0, "Higher stays flat for longer and rises steeper close by."),
    _barrier("limit_activation", "rad", 0.02, 0.5, "Higher keeps joints farther from their limits."),
    _barrier("limit_strength", "", 0.001, 0.2, "Higher turns away from joint limits earlier."),
    _barrier("self_activation", "m", 0.01, 0.2, "Higher keeps links farther apart, and bars more poses."),
    _barrier("self_strength", "", 0.001, 0.2, "Higher turns links away from each other earlier."),
    _barrier(
        "floor", "m", 0.0005, 0.008, "Higher counts as touched earlier; lower lets the arm come closer."
    ),
    _barrier(
        "temperature", "m", 0.0005, 0.02, "Higher is smoother between neighbours, and keeps farther off."
    ),
)
_SPRING = (
    _thesis("stiffness", "1/s²", 0.1, 10.0, "Higher arrives sooner, and climbs higher onto obstacles."),
    _thesis("damping", "1/s", 0.5, 10.0, "Higher is calmer and slower; lower overshoots the goal."),
)
_THRESHOLD = Parameter(
    "threshold", "psi", 0.01, 5.0, 0.5, "Lower lets go of the goal farther from obstacles."
)

METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        Method(
            "barrier",
            "barriers (recommended)",
            "A barrier for each part of the body, each joint limit and each pair of links; clearances are also "
            "kept by the torque program. Where it is stuck it follows random sub-goals for a while.",
            BARRIER_PARAMETERS,
            covering=True,
            safe=True,
            escapes=True,
        ),
        Method(
            "reactive",
            "barriers without sub-goals",
            "The same, but where it is stuck it stays.",
            BARRIER_PARAMETERS,
            covering=True,
            safe=True,
        ),
        Method(
            "guided",
            "barriers, guided",
            "The same, led to configurations along a path that is searched in the background.",
            BARRIER_PARAMETERS,
            covering=True,
            safe=True,
            guided=True,
        ),
        Method(
            "thesis",
            "thesis: distance switch",
            "One summed density; near obstacles a switch takes the pull to the goal away, joint by joint (T6.2).",
            (
                *_SPRING,
                _thesis(
                    "outer", "m", 0.02, 0.5, "Distance at which the first two joints and the last let go."
                ),
                _thesis("inner", "m", 0.02, 0.5, "Distance at which the joints between let go."),
                _thesis("slope", "1/m", 1.0, 100.0, "Higher switches more abruptly."),
            ),
            covering=False,
            safe=False,
        ),
        Method(
            "unswitched",
            "thesis: unswitched",
            "One summed density, pull and bending added without a switch (T2.12).",
            _SPRING,
            covering=False,
            safe=False,
        ),
        Method(
            "sigmoid",
            "thesis: sigmoid switch",
            "One summed density; where psi is high the pull to the goal fades (thesis 6.1.1).",
            (
                *_SPRING,
                _THRESHOLD,
                Parameter("slope", "1/psi", 0.5, 50.0, 10.0, "Higher switches more abruptly."),
            ),
            covering=False,
            safe=False,
        ),
        Method(
            "binary",
            "thesis: binary switch",
            "One summed density; where psi is above the threshold there is no pull to the goal (T5.5).",
            (*_SPRING, _THRESHOLD),
            covering=False,
            safe=False,
        ),
        Method(
            "harmonic_only",
            "spring alone: no avoidance",
            "The damped spring on the curved space without the bending of paths, for comparison: it touches.",
            _SPRING,
            covering=False,
            safe=False,
        ),
        Method(
            "geodesic_only",
            "geodesics alone: no goal",
            "Free fall along a geodesic of the curved space (T5.3), for comparison: it knows no goal.",
            (),
            covering=False,
            safe=False,
        ),
        Method(
            WRITTEN,
            "as the scenario file says",
            "Body, embedding, switch and numbers of the scenario that was loaded, as its file has them; without any "
            "in a file, one density without a switch. Choose another method to tune it here.",
            (),
            covering=False,
            safe=False,
        ),
    )
}


def method_named(name: str) -> Method:
    """The method called `name`; raises ValueError that lists the known ones."""
    if name not in METHODS:
        raise ValueError(f"no method is called {name!r}; known: {', '.join(METHODS)}")
    return METHODS[name]


def in_range(method: Method, numbers: Mapping[str, float]) -> bool:
    """Whether all numbers are within the ranges of the page's sliders."""
    return all(p.lower <= numbers[p.name] <= p.upper for p in method.parameters if p.name in numbers)


def check_numbers(
    method: Method, numbers: Mapping[str, float], kept: Mapping[str, float] | None = None
) -> Numbers:
    """All numbers of a method: the given ones, checked, and defaults for the rest.

    Args:
        kept: numbers that are allowed as they are, in range or not: those of a scenario file.

    Raises:
        ValueError: an unknown name or a value out of its range, with what is allowed.
    """
    complete = method.defaults
    ranges = {parameter.name: parameter for parameter in method.parameters}
    for name, value in numbers.items():
        if name not in ranges:
            raise ValueError(f"{method.name} has no parameter {name!r}; it has {', '.join(ranges) or 'none'}")
        lower, upper = ranges[name].lower, ranges[name].upper
        as_it_is = kept is not None and value == kept.get(name)
        if not (np.isfinite(value) and lower <= value <= upper) and not as_it_is:
            raise ValueError(f"{method.name}: {name} is {value}, allowed: [{lower:g}, {upper:g}]")
        complete[name] = float(value)
    return complete
