"""Prepared arms kept in the user's cache, found by what they were prepared from."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from sidestep import _core
from sidestep.arm import clearance_tables, link_pairs
from sidestep.body.cache import cache_path
from sidestep.body.cover_problem import EFFORTS
from sidestep.body.cover_settings import CoverSettings
from sidestep.robot import Robot
from sidestep.storage import user_cache

FORMAT_VERSION = 1  # to be raised with the version of the file format (cpp/src/arm/arm_file.cpp)


def arm_path(
    robot: Robot,
    allowed: Sequence[tuple[str, str]],
    source: str,
    draft: bool = False,
    components: Mapping[str, int] | None = None,
) -> Path:
    """The file of one arm; its name is a hash of what it is made from and of the algorithms that make it."""
    digest = hashlib.sha256()

    def add(*items: object) -> None:
        for item in items:
            digest.update((item.tobytes() if isinstance(item, np.ndarray) else repr(item).encode()) + b"\n")

    if components:
        add(sorted(components.items()))
    add(FORMAT_VERSION, source, robot.name, sorted(sorted(pair) for pair in allowed))
    add(cache_path(robot, CoverSettings(effort="draft" if draft else "fine")).name)
    pairs, tables = link_pairs, clearance_tables
    add(EFFORTS["draft" if draft else "fine"])
    add(tables.ALGORITHM_VERSION, tables.BEYOND, tables.NEAR, tables.STEP, tables.FULL)
    add(pairs.ALGORITHM_VERSION, pairs.MOST_LOST, pairs.HALVINGS, pairs.CHECKS)
    add(pairs.FEW, pairs.TOUCHING, pairs.NEAR, pairs.SHARE, pairs.DRAFT if draft else pairs.FULL)
    limits = robot.limits
    add(limits.lower, limits.upper, limits.velocity, limits.acceleration, limits.effort)
    add(limits.jerk, limits.effort_rate)
    for joint in robot.joints:  # the fingerprint leaves the base pose out, and rounds
        add(joint.placement, joint.axis, joint.multiplier, joint.offset)
    for frame in robot.frames:
        add(frame.placement)
    try:
        inertials = robot.inertials
    except ValueError:  # one that no body has: the arm is then made without dynamics, with a warning
        inertials = ()
    for inertial in inertials:
        add(inertial.mass, inertial.com, inertial.inertia)
    return user_cache.cache_root() / "arms" / f"{digest.hexdigest()}.arm"


def stored_or_made(path: Path, make: Callable[[], _core.Arm]) -> _core.Arm:
    """The arm of a file or, without one, what `make` gives, which is stored there."""
    warning = "arm is prepared again", "the prepared arm is not cached"
    return user_cache.stored_or_made(path, _core.Arm.read, make, lambda file, arm: arm.save(file), warning)
