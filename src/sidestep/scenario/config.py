"""The section `controller` of a scenario file: the tree of `ControllerSettings`, as the core states it.

A section is a mapping like that in a file, without what is at its default; None leaves an optional part out, and a
mapping, however empty, adds one that is off by default. Names have dots between their parts, as in
`controller_settings_fields`, from where units, ranges, defaults and sentences come.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator, Mapping
from typing import Any, TypeAlias

from sidestep._core import ControllerSettings, SpeedLimitSettings, controller_settings_fields

Section: TypeAlias = dict[str, Any]

MAX_LOOK_STEPS = 10_000  # of one predicted trajectory, of which a look draws hundreds
ELSEWHERE = ("period", "synchronous")  # said by `simulation`, or by what runs the controller
FIELDS: dict[str, dict[str, Any]] = {str(field["name"]): field for field in controller_settings_fields()}
ADDED = {
    "speed_limits": SpeedLimitSettings()
}  # optional parts that are off by default, as they are once added
OPTIONAL = tuple(
    dict.fromkeys(
        part
        for name, field in FIELDS.items()
        if field["optional"] and (part := name.partition(".")[0]) not in ADDED
    )
)
ABLATIONS = {  # methods that are the controller without these parts
    "controller": (),
    "barrier": ("planner",),
    "reactive": OPTIONAL,
}
_OF_CONTROLLER_ALONE = (
    *ELSEWHERE,
    "speed",
    "limit_margin",
    "effort_margin",
    "obstacle_timeout",
    "local_activation",
    "seed",
)
PROGRAM = tuple(name for name in FIELDS if "." not in name and name not in _OF_CONTROLLER_ALONE)


def section_schema() -> dict[str, Any]:
    """The JSON schema of the section."""
    usual = ControllerSettings()
    whole = _object("The settings of the Controller; of method custom, those of its torque program.")
    for name, field in FIELDS.items():
        if name in ELSEWHERE:
            continue
        *parts, own = name.split(".")
        place, thing = whole, usual
        for part in parts:
            thing = _usual_part(thing, part)
            place = place["properties"].setdefault(part, _object(str(type(thing).__doc__).split("\n")[0]))
        place["properties"][own] = _number(field)
    for name in OPTIONAL:
        whole["properties"][name]["type"] = ["object", "null"]
        whole["properties"][name]["description"] += " null leaves it out."
    for name in ADDED:
        whole["properties"][name] |= {"type": ["object", "null"], "default": None}
    return whole


def _usual_part(thing: Any, name: str) -> Any:
    """A part of settings at their defaults, also one that is off."""
    part = getattr(thing, name)
    return ADDED[name] if part is None else part


def _object(description: str) -> dict[str, Any]:
    return {
        "type": "object",
        "additionalProperties": False,
        "default": {},
        "description": description,
        "properties": {},
    }


def _number(field: Mapping[str, Any]) -> dict[str, Any]:
    default, unit = field["default"], field["unit"]
    kind = {bool: "boolean", int: "integer", float: "number"}[type(default)]
    schema: dict[str, Any] = {
        "type": kind,
        "description": f"{field['trades']}{'' if unit == '-' else f' [{unit}]'}",
    }
    if math.isfinite(default):
        schema["default"] = default
    if kind == "boolean":
        return schema
    exact = int if kind == "integer" else float
    schema["minimum"] = exact(field["least"])
    if math.isfinite(field["most"]):
        schema["maximum"] = min(exact(field["most"]), exact(2**64 - 1))
    return schema


def section_of(values: Mapping[str, Any], within: str = "") -> Section:
    """The section with these values, which the schema allows; numbers are of the kind of their defaults."""
    section: Section = {}
    for key, value in values.items():
        if isinstance(value, Mapping):
            value = section_of(value, f"{within}{key}.")
            if not value and within + key not in ADDED:
                continue
        elif value is None and within + key in ADDED:
            continue
        elif value is not None:
            usual = FIELDS[within + key]["default"]
            value = type(usual)(value)
            if value == usual:
                continue
        section[key] = value
    return section


def value_in(section: Mapping[str, Any], name: str) -> Any:
    """The value of a setting; its default where the section does not have it, or leaves its part out."""
    part: Any = section
    for key in name.split("."):
        part = part.get(key) if isinstance(part, Mapping) else None
    return FIELDS[name]["default"] if part is None else part


def with_values(section: Mapping[str, Any], values: Mapping[str, Any]) -> Section:
    """The section with other values by name; parts that are left out stay out."""
    changed: Section = copy.deepcopy(dict(section))
    for name, value in values.items():
        *parts, own = name.split(".")
        place: Section | None = changed
        for part in parts:
            place = None if place is None else place.setdefault(part, {})
        if place is not None:
            place[own] = value
    return section_of(changed)


def left_out(section: Mapping[str, Any], method: str) -> tuple[str, ...]:
    """The parts that the controller of a method does without."""
    return tuple(name for name in OPTIONAL if name in ABLATIONS[method] or section.get(name, {}) is None)


def made(usual: Any, values: Mapping[str, Any]) -> Any:
    """Settings of the class of `usual` with these values, mappings for their parts."""
    given = {
        key: made(_usual_part(usual, key), value)
        if isinstance(value, Mapping) and hasattr(usual, key)
        else value
        for key, value in values.items()
    }
    try:
        return type(usual)(**given)
    except TypeError as error:
        raise ValueError(str(error)) from error


def parts_of(settings: Any, within: str = "") -> Iterator[tuple[str, Any, dict[str, Any], list[str]]]:
    """Parts before what has them: name, settings, their own numbers, and the names of their parts.

    The whole is called ""; what is left out is None.
    """
    names = [name.removeprefix(within) for name in FIELDS if name.startswith(within)]
    parts = list(dict.fromkeys(name.partition(".")[0] for name in names if "." in name))
    for part in parts:
        thing = getattr(settings, part)
        if thing is not None:
            yield from parts_of(thing, f"{within}{part}.")
    own = {name: getattr(settings, name) for name in names if "." not in name}
    yield within.removesuffix("."), settings, own, parts


def check_steps(place: str, period: float, span: str, length: float, most: int) -> None:
    """Raises ValueError where `length` [s], which the file calls `span`, takes more than `most` periods [s]."""
    if not length <= most * period:
        raise ValueError(
            f"{place}.period is {period} with a {span} of {length} s, which takes {length / period:.3g} steps; "
            f"at most {most} are allowed: a period from {length / most:.3g} s"
        )
