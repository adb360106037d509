"""What can be set of the methods while they run.

Each parameter has a place in a scenario file, a unit, a range, and a sentence on what it trades. Defaults are those of
the classes of the file.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, TypeAlias

from sidestep import presets
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

FOLDERS = {  # on the page, by places in a scenario file
    "barriers": "Pull and barriers",
    "system": "Pull to the goal",
    "system.switch": "Switch",
    "embedding": "Curved space",
    "embedding.joint_limits": "Curved space",
    "escape": "Sub-goals",
    "evasion": "Flights",
    "guide.planner": "Search of paths",
    "guide.route": "Following a path",
    "torque": "Torque program",
    "torque.safety": "Clearances kept by the torque program",
    "body": "Body",
}


@dataclass(frozen=True)
class Parameter:
    """A number of a method, or a choice.

    Attributes:
        name: in `Numbers`. place: of the class in a scenario file that has it, and field: its name there.
        unit: "" without one. lower, upper: the range of a number. default: as recommended, or stated in the thesis.
        sentence: what it trades.
        options: of a choice, which has no range. whole: whole numbers alone. powers: it ranges over powers of ten.
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
    powers: bool = False
    body: bool = False

    @property
    def folder(self) -> str:
        """Where it is on the page."""
        return FOLDERS["body" if self.body else self.place]

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


def _number(kind: type, place: str, prefix: str = "", **options: Any) -> Any:
    def make(field: str, unit: str, lower: float, upper: float, sentence: str, **more: Any) -> Parameter:
        default = _default(kind, field)
        whole = isinstance(default, int)
        return Parameter(
            field if field.startswith(prefix) else f"{prefix}{field}",
            place,
            field,
            unit,
            lower,
            upper,
            default,
            sentence,
            whole=whole,
            **options,
            **more,
        )

    return make


def _choice(
    kind: type, place: str, field: str, options: tuple[Value, ...], sentence: str, **more: Any
) -> Parameter:
    default = more.pop("default", _default(kind, field))
    return Parameter(field, place, field, "", 0.0, 0.0, default, sentence, options=options, **more)


_b = _number(BarrierChoice, "barriers")
BARRIERS: tuple[Parameter, ...] = (
    _b("stiffness", "1/s²", 0.1, 10.0, "Higher arrives sooner, with more speed near obstacles."),
    _b("damping", "1/s", 0.5, 10.0, "Higher is calmer and slower; lower overshoots the goal."),
    _b("activation", "m", 0.02, 0.3, "Higher reacts earlier and gentler, and closes narrow passages."),
    _b("strength", "", 0.01, 1.0, "Higher turns away earlier within the activation distance."),
    _b("power", "", 2.0, 4.0, "Higher stays flat for longer and rises steeper close by."),
    _b("limit_activation", "rad", 0.02, 0.5, "Higher keeps joints farther from their limits."),
    _b("limit_strength", "", 0.001, 0.2, "Higher turns away from joint limits earlier."),
    _b("self_activation", "m", 0.01, 0.2, "Higher keeps links farther apart, and bars more poses."),
    _b("self_strength", "", 0.001, 0.2, "Higher turns links away from each other earlier."),
    _b("floor", "m", 0.0005, 0.008, "Higher counts as touched earlier; lower lets the arm come closer."),
    _b("temperature", "m", 0.0005, 0.02, "Higher is smoother between neighbours, and keeps farther off."),
    _choice(
        BarrierChoice,
        "barriers",
        "ellipsoids",
        (None, 1, 2, 3, 4, 6, 8, 12),
        "Of the body per link: more fit it closer, and cost time in every step.",
        body=True,
    ),
)

_e = _number(EscapeChoice, "escape", "escape_")
ESCAPE: tuple[Parameter, ...] = (
    _e("patience", "s", 0.1, 5.0, "Higher waits longer before it counts as stuck."),
    _e(
        "fraction", "", 0.005, 0.5, "Progress in that time, as a share; higher counts slow progress as stuck."
    ),
    _e("leg", "s", 0.2, 10.0, "Higher goes farther away from a dead end before it turns to the goal again."),
    _e(
        "spread",
        "rad",
        0.1,
        6.3,
        "Higher takes sub-goals farther off: out of deeper dead ends, on longer ways.",
    ),
)

