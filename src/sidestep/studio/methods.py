"""The methods that the studio switches between, and their parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sidestep.studio.parameters import (
    ARRIVAL,
    BARRIERS,
    DENSITY,
    LOCAL_MINIMUM,
    LOOK_AHEAD,
    PLANNER,
    SAFETY,
    TORQUE,
    Numbers,
    Parameter,
    spring,
    switch,
)
from sidestep.thesis import ThesisNumbers

CUSTOM = "custom"  # the method of a scenario file that says itself how the arm is moved


@dataclass(frozen=True)
class Method:
    """A way to move the arm.

    Attributes:
        name: on the command line. label: on the page. sentence: what it is.
        parameters: its numbers.
        controlled: by the `Controller`, which needs a covering body and sees obstacles as they are; otherwise a
            geometric system moves the arm, with a fitted body.
    """

    name: str
    label: str
    sentence: str
    parameters: tuple[Parameter, ...]
    controlled: bool = False

    @property
    def defaults(self) -> Numbers:
        """The numbers as they are recommended, or stated in the thesis."""
        return {parameter.name: parameter.default for parameter in self.parameters}


_SPRING = spring(
    "Higher arrives sooner, and climbs higher onto obstacles.",
    "Higher is calmer and slower; lower overshoots the goal.",
)
_THRESHOLD = switch("threshold", "psi", 0.01, 5.0, 0.5, "Lower lets go of the goal farther from obstacles.")
_DENSITY = (*DENSITY, *TORQUE)


METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        Method(
            "controller",
            "controller (recommended)",
            "Everything: a path that is searched beside the loop, barriers for each part of the body, each joint limit "
            "and each pair of links, a look ahead at what moves, and a program that keeps clearances and limits.",
            (*BARRIERS, *PLANNER, *LOOK_AHEAD, *LOCAL_MINIMUM, *ARRIVAL, *SAFETY, *TORQUE),
            controlled=True,
        ),
        Method(
            "barrier",
            "controller without planner",
            "The same without paths: where it is stuck it follows random sub-goals for a while.",
            (*BARRIERS, *LOOK_AHEAD, *LOCAL_MINIMUM, *ARRIVAL, *SAFETY, *TORQUE),
            controlled=True,
        ),
        Method(
            "reactive",
            "controller, reactive alone",
            "The same without sub-goals and look ahead: where it is stuck it stays, and it yields straight away from "
            "what comes.",
            (*BARRIERS, *ARRIVAL, *SAFETY, *TORQUE),
            controlled=True,
        ),
        Method(
            "thesis",
            "thesis: distance switch",
            "One summed density; near obstacles a switch takes the pull to the goal away, joint by joint (T6.2).",
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
            "One summed density, pull and bending added without a switch (T2.12).",
            (*_SPRING, *_DENSITY),
        ),
        Method(
            "sigmoid",
            "thesis: sigmoid switch",
            "One summed density; where psi is high the pull to the goal fades (thesis 6.1.1).",
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
            "One summed density; where psi is above the threshold there is no pull to the goal (T5.5).",
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
}


def method_named(name: str) -> Method:
    """The method called `name`; raises ValueError that lists the known ones."""
    if name not in METHODS:
        raise ValueError(f"no method is called {name!r}; known: {', '.join(METHODS)}")
    return METHODS[name]


def in_range(method: Method, numbers: Mapping[str, Any]) -> bool:
    """Whether all numbers are within the ranges of the page's sliders and choices."""
    return all(p.allows(numbers[p.name]) for p in method.parameters if p.name in numbers)


def check_numbers(
    method: Method, numbers: Mapping[str, Any], kept: Mapping[str, Any] | None = None
) -> Numbers:
    """All numbers of a method: the given ones, checked, and those kept, or defaults, for the rest.

    Args:
        kept: numbers that are allowed as they are, in range or not: those that the method has, perhaps of a file.

    Raises:
        ValueError: an unknown name or a value out of its range, with what is allowed.
    """
    complete = method.defaults if kept is None else dict(kept)
    known = {parameter.name: parameter for parameter in method.parameters}
    for name, value in numbers.items():
        if name not in known:
            raise ValueError(f"{method.name} has no parameter {name!r}; it has {', '.join(known) or 'none'}")
        if value == complete[name] and kept is not None:
            continue
        if not known[name].allows(value):
            raise ValueError(f"{method.name}: {name} is {value}, allowed: {known[name].allowed}")
        complete[name] = known[name].kept(value)
    return complete
