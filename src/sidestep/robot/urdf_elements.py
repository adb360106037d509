"""URDF elements as plain values."""

from __future__ import annotations

from dataclasses import dataclass, field

from sidestep.robot.link import Array, Link
from sidestep.robot.remarks import Remarks

FREE_TYPES = ("floating", "planar")  # have more than one coordinate; they are held at a pose


@dataclass(frozen=True)
class UrdfLimit:
    """The limit element of a joint; position [rad | m], velocity [/s], effort [Nm | N]; None where not given."""

    lower: float
    upper: float
    velocity: float | None
    effort: float | None


@dataclass(frozen=True)
class UrdfMimic:
    """The mimic element: position = multiplier * position of `joint` + offset."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True, eq=False)
class UrdfJoint:
    """A joint element; `placement` (4, 4) in the parent link's frame, `axis` (3,) of unit length."""

    name: str
    type: str
    parent: str
    child: str
    placement: Array
    axis: Array
    limit: UrdfLimit | None
    mimic: UrdfMimic | None

    @property
    def moves(self) -> bool:
        """Whether it has one coordinate."""
        return self.type != "fixed" and not self.free

    @property
    def free(self) -> bool:
        """Whether it has more than one coordinate."""
        return self.type in FREE_TYPES


@dataclass(frozen=True, eq=False)
class Urdf:
    """A checked description: every link is reached from `root`, every joint refers to what exists.

    `remarks` has what was left out or looks wrong.
    """

    name: str
    label: str
    links: dict[str, Link]
    joints: dict[str, UrdfJoint]
    root: str
    remarks: Remarks = field(default_factory=Remarks)