_v = _number(EvasionChoice, "evasion", "evasion_")
EVASION: tuple[Parameter, ...] = (
    _v("horizon", "s", 0.5, 5.0, "Higher looks farther ahead, and takes longer."),
    _v("period", "s", 0.005, 0.05, "Of the steps looked at: higher is quicker, and coarser."),
    _v("delay", "s", 0.05, 0.5, "From look to look: a look should take no longer; lower steps aside sooner."),
    _v("clearance", "m", 0.0, 0.05, "Higher steps aside from what would pass farther off."),
    _v("tries", "", 1, 1000, "More find ways that are harder to find, and take longer.", powers=True),
)

_p = _number(PlannerChoice, "guide.planner", "planner_")
_r = _number(RouteChoice, "guide.route", "route_")
GUIDE: tuple[Parameter, ...] = (
    _p("margin", "m", 0.01, 0.2, "Of a wide path: higher keeps farther off, and takes longer to find."),
    _p("floor", "m", 0.0, 0.01, "Of the first path: lower finds ways through narrower places."),
    _p("allowance", "m", 0.0, 0.1, "Higher allows ends that the ellipsoids, larger than links, bar."),
    _p("pair_allowance", "m", 0.0, 0.1, "The same between links."),
    _p("slack", "m", 0.0005, 0.02, "Higher proves edges sooner, and keeps less of the margin."),
    _p("fade", "rad", 0.05, 2.0, "Higher lets paths leave a tight end over a longer way."),
    _p("range", "rad", 0.1, 5.0, "Higher crosses open space in fewer steps, of which more fail."),
    _p("max_nodes", "", 100, 100_000, "Of a tree: more find harder ways, and take memory.", powers=True),
    _p("max_iterations", "", 100, 1_000_000, "More find harder ways, and give up later.", powers=True),
    _p("shortcuts", "", 0, 1000, "More make paths shorter, and take longer."),
    _r(
        "speed", "rad/s", 0.1, 5.0, "Higher is sooner there, with more speed near obstacles and longer stops."
    ),
    _r("speed_share", "", 0.05, 1.0, "Of the joints' limits: higher leaves less speed for giving way."),
    _r("acceleration", "rad/s²", 0.5, 20.0, "Higher slows down later before tight places and the end."),
    _r("wide", "m", 0.005, 0.2, "Clearance of full speed: higher is slower in passages."),
    _r("slowest", "", 0.05, 1.0, "Of the speed that is left without clearance: lower creeps."),
    _r("lead", "rad", 0.05, 2.0, "Higher pulls harder along the path, and cuts its corners."),
    _r("delay", "s", 0.02, 1.0, "By which the arm leaves corners: higher passes tight ones more slowly."),
)

_t = _number(TorqueChoice, "torque", "torque_")
TORQUE: tuple[Parameter, ...] = (
    _t("torque_weight", "", 1e-9, 1e-2, "Higher spends less torque, and tracks less well.", powers=True),
    _t("slack_weight", "", 1.0, 1e6, "Price of leaving velocity and acceleration limits.", powers=True),
    _t("safety_weight", "", 1.0, 1e6, "Price of leaving clearances and position limits.", powers=True),
    _t(
        "position_margin",
        "rad",
        0.0,
        0.2,
        "Higher keeps farther from the ends of joints, of which it loses use.",
    ),
    _t("stop_time", "s", 0.01, 1.0, "Of the damped stop: lower stops sooner and harder."),
    _t("stop_damping", "", 0.05, 1.0, "Of a stop without a mass matrix: higher stops sooner and harder."),
)
_s = _number(SafetyChoice, "torque.safety", "safety_")
SAFETY: tuple[Parameter, ...] = (
    _s("margin", "m", 0.0, 0.05, "Clearance that is kept: higher is safer, and bars narrower places."),
    _s("rate", "1/s", 1.0, 100.0, "Higher allows more speed towards what is near."),
    _s("braking_fraction", "", 0.05, 1.0, "Higher brakes later, and leaves less for what was not foreseen."),
    _s("correction", "", 0.05, 1.0, "Higher corrects too much speed at once, with more torque."),
    _s("max_rows", "", 1, 128, "More are kept at once, and cost time in every step."),
)

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
