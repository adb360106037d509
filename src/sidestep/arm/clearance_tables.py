"""The exact clearance of links with two joints between them, as tables over these two joints."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.ndimage import distance_transform_edt, maximum_filter

from sidestep import shipped_arms
from sidestep._core import ClearanceTable, JointType
from sidestep.arm.pair_content import PairContent
from sidestep.distance import SelfCollision
from sidestep.robot import Robot
from sidestep.storage.user_cache import ContentStore

Array: TypeAlias = npt.NDArray[np.float64]
Mask: TypeAlias = npt.NDArray[np.bool_]
Pair: TypeAlias = tuple[str, str]
Progress: TypeAlias = Callable[[str, int, int], None]

ALGORITHM_VERSION = 1
FOLDER = "tables"  # of the user's cache
BEYOND = 2  # control points beyond a limit: with one a spline ends at the limit
NEAR = 0.03  # [m] clearance below which the error is measured
STEP = 1e-6  # [m] control points are multiples of it, rounded down: far below the error of a table
TURN = 2.0 * np.pi


@dataclass(frozen=True)
class TableEffort:
    """How densely distances are measured.

    Attributes:
        spacing: of control points, at most [rad | m].
        cells: near contact whose error is measured, at most; random ones of more.
        checks: random configurations by which what is left of the error is taken off everywhere.
    """

    spacing: float
    cells: int
    checks: int


FULL = TableEffort(spacing=0.1, cells=1_000_000, checks=400)
DRAFT = TableEffort(spacing=0.3, cells=200, checks=50)


@dataclass(frozen=True)
class ClearanceTables:
    """What is known of the pairs of links that two coordinates move relative to each other.

    Attributes:
        tables: of those that may touch; for `ClearanceTableBarrier`.
        apart: those that touch nowhere within the position limits, which is proven.
    """

    tables: tuple[ClearanceTable, ...]
    apart: tuple[Pair, ...]

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """The pairs of both kinds, which need no other barrier."""
        return (*((table.first, table.second) for table in self.tables), *self.apart)


def clearance_tables(
    robot: Robot,
    *,
    effort: TableEffort = FULL,
    only: Sequence[Pair] | None = None,
    check: SelfCollision | None = None,
    cached: bool = True,
    progress: Progress | None = None,
) -> ClearanceTables:
    """Measures the distance of the exact meshes of pairs with two coordinates between, over these.

    Neighbours but one are always close, and covering ellipsoids, which are larger than links, overlap there. Their
    distance is measured at points 0.1 rad apart that serve as control points of a cubic B-spline, which smooths the
    creases of a distance and does not overshoot; where links overlap, it falls on into them as it does outside. What
    exceeds the distance at a random point of every cell near contact is taken off there, and the largest excess that is
    left at 400 more everywhere: an estimate by samples.

    A pair whose distance at every point exceeds what it can lose halfway to the next, by the lever arms of the joints,
    touches nowhere. A coordinate needs limits, unless it turns all its joints at its own rate.

    That takes seconds a pair, so each is kept in the user's cache, by its joints, limits and meshes: of an arm with
    another gripper only the pairs of that are measured. A robot with kinematics, meshes and position limits of one
    whose arm comes with Sidestep takes them from there. Warns about an entry that cannot be read or written.

    Args:
        robot: with collision meshes. effort: how densely they are measured. only: of these pairs.
        check: of the robot, where it is at hand. cached: whether the user's cache is read and written.
        progress: called as progress("link, link", done, in_all) for each pair that the cache does not answer.
    """
    shipped = shipped_arms.with_clearances_of(robot) if cached else None
    check = check or SelfCollision(robot)
    found = [pair for pair in _pairs_of_two(robot, check, effort) if only is None or pair.links in only]
    if shipped is not None:
        measured = {(table.first, table.second) for table in shipped.tables}
        return ClearanceTables(
            tuple(shipped.tables), tuple(pair.links for pair in found if pair.links not in measured)
        )
    store = ContentStore(FOLDER, "the clearance table of a pair", enabled=cached)
    content = PairContent(robot)
    keys = {pair.links: content.key(*pair.links, _settings(robot, pair, effort)) for pair in found}
    known: dict[Pair, ClearanceTable | None] = {}
    missing: list[_PairOfTwo] = []
    for pair in found:
        stored = store.get(keys[pair.links], pair.from_document)
        if stored is None:
            missing.append(pair)
        else:
            known[pair.links] = stored.table
    for done, pair in enumerate(missing):
        if progress is not None:
            progress(", ".join(pair.links), done, len(missing))
        made = known[pair.links] = _measure(robot, check, pair, effort)
        store.put(keys[pair.links], _document(made))
    tables = [known[pair.links] for pair in found]
    return ClearanceTables(
        tuple(table for table in tables if table is not None),
        tuple(pair.links for pair in found if known[pair.links] is None),
    )


def _settings(robot: Robot, pair: _PairOfTwo, effort: TableEffort) -> tuple[object, ...]:
    axes = [robot.coordinate_names[coordinate] for coordinate in pair.between]
    return "table", ALGORITHM_VERSION, BEYOND, NEAR, STEP, effort, axes


@dataclass(frozen=True)
class _Stored:
    """What the cache knows of a pair: its table, or None where it touches nowhere."""

    table: ClearanceTable | None


@dataclass(frozen=True)
class _Axis:
    """Where the control points of a coordinate are."""

    coordinate: int
    begin: float
    spacing: float
    count: int
    periodic: bool

    @classmethod
    def of(cls, robot: Robot, coordinate: int, spacing: float) -> _Axis | None:
        moved = [joint for joint in robot.joints if joint.coordinate == coordinate]
        turns = all(joint.type == JointType.revolute and abs(joint.multiplier) == 1.0 for joint in moved)
        lower, upper = robot.limits.lower[coordinate], robot.limits.upper[coordinate]
        if turns and not upper - lower < TURN:
            count = int(np.ceil(TURN / spacing))
            return cls(coordinate, -np.pi, TURN / count, count, periodic=True)
        if not np.isfinite(upper - lower):
            return None
        cells = max(1, int(np.ceil((upper - lower) / spacing)))
        step = (upper - lower) / cells
        return cls(coordinate, lower - BEYOND * step, step, cells + 2 * BEYOND + 1, periodic=False)

    @property
    def points(self) -> Array:
        return self.begin + self.spacing * np.arange(self.count, dtype=np.float64)

    @property
    def inside(self) -> slice:
        """Those within the limits."""
        return slice(None) if self.periodic else slice(BEYOND, self.count - BEYOND)


@dataclass(frozen=True)
class _PairOfTwo:
    """Two links with two coordinates between, in the order of the robot, and where their control points are."""

    links: Pair
    between: tuple[int, ...]
    axes: tuple[_Axis, _Axis]

    def from_document(self, document: dict[str, Any]) -> _Stored:
        """The entry of the cache, for the coordinates of this robot."""
        if document["control"] is None:
            return _Stored(None)
        control = STEP * np.array(document["control"], dtype=np.float64)
        if control.shape != tuple(axis.count for axis in self.axes):
            raise ValueError(f"the control points have shape {control.shape}")
        return _Stored(_spline(self.links, self.axes, control))


def _document(table: ClearanceTable | None) -> dict[str, Any]:
    """Control points as whole numbers of `STEP`."""
    if table is None:
        return {"control": None}
    return {"control": np.rint(np.asarray(table.control) / STEP).astype(np.int64).tolist()}


def _measure(
    robot: Robot, check: SelfCollision, pair: _PairOfTwo, effort: TableEffort
) -> ClearanceTable | None:
    """The table of a pair, or None where it touches nowhere."""
    q, axes = robot.neutral.copy(), pair.axes

    def distance(x: float, y: float) -> float:
        q[list(pair.between)] = x, y
        return check.distance_between(q, *pair.links)

    grid = np.array([[distance(x, y) for y in axes[1].points] for x in axes[0].points])
    travel = check.travel_between(*pair.links)
    # Halfway to the next points.
    least = grid - sum(0.5 * axis.spacing * travel[axis.coordinate] for axis in axes)
    if least[axes[0].inside, axes[1].inside].min() > 0.0:
        return None
    return _table(pair.links, axes, _continued(grid, axes), distance, _near(least, axes), effort)


def _pairs_of_two(robot: Robot, check: SelfCollision, effort: TableEffort) -> list[_PairOfTwo]:
    """The pairs of links with two coordinates between that have control points."""
    found: list[_PairOfTwo] = []
    for links in check.pairs:
        between = check.coordinates_between(*links)
        if len(between) != 2:
            continue
        axes = [axis for c in between if (axis := _Axis.of(robot, c, effort.spacing)) is not None]
        if len(axes) == 2:
            found.append(_PairOfTwo(links, between, (axes[0], axes[1])))
    return found


def _continued(grid: Array, axes: Sequence[_Axis]) -> Array:
    """The distances (n, m) with those of links that overlap, 0, replaced by what lies as far on inside."""
    ways = [(axis.count if axis.periodic else 0,) * 2 for axis in axes]
    wide = np.pad(np.pad(grid, (ways[0], (0, 0)), mode="wrap"), ((0, 0), ways[1]), mode="wrap")
    overlap = wide <= 0.0
    if not overlap.any() or overlap.all():
        return grid
    spacing = [axis.spacing for axis in axes]
    slopes = np.hypot(*(_steepest(wide, axis, step) for axis, step in enumerate(spacing)))
    way, nearest = distance_transform_edt(overlap, sampling=spacing, return_indices=True)
    wide = np.where(overlap, -slopes[tuple(nearest)] * way, wide)
    inner = tuple(slice(before, size - after) for (before, after), size in zip(ways, wide.shape, strict=True))
    continued: Array = wide[inner]
    return continued


def _steepest(values: Array, axis: int, step: float) -> Array:
    """The larger of the two slopes to the neighbours along an axis."""
    slope = np.abs(np.diff(values, axis=axis)) / step
    nothing = np.zeros_like(np.take(slope, [0], axis=axis))
    steepest: Array = np.maximum(
        np.concatenate([nothing, slope], axis), np.concatenate([slope, nothing], axis)
    )
    return steepest


def _table(
    pair: Pair,
    axes: Sequence[_Axis],
    control: Array,
    distance: Callable[[float, float], float],
    near: Mask,
    effort: TableEffort,
) -> ClearanceTable:
    """With the excess over the distance taken off: where it was found, then the largest that is left everywhere."""
    rng, cells = np.random.default_rng(0), np.argwhere(near)
    if len(cells) > effort.cells:
        cells = cells[np.sort(rng.choice(len(cells), effort.cells, replace=False))]

    def excess(table: ClearanceTable, cell: npt.NDArray[np.int_]) -> float:
        x, y = (axis.points[k] + axis.spacing * rng.uniform() for axis, k in zip(axes, cell, strict=True))
        exact = distance(x, y)
        return max(0.0, table.at(x, y)[0] - exact) if exact > 0.0 else 0.0

    table, found = _spline(pair, axes, control), np.zeros_like(control)
    for cell in cells:
        found[tuple(cell)] = excess(table, cell)
    # A cell has the control points from one before it to two after it, and values between theirs.
    ends = ["wrap" if axis.periodic else "constant" for axis in axes]
    control = control - maximum_filter(found, size=4, mode=ends)
    table = _spline(pair, axes, control)
    checked = cells[rng.integers(len(cells), size=effort.checks)] if len(cells) else cells
    left = max((excess(table, cell) for cell in checked), default=0.0)
    return _spline(pair, axes, STEP * np.floor((control - left) / STEP))


def _near(least: Array, axes: Sequence[_Axis]) -> Mask:
    """Which cells, named by their first corner, are within the limits and may hold a distance below `NEAR`."""
    close = least < NEAR
    for k, axis in enumerate(axes):
        close = close | np.roll(close, -1, axis=k)
        if not axis.periodic:
            within = np.zeros(axis.count, dtype=bool)
            within[BEYOND : axis.count - BEYOND - 1] = True
            close = close & np.expand_dims(within, 1 - k)
    return close


def _spline(pair: Pair, axes: Sequence[_Axis], control: Array) -> ClearanceTable:
    return ClearanceTable(
        *pair,
        coordinates=(axes[0].coordinate, axes[1].coordinate),
        begin=(axes[0].begin, axes[1].begin),
        spacing=(axes[0].spacing, axes[1].spacing),
        periodic=(axes[0].periodic, axes[1].periodic),
        control=control,
    )
