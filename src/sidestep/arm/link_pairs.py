"""Which links of an arm get barriers against each other, and how near their ellipsoids may come."""

from __future__ import annotations

import hashlib
import json
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from sidestep._core import ClearanceTable, Obstacles, SelfCollisionBarrier
from sidestep.arm import clearance_tables as tables_room
from sidestep.arm import shipped_arms
from sidestep.arm.clearance_tables import Progress, TableEffort, clearance_tables
from sidestep.body import Body, cache
from sidestep.body.file import write_text
from sidestep.distance import SelfCollision
from sidestep.robot import Robot

Array: TypeAlias = npt.NDArray[np.float64]
LinkPair: TypeAlias = tuple[str, str, float]
_Measured: TypeAlias = tuple[str, str, float | None]  # None: ellipsoids are no measure

FEW = 3  # coordinates between two links of which so many samples are dense enough to calibrate a contact
TOUCHING = 20  # samples in which they touch that are needed for it
NEAR = 0.002  # distance of meshes that counts as touching [m]
MOST_LOST = 0.3  # of samples that lose their clearance without touching: above, ellipsoids are no measure
CHECKS = 100  # configurations by which a coarse table is judged
SHARE = 0.95  # of samples in which the meshes are apart that the ellipsoids must be: otherwise they are no measure


@dataclass(frozen=True)
class PairEffort:
    """How long contacts are looked for.

    Attributes:
        samples: random configurations, of which the gaps between ellipsoids are taken.
        ways: from samples in which they touch to others, on which the contact is looked for.
        tables: of the pairs that have them.
    """

    samples: int
    ways: int
    tables: TableEffort


FULL = PairEffort(samples=3000, ways=200, tables=tables_room.FULL)
DRAFT = PairEffort(samples=600, ways=60, tables=tables_room.DRAFT)


def barrier_pairs(
    robot: Robot, body: Body, *, effort: PairEffort = FULL, progress: Progress | None = None
) -> tuple[LinkPair, ...]:
    """The pairs of links that may touch, with the gap at which they do: (first, second, contact).

    Covering ellipsoids are larger than links: neighbours but one overlap while their meshes are apart. Where at most
    three coordinates lie between two links that touch in 20 random configurations at least, `contact` is the largest
    gap between their ellipsoids at which their meshes come within 2 mm, on straight ways from 200 configurations in
    which they touch to others: an estimate by samples. Else it is zero, which is safe. Where the clearance is then
    below zero in more than 5 % of the samples, though they do not touch, `contact` is as near as 5 % of these are, at
    least as near as they touch. Where 30 % are still below, ellipsoids are no measure: such pairs are left out, with a
    warning if they have no table. Those that touch nowhere (`clearance_tables`) are left out too.

    That takes seconds, so the pairs are kept beside the bodies in the user's cache. Warns about an entry that cannot be
    read or written.

    Args:
        robot: with collision meshes. body: a covering body of it. effort: how long they are looked for.
        progress: called as progress("link, link", done, in_all) for each pair; not called when the cache answers.
    """
    stored = cache.stored_or_made(
        stored_at(robot, body, effort),
        _read_pairs,
        lambda: _find_pairs(robot, body, effort, progress),
        lambda file, pairs: write_text(file, json.dumps(pairs, indent=1) + "\n"),
        ("pairs of links are unreadable and are made again", "the pairs of links are not cached"),
    )
    exact = clearance_tables(robot, effort=effort.tables)
    return _kept(robot, [pair for pair in stored if pair[:2] not in exact.apart], exact.pairs)


def tables_and_pairs(
    robot: Robot,
    body: Body,
    *,
    effort: PairEffort = FULL,
    progress: Progress | None = None,
    pair_progress: Progress | None = None,
) -> tuple[tuple[ClearanceTable, ...], tuple[LinkPair, ...]]:
    """What tells how far links are apart: tables (`clearance_tables`), for other pairs covers (`barrier_pairs`).

    Both are read from the arm that comes with Sidestep, where there is one of these meshes, position limits and cover.

    Args:
        robot: with collision meshes. body: a covering body of it. effort: how long they are looked for.
        progress: of the tables, as in `clearance_tables`. pair_progress: of the other pairs, as in `barrier_pairs`.
    """
    shipped = shipped_arms.with_clearances_of(robot)
    if shipped is not None and shipped_arms.has_body(shipped, body):
        return tuple(shipped.tables), tuple(shipped.pairs)
    if effort is DRAFT:
        return _draft(robot, body, progress, pair_progress)
    exact = clearance_tables(robot, effort=effort.tables, progress=progress)
    pairs = barrier_pairs(robot, body, effort=effort, progress=pair_progress)
    return exact.tables, tuple(pair for pair in pairs if pair[:2] not in exact.pairs)


def _draft(
    robot: Robot, body: Body, progress: Progress | None, pair_progress: Progress | None
) -> tuple[tuple[ClearanceTable, ...], tuple[LinkPair, ...]]:
    """Covers wherever they measure well enough, as tables take longer; tables of the other pairs that can have one."""
    measured = _find_pairs(robot, body, DRAFT, pair_progress)
    left = [(first, second) for first, second, contact in measured if contact is None]
    coarse = clearance_tables(robot, effort=DRAFT.tables, only=left, progress=progress)
    check = SelfCollision(robot) if coarse.tables else None
    good = tuple(table for table in coarse.tables if check is not None and _tells_apart(table, check, robot))
    poor = [(table.first, table.second) for table in coarse.tables if table not in good]
    fine = clearance_tables(robot, effort=FULL.tables, only=poor, progress=progress)
    tables = good + fine.tables
    exact = [*((table.first, table.second) for table in tables), *coarse.apart, *fine.apart]
    return tables, _kept(robot, measured, exact)


