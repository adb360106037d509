"""The arms that come with Sidestep, one `.arm` file per robot; read without the robot's package."""

from __future__ import annotations

import functools
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sidestep import _core

if TYPE_CHECKING:
    from sidestep.robot import Robot

FOLDER = Path(__file__).parent  # made by benchmarks/ship_arms.py
SUFFIX = ".arm"


def shipped_file(name: str) -> Path | None:
    """The file of a named robot's arm, or None if none comes with Sidestep."""
    return _files(FOLDER).get(name)


def with_body_of(robot: Robot) -> _core.Arm | None:
    """The shipped arm with kinematics and meshes of this robot, whatever either is called and where its limits are."""
    return _by_fingerprint(FOLDER).get(robot.fingerprint)


def with_clearances_of(robot: Robot) -> _core.Arm | None:
    """The shipped arm with kinematics, meshes and position limits of this robot: so its tables and pairs too."""
    arm = with_body_of(robot)
    if arm is None:
        return None
    own, other = robot.limits, arm.limits
    return arm if _equal(own.lower, other.lower) and _equal(own.upper, other.upper) else None


def has_body(arm: _core.Arm, body: _core.Body) -> bool:
    """Whether the ellipsoids of an arm are these, bit for bit."""
    own = arm.body
    return own.links == body.links and all(
        _equal(getattr(own, name), getattr(body, name))
        for name in ("weights", "means", "covariances", "levels")
    )


def _equal(one: object, other: object) -> bool:
    return bool(np.array_equal(np.asarray(one), np.asarray(other)))


@functools.cache
def _files(folder: Path) -> dict[str, Path]:
    return {path.stem: path for path in sorted(folder.glob(f"*{SUFFIX}"))}


@functools.cache
def _by_fingerprint(folder: Path) -> dict[str, _core.Arm]:
    arms = {}
    for path in _files(folder).values():
        try:
            arm = _core.Arm.read(path)
        except (ValueError, OSError) as error:
            warnings.warn(
                f"an arm that comes with Sidestep is left out: {error}", RuntimeWarning, stacklevel=5
            )
            continue
        arms[arm.provenance.fingerprint] = arm
    return arms
