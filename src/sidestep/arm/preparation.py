"""Prepares an arm: covers its links, measures its clearance tables, finds the pairs of links that may touch."""

from __future__ import annotations

import datetime
import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias

import numpy as np

from sidestep import _core
from sidestep.arm.link_pairs import DRAFT, FULL, tables_and_pairs
from sidestep.body import Body
from sidestep.body.cover import CoverProgress
from sidestep.body.cover_settings import CoverSettings
from sidestep.distance import SelfCollision
from sidestep.robot import Robot

Pair: TypeAlias = tuple[str, str]
Progress: TypeAlias = Callable[[str, str, int, int], None]
"""Called as progress(stage, item, done, in_all): "cover" and a link, "tables" or "pairs" and a pair of links."""

# Of the largest eigenvalue of the mass matrix: below it a coordinate moves no mass. A gripper's smallest is 1e-7 of it.
_NO_MASS = 1e-12


def prepare(
    robot: Robot,
    *,
    body: Body | None = None,
    allowed: Sequence[Pair] = (),
    source: str = "",
    draft: bool = False,
    components: Mapping[str, int] | None = None,
    cached: bool = True,
    progress: Progress | None = None,
) -> _core.Arm:
    """Everything that is made once for a robot. Minutes, a draft seconds, unless the user's cache has the parts.

    Args:
        robot: with geometry.
        body: a covering body of it; `Body.cover(robot)` by default.
        allowed: pairs of links that may touch, in either order: they get no clearance.
        source: what the provenance calls the description; the robot's name by default.
        draft: with fewer ellipsoids, which are larger, and tables and pairs by fewer samples; so it is with a body that
            is a draft.
        components: ellipsoids of links that get a finer cover than the others, {link: number}.
        cached: whether parts are taken from shipped arms and the user's cache, and kept there.
        progress: called as progress(stage, item, done, in_all).

    Raises:
        ValueError: names what is wrong: a body that does not cover or belongs to another robot, an unknown link.
    """
    for pair in allowed:
        for link in pair:
            robot.link(link)
    if body is None:
        body = Body.cover(
            robot, effort="draft" if draft else "fine", cache=cached, progress=_of_stage("cover", progress)
        )
    elif body.fingerprint and body.fingerprint != robot.fingerprint:
        raise ValueError(f"the body was made for robot {body.robot_name!r}, not for {robot.name!r} as it is")
    elif body.levels is None:
        raise ValueError(
            "the body does not cover its links (it has no levels); Body.cover(robot) makes one that does"
        )
    if components:
        body = body.finer(robot, components, progress=_of_stage("cover", progress), cache=cached)
    draft = draft or (isinstance(body.settings, CoverSettings) and body.settings.effort == "draft")
    check = SelfCollision(robot)
    tables, pairs = tables_and_pairs(
        robot,
        body,
        effort=DRAFT if draft else FULL,
        check=check,
        cached=cached,
        progress=_of_stage("tables", progress),
        pair_progress=_of_stage("pairs", progress),
    )
    _warn_of_touching(check)
    may_touch = {frozenset(pair) for pair in allowed}
    return _core.Arm(
        robot=robot,
        body=body,
        pairs=[pair for pair in pairs if frozenset(pair[:2]) not in may_touch],
        tables=[table for table in tables if frozenset((table.first, table.second)) not in may_touch],
        inertials=_inertials(robot),
        proof=[
            _core.CoverProof(
                cover.link,
                coverage=cover.coverage,
                mean_overshoot=cover.mean_overshoot,
                max_overshoot=cover.max_overshoot,
                volume_ratio=cover.volume_ratio,
                volume_of=cover.volume_of,
                interior_coverage=cover.interior_coverage,
                slimness=cover.slimness,
            )
            for cover in body.link_covers
        ],
        allowed_pairs=[(first, second) for first, second in allowed],
        provenance=_core.Provenance(
            source=source or robot.name,
            fingerprint=robot.fingerprint,
            sidestep_version=_core.__version__,
            date=_today(),
        ),
    )


def _warn_of_touching(check: SelfCollision) -> None:
    found = [pair for pair, reason in check.left_out.items() if reason == "always"]
    if found:
        words = ", ".join(f"{first!r} and {second!r}" for first, second in found)
        warnings.warn(
            f"robot {check.robot.name!r}: these links overlap wherever they are, and may touch: {words}",
            RuntimeWarning,
            stacklevel=5,
        )


def _of_stage(stage: str, progress: Progress | None) -> CoverProgress | None:
    """Tells of a stage where it has come further: a search that looks at the same numbers again has not."""
    if progress is None:
        return None
    farthest = -1.0

    def tell(item: str, done: int, in_all: int) -> None:
        nonlocal farthest
        share = done / max(1, in_all)
        if share > farthest:
            farthest = share
            progress(stage, item, done, in_all)

    return tell


def _inertials(robot: Robot) -> Sequence[_core.Inertial]:
    """One per joint; none if some motion has no mass, or an inertia is of no body, with a warning if the description
    has inertias at all."""
    try:
        inertials = robot.inertials
    except ValueError as error:
        warnings.warn(
            f"robot {robot.name!r}: {error}; the arm has no dynamics, so correct the <inertia>, or give mass "
            "matrix and bias to what needs them",
            RuntimeWarning,
            stacklevel=4,
        )
        return ()
    if all(inertial.mass == 0.0 for inertial in inertials):
        return ()
    eigenvalues = np.linalg.eigvalsh(robot.mass_matrix(robot.neutral))
    if eigenvalues[0] > _NO_MASS * eigenvalues[-1]:
        return inertials
    warnings.warn(
        f"robot {robot.name!r}: some motion moves no mass, because links lack <inertial>; "
        "the arm has no dynamics, so give mass matrix and bias to what needs them",
        RuntimeWarning,
        stacklevel=4,
    )
    return ()


def _today() -> str:
    """The date in UTC; that of SOURCE_DATE_EPOCH where it is set, for builds that can be repeated."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    now = (
        datetime.datetime.now(datetime.UTC)
        if epoch is None
        else datetime.datetime.fromtimestamp(int(epoch), datetime.UTC)
    )
    return now.date().isoformat()
