"""What can be set of the methods while they run.

Each parameter has a place in a scenario file, a unit, a range, and a sentence on what it trades: of the controller's
those that the controller itself states, of the thesis's methods those here.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from sidestep.scenario.config import FIELDS, PROGRAM, value_in, with_values
from sidestep.scenario.scenario import BodyConfig, Scenario

Value: TypeAlias = float | int | str | None
Numbers: TypeAlias = dict[str, Any]  # values by the names of parameters; as a file has them

AROUND = 10.0  # times the default, and that part of it, are the ends of a slider, within the range
SWITCH = "system.switch"  # of several forms, with numbers of their own
FOLDERS = {  # on the page, by places in a scenario file
    "controller.barriers": "Attraction and barriers",
    "system": "Attraction to the goal",
    SWITCH: "Switch",
    "embedding": "Curved space",
    "embedding.joint_limits": "Curved space",
    "controller.local_minimum": "Sub-goals",
    "controller.look_ahead": "Look ahead",
    "controller.planner": "Search of paths",
    "controller.planner.search": "Search of paths",
    "controller.planner.route": "Following a path",
    "controller.arrival": "Arrival",
    "controller.tracking": "Tracking",
    "controller.contact": "Touches",
    "controller.inputs": "Inputs",
    "controller.sources": "Sources",
    "controller": "Limits and weights",
    "controller.safety": "Clearances of every command",
    "body": "Body",
}


@dataclass(frozen=True)
class Parameter:
    """A number of a method, or a choice.

    Attributes:
        name: in `Numbers`. place: of the part of a scenario file that has it, and field: its name there.
        unit: "" without one. lower, upper: the range of a number. default: as recommended, or stated in the thesis.
        sentence: what it trades.
        options: of a choice, which has no range. whole: whole numbers alone.
        body: another value needs another body, which takes time to make.
    """

    name: str
    place: str
    field: str
    unit: str
    lower: float
    upper: float
    default: Value
    sentence: str
    options: tuple[Value, ...] = ()
    whole: bool = False
    body: bool = False

    @property
    def folder(self) -> str:
        """Where it is on the page."""
        return FOLDERS["body" if self.body else self.place]

    @property
    def slider(self) -> tuple[float, float]:
        """Its ends, within the range: a file may have what is beyond them."""
        assert isinstance(self.default, int | float)
        lower, upper = self.lower, self.upper
        if self.default != 0:
            lower, upper = max(lower, self.default / AROUND), min(upper, self.default * AROUND)
        return (round(lower), round(upper)) if self.whole else (lower, upper)

    @property
    def allowed(self) -> str:
        """In words."""
        return str(list(self.options)) if self.options else f"[{self.lower:g}, {self.upper:g}]"

    def allows(self, value: Any) -> bool:
        """Whether a value is in range, or among the options."""
        if self.options:
            return any(value == option and type(value) is type(option) for option in self.options)
        if not isinstance(value, int | float) or isinstance(value, bool):
            return False
        return self.lower <= value <= self.upper and (not self.whole or value == int(value))

    def kept(self, value: Any) -> Value:
        """The value as a file has it."""
        return value if self.options else int(value) if self.whole else float(value)

    @property
    def setting(self) -> str:
        """The name of a number of the controller in its tree."""
        return f"{self.place}.{self.field}".removeprefix("controller.")

    def of(self, scenario: Scenario) -> Value:
        """What a scenario says; the default where it does not have the part."""
        if self.place.partition(".")[0] == "controller":
            stated: Value = value_in(scenario.controller, self.setting)
            return stated
        part: Any = scenario
        for name in self.place.split("."):
            part = getattr(part, name)
            if part is None:
                return self.default
        value: Value = getattr(part, self.field)
        return value


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

    def in_range(self, numbers: Mapping[str, Any]) -> bool:
        """Whether all numbers are within the ranges of the page's sliders and choices."""
        return all(p.allows(numbers[p.name]) for p in self.parameters if p.name in numbers)

    def write(self, numbers: Mapping[str, Any], scenario: Scenario) -> Scenario:
        """The scenario with these numbers, but for those of a switch."""
        places: dict[str, dict[str, Value]] = {}
        for parameter in self.parameters:
            if parameter.place != SWITCH:
                places.setdefault(parameter.place, {})[parameter.field] = numbers[parameter.name]
        for place, values in places.items():
            scenario = set_in(scenario, place, values)
        return scenario


def set_in(thing: Any, place: str, values: dict[str, Value]) -> Any:
    """A scenario with other values of the fields of the part at a place in it, names with dots between them."""
    name, _, rest = place.partition(".")
    if name == "controller":
        within = f"{rest}." if rest else ""
        section = with_values(thing.controller, {f"{within}{key}": value for key, value in values.items()})
        return dataclasses.replace(thing, controller=section)
    part = getattr(thing, name)
    inner = set_in(part, rest, values) if rest else dataclasses.replace(part, **values)
    return dataclasses.replace(thing, **{name: inner})


def default_of(kind: type, field: str) -> Any:
    """The default of a field of a dataclass."""
    return next(entry.default for entry in dataclasses.fields(kind) if entry.name == field)


def choice(
    kind: type, place: str, field: str, options: tuple[Value, ...], sentence: str, **more: Any
) -> Parameter:
    """A choice of a part of a scenario file, whose default is that of its class."""
    default = more.pop("default", default_of(kind, field))
    return Parameter(field, place, field, "", 0.0, 0.0, default, sentence, options=options, **more)


CONSTANT = ("period", "synchronous", "seed", "obstacle_timeout", "planner.search.max_seconds")  # no sliders


def _stated(names: Iterable[str], prefix: str = "") -> tuple[Parameter, ...]:
    """Settings of the controller, as it states them itself."""
    found = []
    for setting in names:
        if setting in CONSTANT:
            continue
        stated, (place, _, field) = FIELDS[setting], f"controller.{setting}".rpartition(".")
        default, lower, upper = stated["default"], stated["least"], stated["most"]
        name = field if field.startswith(prefix) else f"{prefix}{field}"
        unit = "" if stated["unit"] == "-" else stated["unit"].replace("^2", "²")
        sentence = f"{stated['trades'][0].upper()}{stated['trades'][1:]}."
        whole, options = type(default) is int, (True, False) if isinstance(default, bool) else ()
        found.append(
            Parameter(name, place, field, unit, lower, upper, default, sentence, options=options, whole=whole)
        )
    return tuple(found)


def _part(name: str, prefix: str) -> tuple[Parameter, ...]:
    return _stated((field for field in FIELDS if field.rpartition(".")[0] == name), prefix)


BARRIERS: tuple[Parameter, ...] = (
    *_part("barriers", ""),
    *_stated(name for name in FIELDS if "." not in name and name not in PROGRAM),
    choice(
        BodyConfig,
        "body",
        "ellipsoids",
        (None, 1, 2, 3, 4, 6, 8, 12),
        "Of the body per link: more fit it closer, and cost time in every step.",
        body=True,
    ),
)
PLANNER = (
    *_part("planner", "planner_"),
    *_part("planner.search", "planner_"),
    *_part("planner.route", "route_"),
)
LOOK_AHEAD = _part("look_ahead", "look_ahead_")
LOCAL_MINIMUM = _part("local_minimum", "local_minimum_")
ARRIVAL = _part("arrival", "arrival_")
TRACKING = _part("tracking", "tracking_")
INPUTS = _part("inputs", "inputs_")
SOURCES = _part("sources", "sources_")
CONTACT = _part("contact", "contact_")
SAFETY = _part("safety", "safety_")
TORQUE = _stated(PROGRAM, "torque_")
