"""The search for the ellipsoids that cover one link, for every number of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from threading import Lock
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt
import trimesh
from scipy.spatial import cKDTree

from sidestep.body.cover_certificate import complete, grow
from sidestep.body.cover_overshoot import Overshoot, overshoot
from sidestep.body.cover_refine import (
    HOP,
    OUTLINE,
    POLISH,
    Ellipsoids,
    RefineSettings,
    initial,
    rearranged,
    refine,
)
from sidestep.body.cover_surface import Array, LinkSurface, SurfaceDetail, distinct_corners
from sidestep.shapes.mesh_reader import simplified

MEAN_AIM = 4e-3  # mean overshoot aimed at on a link of AIM_SIZE or more [m]
MAX_AIM = 14.5e-3  # the largest, which is to be 15 mm: the search misses up to half a millimetre of a peak
AIM_SIZE = 0.15  # a link of an arm [m]
AIM_POWER = 0.6  # of the size, with which the aims of smaller links go: 1.4 and 4.9 mm on a finger of 25 mm
BEYOND_MAX = 5.0  # what the largest overshoot costs more, as a share of its aim, where it is larger
MERGED_SHARE = 0.35  # of the size of a piece: vertices that near are merged where a mesh is made coarser


EffortName: TypeAlias = Literal["draft", "fine", "best"]


@dataclass(frozen=True)
class Effort:
    """How long covers are looked for; all of them are proven.

    Attributes:
        detail: of the surface, which distances are measured to.
        merged: vertices of a mesh of more than that many triangles are merged first, where they are nearer than a third
            of a piece, and the proof alone is on all triangles; 0: never.
        most: ellipsoids of a link, of those that links share: more hold a box little better, and cost every step.
        outline: steps of the descent of an outline: with 300 it overshoots 3 % more than with 800.
        trial_starts: outlines tried while numbers of ellipsoids are compared.
        trial_hops: rearrangements tried of the best of them.
        final_starts: more of them with the final number: the best of 10 overshoots 5 to 15 % less.
        final_hops: more rearrangements with the final number: 100 of them give 5 to 15 % less again.
        coarse: surface points that an outline must hold, besides the triangles' corners.
        fine: surface points that the final refinement must hold; the proof itself needs no points.
        piece: longest edge of a triangle that the proof does not cut further, of a link's size: ellipsoids grow until
            they hold such pieces as a whole.
        directions: boundary points per ellipsoid in the search: with 4,000 peaks are missed by up to 0.7 mm.
        final_directions: the same for the cover that is kept; 0: what the search has measured.
        volume_samples: of the union's volume: with 200,000 its standard error is below 0.5 %.
    """

    detail: SurfaceDetail
    merged: int
    most: int
    outline: int
    trial_starts: int
    trial_hops: int
    final_starts: int
    final_hops: int
    coarse: int
    fine: int
    piece: float
    directions: int
    final_directions: int
    volume_samples: int


EFFORTS: dict[EffortName, Effort] = {
    "draft": Effort(
        SurfaceDetail(nodes=16_000, pieces=1_500),
        merged=3_000,
        most=6,
        outline=300,
        trial_starts=2,
        trial_hops=0,
        final_starts=0,
        final_hops=0,
        coarse=400,
        fine=3_000,
        piece=1 / 100,
        directions=1_000,
        final_directions=0,
        volume_samples=10_000,
    ),
    "fine": Effort(
        SurfaceDetail(),
        merged=0,
        most=16,
        outline=800,
        trial_starts=1,
        trial_hops=2,
        final_starts=3,
        final_hops=20,
        coarse=1_000,
        fine=30_000,
        piece=1 / 400,
        directions=2_000,
        final_directions=16_000,
        volume_samples=200_000,
    ),
    "best": Effort(
        SurfaceDetail(),
        merged=0,
        most=80,
        outline=800,
        trial_starts=2,
        trial_hops=10,
        final_starts=10,
        final_hops=100,
        coarse=1_000,
        fine=30_000,
        piece=1 / 400,
        directions=4_000,
        final_directions=16_000,
        volume_samples=200_000,
    ),
}

FINE = EFFORTS["fine"]


@dataclass(frozen=True)
class TradeOff:
    """Overshoot of one link with a number of ellipsoids [m]."""

    num_components: int
    mean_overshoot: float
    max_overshoot: float


@dataclass(frozen=True, eq=False)
class _Outline:
    """Ellipsoids that hold coarse points, how strongly each point pushes, and the overshoot."""

    ellipsoids: Ellipsoids
    multipliers: Array
    measured: Overshoot


@dataclass(frozen=True, eq=False)
class _Solution:
    ellipsoids: Ellipsoids
    measured: Overshoot


@dataclass(frozen=True)
class Trial:
    """What the search found with a number of ellipsoids, and its `LinkProblem.excess`."""

    found: TradeOff
    excess: float


class LinkProblem:
    """One link with the best cover known for every number of ellipsoids tried; the surface is made when it is needed.

    Args:
        triangles: of the link (F, 3, 3) [m]. seed: of the starts. allowance: of the overshoot, in the mean.
        effort: how long is looked. known: trials of a search that was the same.
    """

    def __init__(
        self,
        triangles: Array,
        *,
        seed: int,
        allowance: float = 1.0,
        effort: Effort = FINE,
        known: Mapping[int, Trial] | None = None,
    ) -> None:
        self.triangles = triangles
        self.seed = seed
        self.allowance = allowance
        self.effort = effort
        self.trials: dict[int, Trial] = dict(known or {})
        self.solutions: dict[int, _Solution] = {}
        self._asked: dict[int, TradeOff] = {}
        self._finished: set[int] = set()
        self._making = Lock()  # threads may solve several numbers of one link
        self._made: _Samples | None = None

    @property
    def surface(self) -> LinkSurface:
        return self._samples.surface

    @property
    def _samples(self) -> _Samples:
        with self._making:
            if self._made is None:
                self._made = _Samples.of(self.triangles, self.effort)
            return self._made

    def solve(self, number: int) -> _Solution:
        """A proven cover, good enough to compare numbers of ellipsoids by."""
        if number not in self.solutions:
            found = self._search(number, range(self.effort.trial_starts))
            self.solutions[number] = self._hop(found, self.effort.trial_hops)
        return self.solutions[number]

    def finish(self, number: int) -> _Solution:
        """The best cover found with a longer search."""
        if number not in self._finished:  # equal links share their covers
            best, tried = self.solve(number), self.effort.trial_starts
            if self.effort.final_starts:
                starts = range(tried, tried + self.effort.final_starts)
                best = min(best, self._search(number, starts), key=self._excess)
            best = self.solutions[number] = self._hop(best, self.effort.final_hops)
            self._asked[number] = _trade_off(number, best)
            self._finished.add(number)
        return self.solutions[number]

    def _search(self, number: int, starts: range) -> _Solution:
        """The best of several outlines, refined with finer points and completed."""
        outlines, settings = [], replace(OUTLINE, steps=self.effort.outline)
        for start in starts:
            first = initial(self.surface, self._samples.coarse, number, self.seed + start)
            outline = self._outline(first, settings)
            outlines.append((self._excess(outline), start, outline))
        return self._polish(min(outlines, key=lambda entry: entry[:2])[2])

    def _hop(self, best: _Solution, hops: int) -> _Solution:
        """Basin hopping: rearranges the best cover and descends from there; keeps what is better."""
        rng = np.random.default_rng(self.seed)
        for _ in range(hops):
            measured = best.measured
            weights = measured.distances * measured.areas
            moved = rearranged(self.surface, best.ellipsoids, measured.points, weights, rng)
            outline = self._outline(moved, HOP)
            if self._excess(outline) < self._excess(best):  # coarse points flatter
                best = min(best, self._polish(outline), key=self._excess)
        return best

    def _outline(self, start: Ellipsoids, settings: RefineSettings) -> _Outline:
        ellipsoids, multipliers = refine(self.surface, self._samples.coarse, start, settings)
        grown = grow(ellipsoids, self._samples.coarse[:, None])
        return _Outline(
            ellipsoids, multipliers, overshoot(self.surface, grown, directions=settings.directions)
        )

    def _polish(self, outline: _Outline) -> _Solution:
        """Refined with finer points and completed."""
        samples = self._samples
        pushing = np.flatnonzero(outline.multipliers)
        fine = np.zeros(len(samples.fine))
        fine[samples.nearest_fine[pushing]] = outline.multipliers[pushing]
        return self._proven(refine(samples.surface, samples.fine, outline.ellipsoids, POLISH, fine)[0])

    def _proven(self, ellipsoids: Ellipsoids) -> _Solution:
        surface, samples = self.surface, self._samples
        tolerance = self.effort.piece * surface.size
        covering, _ = complete(self.triangles, ellipsoids, tolerance=tolerance, points=samples.held)
        return _Solution(covering, overshoot(surface, covering, directions=self.effort.directions))

    def excess(self, number: int) -> float:
        """Overshoot over what is aimed at: the mean of its two measures, and more beyond the aim of the largest."""
        if number not in self.trials:
            found = self.solve(number)
            self.trials[number] = Trial(_trade_off(number, found), self._excess(found))
        trial = self.trials[number]
        self._asked[number] = trial.found
        return trial.excess

    def _excess(self, found: _Outline | _Solution) -> float:
        scale = min(1.0, self.surface.size / AIM_SIZE) ** AIM_POWER
        mean = found.measured.mean / (MEAN_AIM * scale * self.allowance)
        maximum = found.measured.maximum / (MAX_AIM * scale)
        return float(0.5 * (mean + maximum) + BEYOND_MAX / self.allowance**2 * max(0.0, maximum - 1.0))

    def was_finished(self, found: TradeOff) -> None:
        """Takes what another, equal search found in the end for the `trade_off`."""
        self._asked[found.num_components] = found

    def trade_off(self) -> tuple[TradeOff, ...]:
        """Of the numbers that were asked for; of those that are finished, as they are in the end."""
        return tuple(found for _, found in sorted(self._asked.items()))


def _trade_off(number: int, found: _Solution) -> TradeOff:
    return TradeOff(number, found.measured.mean, found.measured.maximum)


@dataclass(frozen=True, eq=False)
class _Samples:
    """The surface of a link and points on it.

    Attributes:
        surface: which distances are measured to.
        coarse, fine: points that outlines and covers hold. nearest_fine: the fine point next to each coarse one.
        held: points that are covered before triangles are looked at.
    """

    surface: LinkSurface
    coarse: Array
    fine: Array
    nearest_fine: npt.NDArray[np.intp]
    held: Array

    @classmethod
    def of(cls, triangles: Array, effort: Effort) -> _Samples:
        merged = 0 < effort.merged < len(triangles)
        surface = LinkSurface(_merged(triangles, effort) if merged else triangles, effort.detail)
        coarse, fine = surface.points(effort.coarse), surface.points(effort.fine)
        held = distinct_corners(triangles) if merged else fine
        return cls(surface, coarse, fine, cKDTree(fine).query(coarse)[1], held)


def _merged(triangles: Array, effort: Effort) -> Array:
    """The triangles of a coarser mesh; all, where nothing is left of it."""
    area = 0.5 * np.linalg.norm(
        np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
    )
    cell = MERGED_SHARE * np.sqrt(4.0 * area.sum() / effort.detail.pieces)
    corners = triangles.reshape(-1, 3)
    mesh = trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)
    found = np.asarray(simplified(mesh, cell).triangles, dtype=np.float64)
    return found if len(found) else triangles
