"""Which links of an arm get barriers against each other, and how near their ellipsoids may come."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from sidestep import shipped_arms
from sidestep._core import ClearanceTable, Obstacles, SelfCollisionBarrier
from sidestep.arm import clearance_tables as tables_room
from sidestep.arm.clearance_tables import Progress, TableEffort, clearance_tables
from sidestep.arm.pair_content import PairContent
from sidestep.body import Body
from sidestep.distance import SelfCollision
from sidestep.distance.travel import travel_per_joint
from sidestep.robot import Robot
from sidestep.storage.user_cache import ContentStore

Array: TypeAlias = npt.NDArray[np.float64]
LinkPair: TypeAlias = tuple[str, str, float]
_Measured: TypeAlias = tuple[str, str, float | None]  # None: ellipsoids are no measure

ALGORITHM_VERSION = 2
FOLDER = "pairs"  # of the user's cache
FEW = 3  # coordinates between two links of which so many samples are dense enough to calibrate a contact
TOUCHING = 20  # samples in which they touch that are needed for it
NEAR = 0.002  # distance of meshes that counts as touching [m]
MOST_LOST = 0.3  # of samples that lose their clearance without touching: above, ellipsoids are no measure
CHECKS = 100  # configurations by which a coarse table is judged
HALVINGS = 14  # of a way from touching to apart: to 1/16,000 of it
UNBOUNDED = 1e9  # [m/rad | m/m] more than any arm
SHARE = 0.95  # of samples in which the meshes are apart that the ellipsoids must be: otherwise they are no measure


@dataclass(frozen=True)
class PairEffort:
    """How long contacts are looked for.

    Attributes:
        samples: random configurations, of which the gaps between ellipsoids are taken.
        ways: from samples in which they touch to others, on which the contact is looked for; half of them from those
            with the widest gaps.
        tables: of the pairs that have them.
    """

    samples: int
    ways: int
    tables: TableEffort


FULL = PairEffort(samples=3000, ways=200, tables=tables_room.FULL)
DRAFT = PairEffort(samples=600, ways=60, tables=tables_room.DRAFT)


def barrier_pairs(
    robot: Robot,
    body: Body,
    *,
    effort: PairEffort = FULL,
    check: SelfCollision | None = None,
    cached: bool = True,
    progress: Progress | None = None,
) -> tuple[LinkPair, ...]:
    """The pairs of links that may touch, with the gap at which they do: (first, second, contact).

    Covering ellipsoids are larger than links: neighbours but one overlap while their meshes are apart. Where at most
    three coordinates lie between two links that touch in 20 random configurations at least, `contact` is the largest
    gap between their ellipsoids at which their meshes come within 2 mm, on straight ways from 200 configurations in
    which they touch to others: an estimate by samples. Else it is zero, which is safe. Where the clearance is then
    below zero in more than 5 % of the samples, though they do not touch, `contact` is as near as 5 % of these are, at
    least as near as they touch. Where 30 % are still below, ellipsoids are no measure: such pairs are left out, with a
    warning if they have no table. Those that touch nowhere (`clearance_tables`) are left out too.

    That takes seconds, so each pair is kept in the user's cache, by its joints, limits, meshes and ellipsoids: of an
    arm with another gripper only the pairs of that are measured. Warns about an entry that cannot be read or written.

    Args:
        robot: with collision meshes. body: a covering body of it. effort: how long they are looked for.
        check: of the robot, where it is at hand. cached: whether the user's cache is read and written.
        progress: called as progress("link, link", done, in_all) for each pair that the cache does not answer.
    """
    check = check or SelfCollision(robot)
    measured = _find_pairs(robot, body, effort, check, cached, progress)
    exact = clearance_tables(robot, effort=effort.tables, check=check, cached=cached)
    return _kept(robot, [pair for pair in measured if pair[:2] not in exact.apart], exact.pairs)


def tables_and_pairs(
    robot: Robot,
    body: Body,
    *,
    effort: PairEffort = FULL,
    check: SelfCollision | None = None,
    cached: bool = True,
    progress: Progress | None = None,
    pair_progress: Progress | None = None,
) -> tuple[tuple[ClearanceTable, ...], tuple[LinkPair, ...]]:
    """What tells how far links are apart: tables (`clearance_tables`), for other pairs covers (`barrier_pairs`).

    Both are read from the arm that comes with Sidestep, where there is one of these meshes, position limits and cover.

    Args:
        robot: with collision meshes. body: a covering body of it. effort: how long they are looked for.
        check: of the robot, where it is at hand. cached: whether shipped arms and the user's cache are used.
        progress: of the tables, as in `clearance_tables`. pair_progress: of the other pairs, as in `barrier_pairs`.
    """
    shipped = shipped_arms.with_clearances_of(robot) if cached else None
    if shipped is not None and shipped_arms.has_body(shipped, body):
        return tuple(shipped.tables), tuple(shipped.pairs)
    check = check or SelfCollision(robot)
    if effort is DRAFT:
        return _draft(robot, body, check, cached, progress, pair_progress)
    exact = clearance_tables(robot, effort=effort.tables, check=check, cached=cached, progress=progress)
    pairs = barrier_pairs(robot, body, effort=effort, check=check, cached=cached, progress=pair_progress)
    return exact.tables, tuple(pair for pair in pairs if pair[:2] not in exact.pairs)


def _draft(
    robot: Robot,
    body: Body,
    check: SelfCollision,
    cached: bool,
    progress: Progress | None,
    pair_progress: Progress | None,
) -> tuple[tuple[ClearanceTable, ...], tuple[LinkPair, ...]]:
    """Covers wherever they measure well enough, as tables take longer; tables of the other pairs that can have one."""
    measured = _find_pairs(robot, body, DRAFT, check, cached, pair_progress)
    left = [(first, second) for first, second, contact in measured if contact is None]

    def tables_of(pairs: Sequence[tuple[str, str]], effort: TableEffort) -> tables_room.ClearanceTables:
        return clearance_tables(
            robot, effort=effort, only=pairs, check=check, cached=cached, progress=progress
        )

    coarse = tables_of(left, DRAFT.tables)
    good = tuple(table for table in coarse.tables if _tells_apart(table, check, robot))
    poor = [(table.first, table.second) for table in coarse.tables if table not in good]
    fine = tables_of(poor, FULL.tables)
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


def _find_pairs(
    robot: Robot,
    body: Body,
    effort: PairEffort,
    check: SelfCollision,
    cached: bool,
    progress: Progress | None,
) -> tuple[_Measured, ...]:
    pairs = [pair for pair in check.pairs if set(body.links).issuperset(pair)]
    store = ContentStore(FOLDER, "the contact of a pair", enabled=cached)
    content = PairContent(robot, body)
    settings = ("contact", ALGORITHM_VERSION, FEW, TOUCHING, NEAR, MOST_LOST, SHARE, HALVINGS, effort)
    keys = {pair: content.key(*pair, settings) for pair in pairs}
    known = {pair: stored for pair in pairs if (stored := store.get(keys[pair], _contact)) is not None}
    missing = [pair for pair in pairs if pair not in known]
    if missing:
        samples = _Samples(robot, body, missing, effort, check)
        for k, pair in enumerate(missing):
            if progress is not None:
                progress(", ".join(pair), k, len(missing))
            known[pair] = (samples.contact(k),)
            store.put(keys[pair], {"contact": known[pair][0]})
    return tuple((*pair, known[pair][0]) for pair in pairs)


def _contact(document: dict[str, Any]) -> tuple[float | None]:
    contact = document["contact"]
    return (None if contact is None else float(contact),)


class _Samples:
    """Gaps between the ellipsoids of pairs at random configurations, and what they tell of contacts.

    What is found of a pair depends on its joints, limits, surfaces and ellipsoids alone, not on the rest of the robot.
    """

    def __init__(
        self,
        robot: Robot,
        body: Body,
        pairs: Sequence[tuple[str, str]],
        effort: PairEffort,
        check: SelfCollision,
    ) -> None:
        self._robot, self._body, self._pairs = robot, body, pairs
        self._effort, self._check = effort, check
        self._configurations = robot.random_configurations(effort.samples)
        gaps = _gaps(robot, body, pairs)
        self._found = np.array([gaps(q) for q in self._configurations])

    def contact(self, k: int) -> float | None:
        """The gap at which pair k touches; None where ellipsoids are no measure."""
        check, pair, samples = self._check, self._pairs[k], self._effort.samples
        coordinates = check.coordinates_between(*pair)
        few = len(coordinates) <= FEW
        gap = self._found[: samples if few else samples // 10, k]
        # Ellipsoids cover links: those of links that touch overlap.
        overlap = np.flatnonzero(gap < 0.0)
        touch = np.array([check.within(self._configurations[i], *pair, NEAR) for i in overlap], dtype=bool)
        touching = overlap[touch]

        def below(at: float) -> float:
            """The share of the samples that lose their clearance though the links do not touch."""
            lost = gap < at
            lost[touching] = False
            return float(lost.mean())

        often = few and touch.sum() >= TOUCHING
        if not often and below(0.0) <= 1.0 - SHARE:
            return 0.0
        measured = self._largest_gap(k, touching, gap)
        contact = measured if often else 0.0
        if below(contact) > 1.0 - SHARE:
            if len(coordinates) == 2:  # a table tells more
                return None
            # As near as they were seen not to touch, and not as near as they touch.
            contact = min(0.0, max(measured, float(np.quantile(np.delete(gap, touching), 1.0 - SHARE))))
        return contact if below(contact) <= MOST_LOST else None

    def _largest_gap(self, k: int, touching: npt.NDArray[np.intp], gap: Array) -> float:
        """The largest gap [m] at which the links touch, at most 0, on ways to configurations in which they do not."""
        apart = np.setdiff1d(np.arange(len(gap)), touching)
        if not len(touching) or not len(apart):
            return -np.inf  # nothing touches, or everything
        pair, ways, draw = self._pairs[k], self._effort.ways, np.random.default_rng(1)
        deep = touching[np.argsort(-gap[touching], kind="stable")][: ways // 2]  # which have the widest gaps
        starts = np.concatenate([deep, draw.choice(touching, ways - len(deep))])
        ends = draw.choice(apart, ways)
        gaps = _gaps(self._robot, self._body, [pair])
        travel = self._travel(pair)
        largest = -np.inf
        for way in np.argsort(-gap[starts], kind="stable"):  # the most promising first
            inside, outside = self._configurations[starts[way]], self._configurations[ends[way]]
            at = float(gap[starts[way]])
            for _ in range(HALVINGS):
                # What the gap cannot exceed from here to the other end.
                if largest >= 0.0 or at + travel @ np.abs(outside - inside) <= largest:
                    break
                middle = 0.5 * (inside + outside)
                between = float(gaps(middle)[0])
                if between <= NEAR and self._check.within(middle, *pair, NEAR):
                    inside, at = middle, between
                else:
                    outside = middle
            largest = max(largest, at)
        return min(0.0, largest)

    def _travel(self, pair: tuple[str, str]) -> Array:
        """How far points of the ellipsoids of two links can come towards each other per unit of each joint (nv,)."""
        owner, travel = np.asarray(self._body.links), np.zeros(self._robot.num_coordinates)
        levels = self._body.levels
        assert levels is not None
        between = np.zeros(self._robot.num_coordinates, dtype=bool)
        between[list(self._check.coordinates_between(*pair))] = True
        for link in pair:
            own = owner == link
            variances = np.diagonal(np.asarray(self._body.covariances)[own], axis1=1, axis2=2)
            reach = np.sqrt(variances * np.asarray(levels)[own, None])
            signs = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
            corners = np.asarray(self._body.means)[own, None] + reach[:, None] * signs
            try:
                travel += travel_per_joint(self._robot, link, corners.reshape(-1, 3))
            except ValueError:  # a slide without limits: nothing bounds how far a link behind it turns
                return np.where(between, UNBOUNDED, 0.0)
        return np.where(between, travel, 0.0)


def _gaps(robot: Robot, body: Body, pairs: Sequence[tuple[str, str]]) -> Callable[[Array], Array]:
    """The gaps (P,) [m] between the ellipsoids of pairs at a configuration (nv,)."""
    barrier = SelfCollisionBarrier(robot, body, list(pairs))
    rest, nothing = np.zeros(robot.num_coordinates), Obstacles.none()
    return lambda q: np.array(barrier.evaluate(q, rest, nothing).clearances)