def _kept(robot: Robot, pairs: Sequence[_Measured], exact: Sequence[tuple[str, str]]) -> tuple[LinkPair, ...]:
    """Those that ellipsoids measure; warns of others that have no table either."""
    bare = [pair[:2] for pair in pairs if pair[2] is None and pair[:2] not in exact]
    if bare:
        words = ", ".join(f"{first!r} and {second!r}" for first, second in bare)
        warnings.warn(
            f"robot {robot.name!r}: no clearance is kept between these links, whose covers overlap where they are "
            f"apart; keep the arm from such postures: {words}",
            RuntimeWarning,
            stacklevel=6,
        )
    return tuple((first, second, contact) for first, second, contact in pairs if contact is not None)


def _tells_apart(table: ClearanceTable, check: SelfCollision, robot: Robot) -> bool:
    """Whether a table is above zero in nearly all random configurations in which the meshes do not touch."""
    rng, touches, below = np.random.default_rng(0), 0, 0
    for _ in range(CHECKS):
        q = robot.random_configuration(rng)
        if check.within(q, table.first, table.second, 0.0):
            touches += 1
        elif table.at(*q[list(table.coordinates)])[0] < 0.0:
            below += 1
    return below <= (1.0 - SHARE) * (CHECKS - touches)


def _read_pairs(path: Path) -> tuple[_Measured, ...]:
    return tuple(
        (str(a), str(b), None if contact is None else float(contact))
        for a, b, contact in json.loads(path.read_text())
    )


def stored_at(robot: Robot, body: Body, effort: PairEffort = FULL) -> Path:
    """The file of the pairs of a body; its name is a hash of what they are made from."""
    ends = robot.limits.lower.tolist(), robot.limits.upper.tolist()  # which the fingerprint leaves out
    numbers = (robot.name, robot.fingerprint, *ends, body.links, FEW, TOUCHING, NEAR, SHARE, effort)
    key = hashlib.sha256(repr(numbers).encode())
    for array in (body.means, np.array(body.covariances), body.levels):
        key.update(np.ascontiguousarray(array).tobytes())
    return cache.cache_directory() / f"pairs-{key.hexdigest()}.json"


def _find_pairs(
    robot: Robot, body: Body, effort: PairEffort, progress: Progress | None
) -> tuple[_Measured, ...]:
    check = SelfCollision(robot)
    pairs = [pair for pair in check.pairs if set(body.links).issuperset(pair)]
    if not pairs:
        return ()
    barrier = SelfCollisionBarrier(robot, body, pairs)
    rng, rest = np.random.default_rng(0), np.zeros(robot.num_coordinates)

    def gaps(q: Array) -> Array:
        return barrier.evaluate(q, rest, Obstacles.none()).clearances

    configurations = np.array([robot.random_configuration(rng) for _ in range(effort.samples)])
    found = np.array([gaps(q) for q in configurations])
    result: list[_Measured] = []
    for k, pair in enumerate(pairs):
        if progress is not None:
            progress(", ".join(pair), k, len(pairs))
        few = len(check.coordinates_between(*pair)) <= FEW
        looked = slice(0, effort.samples if few else effort.samples // 10)
        # Ellipsoids cover links: those of links that touch overlap.
        overlap = np.flatnonzero(found[looked, k] < 0.0)
        touch = np.array([check.within(configurations[i], *pair, NEAR) for i in overlap], dtype=bool)
        touching, gap = overlap[touch], found[looked, k]
        measured = -np.inf  # the largest gap at which they touch
        often = few and touch.sum() >= TOUCHING
        if touch.any() and not touch.all():
            draw = rng if often else np.random.default_rng((1, k))
            apart = np.setdiff1d(np.arange(looked.stop), touching)
            ends = zip(draw.choice(touching, effort.ways), draw.choice(apart, effort.ways), strict=True)
            first = [_first_touch(check, pair, configurations[i], configurations[j]) for i, j in ends]
            measured = min(0.0, max(float(gaps(q)[k]) for q in first))
        contact = measured if often else 0.0

        def below(at: float, gap: Array = gap, touching: npt.NDArray[np.intp] = touching) -> float:
            """The share of the samples that lose their clearance though the links do not touch."""
            lost = gap < at
            lost[touching] = False
            return float(lost.mean())

        if below(contact) > 1.0 - SHARE:
            if len(check.coordinates_between(*pair)) == 2:  # a table tells more
                result.append((*pair, None))
                continue
            # As near as they were seen not to touch, and not as near as they touch.
            contact = min(0.0, max(measured, float(np.quantile(np.delete(gap, touching), 1.0 - SHARE))))
        result.append((*pair, contact if below(contact) <= MOST_LOST else None))
    return tuple(result)


def _first_touch(check: SelfCollision, pair: tuple[str, str], touching: Array, apart: Array) -> Array:
    """A configuration between the two at which the pair is just within `NEAR`, by halving."""
    for _ in range(14):  # to 1/16,000 of the way
        middle = 0.5 * (touching + apart)
        if check.within(middle, *pair, NEAR):
            touching = middle
        else:
            apart = middle
    return touching
