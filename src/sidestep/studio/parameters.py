"""What can be set of the methods while they run.

Each parameter has a place in a scenario file, a unit, a range, and a sentence on what it trades: of the controller's
those that the controller itself states, of the thesis's methods those here.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, TypeAlias

from sidestep import presets
from sidestep._core import controller_settings_fields
from sidestep.scenario.scenario import (
    BarrierChoice,
    BodyChoice,
    EmbeddingChoice,
    JointLimitChoice,
    Scenario,
    SystemChoice,
)
from sidestep.scenario.settings import (
    EscapeChoice,
    EvasionChoice,
    PlannerChoice,
    RouteChoice,
    SafetyChoice,
    TorqueChoice,
)

Value: TypeAlias = float | int | str | None
Numbers: TypeAlias = dict[str, Any]  # values by the names of parameters; as a file has them

AROUND = 10.0  # times the default, and that part of it, are the ends of a slider, within the range
FOLDERS = {  # on the page, by places in a scenario file
    "barriers": "Pull and barriers",
    "system": "Pull to the goal",
    "system.switch": "Switch",
    "embedding": "Curved space",
    "embedding.joint_limits": "Curved space",
    "escape": "Sub-goals",
    "evasion": "Look ahead",
    "guide.planner": "Search of paths",
    "guide.route": "Following a path",
    "torque": "Limits and weights",
    "torque.safety": "Clearances of every command",
    "body": "Body",
}


@dataclass(frozen=True)
class Parameter:
    """A number of a method, or a choice.

    Attributes:
        name: in `Numbers`. place: of the class in a scenario file that has it, and field: its name there.
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
            return value in self.options and not isinstance(value, bool)
        if not isinstance(value, int | float) or isinstance(value, bool):
            return False
        return self.lower <= value <= self.upper and (not self.whole or value == int(value))

    def kept(self, value: Any) -> Value:
        """The value as a file has it."""
        return value if self.options else int(value) if self.whole else float(value)

    def of(self, scenario: Scenario) -> Value:
        """What a scenario says; the default where it does not have the part."""
        part: Any = scenario
        for name in self.place.split("."):
            part = getattr(part, name)
            if part is None:
                return self.default
        value: Value = getattr(part, self.field)
        return value


def set_in(thing: Any, place: str, values: dict[str, Value]) -> Any:
    """A dataclass with other values of the fields of the part at a place in it, names with dots between them."""
    name, _, rest = place.partition(".")
    part = getattr(thing, name)
    inner = set_in(part, rest, values) if rest else dataclasses.replace(part, **values)
    return dataclasses.replace(thing, **{name: inner})


def _default(kind: type, field: str) -> Any:
    return next(entry.default for entry in dataclasses.fields(kind) if entry.name == field)


def _number(kind: type, place: str, prefix: str = "") -> Any:
    def make(field: str, unit: str, lower: float, upper: float, sentence: str) -> Parameter:
        default = _default(kind, field)
        name = field if field.startswith(prefix) else f"{prefix}{field}"
        whole = isinstance(default, int)
        return Parameter(name, place, field, unit, lower, upper, default, sentence, whole=whole)

    return make


def _choice(
    kind: type, place: str, field: str, options: tuple[Value, ...], sentence: str, **more: Any
) -> Parameter:
    default = more.pop("default", _default(kind, field))
    return Parameter(field, place, field, "", 0.0, 0.0, default, sentence, options=options, **more)


_STATED: dict[str, dict[str, Any]] = {str(entry["name"]): entry for entry in controller_settings_fields()}


def _stated(group: str, kind: type, place: str, prefix: str) -> tuple[Parameter, ...]:
    """The numbers of a class of a file as the controller states them; group: where it has them, names with dots."""
    make, found = _number(kind, place, prefix), []
    for entry in dataclasses.fields(kind):
        stated = _STATED.get(f"{group}{entry.name}")
        if stated is not None:
            unit = "" if stated["unit"] == "-" else stated["unit"].replace("^2", "²")
            trades = f"{stated['trades'][0].upper()}{stated['trades'][1:]}."
            found.append(make(entry.name, unit, stated["least"], stated["most"], trades))
    return tuple(found)


BARRIERS: tuple[Parameter, ...] = (
    *_stated("barriers.", BarrierChoice, "barriers", ""),
    _choice(
        BarrierChoice,
        "barriers",
        "ellipsoids",
        (None, 1, 2, 3, 4, 6, 8, 12),
        "Of the body per link: more fit it closer, and cost time in every step.",
        body=True,
    ),
)
PLANNER = (
    *_stated("planner.search.", PlannerChoice, "guide.planner", "planner_"),
    *_stated("planner.route.", RouteChoice, "guide.route", "route_"),
)
LOOK_AHEAD = _stated("look_ahead.", EvasionChoice, "evasion", "evasion_")
LOCAL_MINIMUM = _stated("local_minimum.", EscapeChoice, "escape", "escape_")
SAFETY = _stated("safety.", SafetyChoice, "torque.safety", "safety_")
TORQUE = _stated("", TorqueChoice, "torque", "torque_")

_y = _number(SystemChoice, "system")


def spring(stiffness: str, damping: str) -> tuple[Parameter, ...]:
    """Stiffness, damping and its form, by sentences of what the first two trade, with the thesis's numbers."""
    return (
        dataclasses.replace(_y("stiffness", "1/s²", 0.1, 10.0, stiffness), default=presets.Thesis.stiffness),
        dataclasses.replace(_y("damping", "1/s", 0.5, 10.0, damping), default=presets.Thesis.damping),
        _choice(
            SystemChoice,
            "system",
            "damping_form",
            ("plain", "metric"),
            "plain: D v, the same everywhere; metric: G⁻¹ D v, weaker where space is steep.",
        ),
    )


def switch(name: str, unit: str, lower: float, upper: float, default: float, sentence: str) -> Parameter:
    """A number of the switch of one of the thesis's methods."""
    return Parameter(name, "system.switch", name, unit, lower, upper, default, sentence)


_l = _number(JointLimitChoice, "embedding.joint_limits", "limit_")
DENSITY: tuple[Parameter, ...] = (
    _choice(
        EmbeddingChoice,
        "embedding",
        "density",
        ("sum", "average"),
        "sum: every point adds to ψ, so finer views push harder; average: they do not, and few of many vanish.",
    ),
    _choice(
        EmbeddingChoice,
        "embedding",
        "combine",
        ("sum", "stack"),
        "sum: obstacles and limits make one ψ, in which they can cancel; stack: one coordinate each.",
    ),
    _l("slope", "1/rad", 5.0, 100.0, "Higher rises later and steeper before a joint limit."),
    _l("height", "", 0.05, 10.0, "Higher turns away from joint limits more."),
    _choice(
        BodyChoice,
        "body",
        "components",
        (1, 2, 3, 4, 5, 6, 8, "aic", "bic"),
        "Gaussians per link: more fit it closer, and cost time in every step; aic and bic choose.",
        default=presets.Thesis.components,
        body=True,
    ),
    _choice(
        BodyChoice,
        "body",
        "covariance",
        ("spherical", "diagonal", "full"),
        "Shape of the Gaussians: simpler ones need more of them.",
        body=True,
    ),
)
