"""A robot as it was read, with everything that the reader said about it."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sidestep import _core
from sidestep.arm import Arm
from sidestep.robot import Link, Robot, tip_of
from sidestep.robot.any_source import is_name, robot_from
from sidestep.robot.catalogue import RECIPES
from sidestep.robot.mjcf import is_mjcf
from sidestep.robot.tree import KinematicTree

ARM_SUFFIX = ".arm"


@dataclass(frozen=True, eq=False)
class Reading:
    """What was read.

    Attributes:
        source: the path or name. kind: "arm file", "MJCF", "URDF" or "named robot".
        robot: with meshes, unless it is of an arm file. tip: the link whose pose is a goal.
        arm: of an arm file, else None.
        moving_mass: [kg] of what the joints move. mass: [kg] of all links; None where the description has none.
        warnings: of the reader, one sentence each.
        own_acceleration: whether acceleration limits are the robot's own, and not the default.
    """

    source: str
    kind: str
    robot: Robot
    tip: str
    arm: _core.Arm | None
    moving_mass: float | None
    mass: float | None
    warnings: tuple[str, ...]
    own_acceleration: bool


def read(source: str, options: Mapping[str, Any]) -> Reading:
    """Reads an arm file, a URDF, xacro or MJCF file, or a robot by its name.

    Args:
        source: a path or a name, as for `Arm.load`. options: of `Robot.from_urdf`.

    Raises:
        FileNotFoundError, OSError, ValueError: as `Arm.load`.
    """
    with collected_warnings() as told:
        if Path(source).suffix.lower() == ARM_SUFFIX:
            arm: _core.Arm | None = Arm.load(source, **options)
            assert arm is not None
            robot, kind = with_links(arm.robot), "arm file"
            masses = [inertial.mass for inertial in arm.inertials]
            moving, whole = (sum(masses) if masses else None), None
        else:
            arm, robot = None, robot_from(source, options)
            kind = "named robot" if is_name(source) else "MJCF" if is_mjcf(source) else "URDF"
            moving, whole = _masses(robot)
    return Reading(
        source,
        kind,
        robot,
        options.get("tip") or tip_of(robot),
        arm,
        moving,
        whole,
        tuple(told),
        kind == "arm file" or _has_own_acceleration(source),
    )


@contextmanager
def collected_warnings() -> Iterator[list[str]]:
    """The texts of the warnings that are given meanwhile, in place of what Python prints."""
    told: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", RuntimeWarning)
        try:
            yield told
        finally:
            told += dict.fromkeys(str(item.message) for item in caught)


def with_links(core: _core.Robot) -> Robot:
    """The robot of an arm file, with links that have neither mesh nor inertia."""
    links = tuple(Link(frame.name) for frame in core.frames)
    tree = KinematicTree(
        tuple(core.joints), tuple(core.frames), tuple(core.coordinate_names), core.limits, links
    )
    return Robot(core.name, tree)


def _has_own_acceleration(name: str) -> bool:
    return any(recipe.name == name and recipe.acceleration_limits is not None for recipe in RECIPES)


def _masses(robot: Robot) -> tuple[float | None, float | None]:
    """Mass [kg] of the moving links and of all; None where no link has inertia."""
    of_links = [
        (frame.joint >= 0, link.inertial.mass)
        for frame, link in zip(robot.frames, robot.links, strict=True)
        if link.inertial is not None
    ]
    if not of_links:
        return None, None
    return sum(mass for moves, mass in of_links if moves), sum(mass for _, mass in of_links)
