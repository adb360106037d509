"""The methods that the studio switches between, and their parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sidestep.studio.other_methods import other_methods
from sidestep.studio.parameters import (
    ARRIVAL,
    BARRIERS,
    CONTACT,
    INPUTS,
    LOCAL_MINIMUM,
    LOOK_AHEAD,
    PLANNER,
    SAFETY,
    SOURCES,
    TORQUE,
    TRACKING,
    Method,
    Numbers,
)

_OTHERS = other_methods()
METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        Method(
            "controller",
            "controller (recommended)",
            "All parts: a planner beside the loop, barriers for each part of the body, each joint limit "
            "and each pair of links, a look ahead at what moves, and a program that keeps clearances and limits.",
            (
                *BARRIERS,
                *PLANNER,
                *LOOK_AHEAD,
                *LOCAL_MINIMUM,
                *ARRIVAL,
                *TRACKING,
                *CONTACT,
                *INPUTS,
                *SOURCES,
                *SAFETY,
                *TORQUE,
            ),
            controlled=True,
        ),
        Method(
            "barrier",
            "controller without planner",
            "The same without paths: where it is stuck it follows random sub-goals for a while.",
            (
                *BARRIERS,
                *LOOK_AHEAD,
                *LOCAL_MINIMUM,
                *ARRIVAL,
                *TRACKING,
                *CONTACT,
                *INPUTS,
                *SOURCES,
                *SAFETY,
                *TORQUE,
            ),
            controlled=True,
        ),
        Method(
            "reactive",
            "controller, reactive alone",
            "The same without sub-goals and look ahead: where it is stuck it stays, and it yields straight away from "
            "what comes.",
            (*BARRIERS, *ARRIVAL, *TRACKING, *CONTACT, *INPUTS, *SOURCES, *SAFETY, *TORQUE),
            controlled=True,
        ),
        *(_OTHERS.METHODS if _OTHERS is not None else ()),
    )
}


def method_named(name: str) -> Method:
    """The method called `name`; raises ValueError that lists the known ones."""
    if name not in METHODS:
        raise ValueError(f"no method is called {name!r}; known: {', '.join(METHODS)}")
    return METHODS[name]


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
