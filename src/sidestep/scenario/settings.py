"""What a scenario file says of the parts beside the system: sub-goals, flights, guide, torque program.

Their defaults are those of the core (`Escape`, `Evasion`, `PlannerSettings`, `RouteSettings`, `TorqueController`,
`SafetySettings`), which say what each is.
"""

from __future__ import annotations

from dataclasses import dataclass, field

MAX_LOOK_STEPS = 10_000  # of one flight, of which a look draws hundreds


def check_steps(place: str, period: float, span: str, length: float, most: int) -> None:
    """Raises ValueError where `length` [s], which the file calls `span`, takes more than `most` periods [s]."""
    if not length <= most * period:
        raise ValueError(
            f"{place}.period is {period} with a {span} of {length} s, which takes {length / period:.3g} steps; "
            f"at most {most} are allowed: a period from {length / most:.3g} s"
        )


@dataclass(frozen=True)
class EscapeChoice:
    """Numbers of the sub-goals where the arm is stuck, see `LocalMinimumSettings`."""

    patience: float = 0.6
    fraction: float = 0.05
    leg: float = 2.0
    spread: float = 1.7


@dataclass(frozen=True)
class EvasionChoice:
    """Numbers of the look ahead where something moves, see `LookAheadSettings`."""

    horizon: float = 2.0
    period: float = 0.01
    delay: float = 0.1
    clearance: float = 0.004
    tries: int = 500


@dataclass(frozen=True)
class PlannerChoice:
    """How the guide searches a path, see `PlannerSettings`; its budget is in numbers that are the same everywhere."""

    margin: float = 0.06
    floor: float = 0.005
    allowance: float = 0.02
    pair_allowance: float = 0.02
    slack: float = 0.002
    fade: float = 0.3
    range: float = 1.0
    max_nodes: int = 10000
    max_iterations: int = 40000
    shortcuts: int = 100


@dataclass(frozen=True)
class RouteChoice:
    """How the guide's attractor passes a path, see `RouteSettings`."""

    speed: float = 2.0
    speed_share: float = 0.7
    acceleration: float = 4.0
    wide: float = 0.03
    slowest: float = 0.35
    lead: float = 0.4
    delay: float = 0.18


@dataclass(frozen=True)
class GuideChoice:
    """The planner of the method "controller"."""

    planner: PlannerChoice = field(default_factory=PlannerChoice)
    route: RouteChoice = field(default_factory=RouteChoice)


@dataclass(frozen=True)
class SafetyChoice:
    """What the torque program keeps of clearances, see `SafetySettings`."""

    margin: float = 0.005
    rate: float = 20.0
    braking_fraction: float = 0.5
    correction: float = 0.5
    max_rows: int = 32


@dataclass(frozen=True)
class TorqueChoice:
    """Weights and limits of the torque program, see `TorqueController`."""

    torque_weight: float = 1e-6
    slack_weight: float = 1e3
    safety_weight: float = 1e3
    position_margin: float = 0.0
    stop_time: float = 0.1
    stop_damping: float = 0.25
    safety: SafetyChoice = field(default_factory=SafetyChoice)
