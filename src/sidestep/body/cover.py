"""Covers every link of a robot with ellipsoids and shares the ellipsoids among the links."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import logsumexp

from sidestep.body.cover_certificate import complete, grow
from sidestep.body.cover_overshoot import Overshoot, interior_coverage, overshoot, union_volume
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
from sidestep.body.cover_surface import Array, LinkSurface
from sidestep.body.fitting import LinkFit, assess, mahalanobis_squared
from sidestep.body.mixture import Mixture
from sidestep.body.sampling import check_components, link_seed, links_with_geometry, sample_link

if TYPE_CHECKING:
    from sidestep.robot import Robot

ALGORITHM_VERSION = 3  # part of the cache's key: a cover of another algorithm is made again
MAX_COMPONENTS = 80
MEAN_AIM = 4e-3  # mean overshoot aimed at on a link of AIM_SIZE or more [m]
MAX_AIM = 14.5e-3  # the largest, which is to be 15 mm: the search misses up to half a millimetre of a peak
AIM_SIZE = 0.15  # a link of an arm [m]
AIM_POWER = 0.6  # of the size, with which the aims of smaller links go: 1.4 and 4.9 mm on a finger of 25 mm
FIXED_ALLOWANCE = 2.0  # in the mean, its square beyond MAX_AIM, of links that only self-collision sees
BEYOND_MAX = 5.0  # what the largest overshoot costs more, as a share of its aim, where it is larger
LOOKAHEAD = 3  # numbers tried ahead: one more ellipsoid can be useless where two more are not
GROWTH = 1.3  # numbers of ellipsoids tried on a link grow by this factor
CERTIFICATE_TOLERANCE = 1 / 400  # of a link's size: longest edge of a triangle that is not cut further
TRIAL_STARTS = 2  # outlines tried while numbers of ellipsoids are compared
TRIAL_HOPS = 10  # rearrangements tried of the best of them
FINAL_STARTS = 10  # more of them with the final number: the best of them overshoots 5 to 15 % less
FINAL_HOPS = 100  # more rearrangements with the final number: 5 to 15 % less again
NUM_COARSE = 1_000  # surface points that an outline must hold, besides the triangles' corners
NUM_FINE = 30_000  # surface points that the final refinement must hold; the proof itself needs no points
SEARCH_DIRECTIONS = 4_000  # boundary points per ellipsoid in the search: peaks are missed by up to 0.7 mm
NUM_SAMPLES = 4000  # surface points by which the density of the cover is assessed
SOLID_LEVEL = 5.0  # (y - mu)^T Sigma^-1 (y - mu) on the boundary of a solid ellipsoid of covariance Sigma
LEVEL_ROUNDING = 1e-9  # levels are larger by this share: rounding of the covariances cannot bare a corner

CoverProgress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class CoverSettings:
    """What a cover was asked for: equal settings on an equal robot give an equal body.

    Attributes:
        components: ellipsoids per link: one number for all, or {link: number}; links not named share what is
            left of `max_components`, and all links do if it is None.
        max_components: ellipsoids in all, when some are shared.
        seed: seed of the starts.
    """

    components: int | Mapping[str, int] | None = None
    max_components: int = MAX_COMPONENTS
    seed: int = 0

    def validate(self, robot: Robot) -> None:
        """Raises ValueError that names the setting, its value and what is allowed on this robot."""
        links = links_with_geometry(robot)
        if not links:
            raise ValueError(f"robot '{robot.name}' has no link with geometry to cover")
        if self.seed < 0:
            raise ValueError(f"seed is {self.seed}, must be >= 0")
        if isinstance(self.components, int):
            check_components(self.components, links)
            return
        check_components({**dict.fromkeys(links, 1), **(self.components or {})}, links)
        least = sum((self.components or {}).get(link, 1) for link in links)
        if self.max_components < least and self.num_shared(links) > 0:
            raise ValueError(
                f"max_components is {self.max_components}, must be at least {least}: "
                f"robot '{robot.name}' has {len(links)} links with geometry" + self._named()
            )

    def num_shared(self, links: Sequence[str]) -> int:
        """How many of these links share ellipsoids."""
        if isinstance(self.components, int):
            return 0
        return sum(link not in (self.components or {}) for link in links)

    def _named(self) -> str:
        asked = self.components
        return f", and components asks for {dict(asked)}" if isinstance(asked, Mapping) else ""


@dataclass(frozen=True)
class TradeOff:
    """Overshoot of one link with a number of ellipsoids [m]."""

    num_components: int
    mean_overshoot: float
    max_overshoot: float


@dataclass(frozen=True, eq=False)
class LinkCover:
    """How the ellipsoids of one link cover it.

    Attributes:
        link: name of the link.
        num_components: number of ellipsoids.
        coverage: share of the mesh's area proven to lie inside the union, triangle by triangle.
        mean_overshoot, max_overshoot: distance from the mesh [m] of the union's boundary where it is outside.
        volume_ratio: volume of the union over that of the mesh, or of its convex hull if the mesh is open.
        volume_of: "mesh" or "hull".
        interior_coverage: share of the link's inside that lies in the union; gaps there cannot be reached
            without crossing the surface.
        slimness: shortest over longest semi-axis, least over the ellipsoids.
        trade_off: what was tried on the way; unknown, and empty, of a cover from an arm file.
    """

    link: str
    num_components: int
    coverage: float
    mean_overshoot: float
    max_overshoot: float
    volume_ratio: float
    volume_of: str
    interior_coverage: float
    slimness: float
    trade_off: tuple[TradeOff, ...] = ()


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


class _LinkProblem:
    """One link with the best cover known for every number of ellipsoids tried."""

    def __init__(self, triangles: Array, *, seed: int, allowance: float = 1.0) -> None:
        self.surface = LinkSurface(triangles)
        self.seed = seed
        self.allowance = allowance
        self.coarse = self.surface.points(NUM_COARSE)
        self.fine = self.surface.points(NUM_FINE)
        self._nearest_fine = cKDTree(self.fine).query(self.coarse)[1]
        self.solutions: dict[int, _Solution] = {}
        self._finished: set[int] = set()

    def solve(self, number: int) -> _Solution:
        """A proven cover, good enough to compare numbers of ellipsoids by."""
        if number not in self.solutions:
            self.solutions[number] = self._hop(self._search(number, range(TRIAL_STARTS)), TRIAL_HOPS)
        return self.solutions[number]

    def finish(self, number: int) -> _Solution:
        """The best cover found with a longer search."""
        if number not in self._finished:  # equal links share their covers
            starts = range(TRIAL_STARTS, TRIAL_STARTS + FINAL_STARTS)
            best = min(self.solve(number), self._search(number, starts), key=self._excess)
            self.solutions[number] = self._hop(best, FINAL_HOPS)
            self._finished.add(number)
        return self.solutions[number]

    def _search(self, number: int, starts: range) -> _Solution:
        """The best of several outlines, refined with finer points and completed."""
        outlines = []
        for start in starts:
            outline = self._outline(initial(self.surface, self.coarse, number, self.seed + start), OUTLINE)
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
        ellipsoids, multipliers = refine(self.surface, self.coarse, start, settings)
        grown = grow(ellipsoids, self.coarse[:, None])
        return _Outline(
            ellipsoids, multipliers, overshoot(self.surface, grown, directions=settings.directions)
        )

    def _polish(self, outline: _Outline) -> _Solution:
        """Refined with finer points and completed."""
        pushing = np.flatnonzero(outline.multipliers)
        fine = np.zeros(len(self.fine))
        fine[self._nearest_fine[pushing]] = outline.multipliers[pushing]
        return self._proven(refine(self.surface, self.fine, outline.ellipsoids, POLISH, fine)[0])

    def _proven(self, ellipsoids: Ellipsoids) -> _Solution:
        surface = self.surface
        tolerance = CERTIFICATE_TOLERANCE * surface.size
        covering, _ = complete(surface.triangles, ellipsoids, tolerance=tolerance, points=self.fine)
        return _Solution(covering, overshoot(surface, covering, directions=SEARCH_DIRECTIONS))

    def excess(self, number: int) -> float:
        """Overshoot over what is aimed at: the mean of its two measures, and more beyond the aim of the largest."""
        return self._excess(self.solve(number))

    def _excess(self, found: _Outline | _Solution) -> float:
        scale = min(1.0, self.surface.size / AIM_SIZE) ** AIM_POWER
        mean = found.measured.mean / (MEAN_AIM * scale * self.allowance)
        maximum = found.measured.maximum / (MAX_AIM * scale)
        return float(0.5 * (mean + maximum) + BEYOND_MAX / self.allowance**2 * max(0.0, maximum - 1.0))

    def trade_off(self) -> tuple[TradeOff, ...]:
        found = sorted(self.solutions.items())
        return tuple(TradeOff(k, s.measured.mean, s.measured.maximum) for k, s in found)


def cover_links(
    robot: Robot, settings: CoverSettings, progress: CoverProgress | None = None
) -> tuple[tuple[LinkCover, Ellipsoids], ...]:
    """Covers all links with geometry; shares the ellipsoids so that the worst link is as good as possible.

    Raises:
        ValueError: if the settings do not suit the robot.
    """
    settings.validate(robot)
    twins: dict[tuple[bytes, float], _LinkProblem] = {}
    problems: dict[str, _LinkProblem] = {}
    moves = {frame.name: frame.joint >= 0 for frame in robot.frames}
    for link in links_with_geometry(robot):
        triangles = _triangles(robot, link)
        allowance = 1.0 if moves[link] else FIXED_ALLOWANCE
        key = (np.unique(triangles.reshape(-1, 3).round(9), axis=0).tobytes(), allowance)
        if key not in twins:  # fingers are often equal
            seed = link_seed(link, seed=settings.seed)
            twins[key] = _LinkProblem(triangles, seed=seed, allowance=allowance)
        problems[link] = twins[key]
    numbers = _numbers(problems, settings, progress)
    total = sum(numbers.values())
    covers: list[tuple[LinkCover, Ellipsoids]] = []
    for link, problem in problems.items():
        if progress is not None:
            progress(link, total + sum(cover.num_components for cover, _ in covers), 2 * total)
        covers.append(_assess(robot, link, problem, numbers[link]))
    if progress is not None:
        progress(link, 2 * total, 2 * total)
    return tuple(covers)


def _triangles(robot: Robot, link: str) -> Array:
    mesh = robot.collision_mesh(link)
    assert mesh is not None  # only links with geometry are asked for
    return np.asarray(mesh.triangles, dtype=np.float64)


def _numbers(
    problems: Mapping[str, _LinkProblem],
    settings: CoverSettings,
    progress: CoverProgress | None,
) -> dict[str, int]:
    asked = settings.components
    if isinstance(asked, int):
        asked = dict.fromkeys(problems, asked)
    best = {link: 1 if asked is None else asked.get(link, 1) for link in problems}
    shared = [link for link in problems if asked is None or link not in asked]
    while shared:
        spare = settings.max_components - sum(best.values())
        gains: list[tuple[float, str, int]] = []
        for link in shared:
            problem = problems[link]
            now = problem.excess(best[link])
            if now <= 1.0:
                continue
            following = best[link]
            for _ in range(LOOKAHEAD):
                following = max(following + 1, round(GROWTH * following))
                if following - best[link] > spare:
                    break
                if progress is not None:
                    progress(link, sum(best.values()), 2 * settings.max_components)
                gain = now**2 - problem.excess(following) ** 2
                if gain > 0.0:
                    gains.append((gain / (following - best[link]), link, following))
        if not gains:
            break
        _, link, number = max(gains)
        best[link] = number
    return best


def _assess(robot: Robot, link: str, problem: _LinkProblem, number: int) -> tuple[LinkCover, Ellipsoids]:
    surface = problem.surface
    triangles = _triangles(robot, link)
    tolerance = CERTIFICATE_TOLERANCE * surface.size
    ellipsoids, certificate = complete(
        triangles, problem.finish(number).ellipsoids, tolerance=tolerance, points=triangles.reshape(-1, 3)
    )
    measured = overshoot(surface, ellipsoids)
    mesh = robot.collision_mesh(link)
    assert mesh is not None
    closed = bool(mesh.is_watertight)
    volume = abs(float(mesh.volume if closed else mesh.convex_hull.volume))
    axes = np.linalg.svd(ellipsoids.shapes, compute_uv=False)
    cover = LinkCover(
        link=link,
        num_components=number,
        coverage=1.0 if certificate.complete else min(1.0, certificate.covered_area / certificate.total_area),
        mean_overshoot=measured.mean,
        max_overshoot=measured.maximum,
        volume_ratio=union_volume(ellipsoids, np.random.default_rng(problem.seed)) / volume,
        volume_of="mesh" if closed else "hull",
        interior_coverage=interior_coverage(surface, ellipsoids),
        slimness=float((axes[:, 2] / axes[:, 0]).min()),
        trade_off=problem.trade_off(),
    )
    return cover, ellipsoids


def cover_mixtures(
    robot: Robot, settings: CoverSettings, progress: CoverProgress | None = None
) -> tuple[tuple[LinkFit, Mixture, Array, LinkCover], ...]:
    """The covers of all links as mixtures of solid ellipsoids, with the levels of their boundaries (K,)."""
    results = []
    for cover, ellipsoids in cover_links(robot, settings, progress):
        volumes = np.abs(np.linalg.det(ellipsoids.shapes))
        covariances = ellipsoids.shapes @ ellipsoids.shapes.transpose(0, 2, 1) / SOLID_LEVEL
        fit, mixture = density_fit(
            robot,
            cover.link,
            ellipsoids.centres,
            0.5 * (covariances + covariances.transpose(0, 2, 1)),
            volumes / volumes.sum(),
            settings.seed,
        )
        levels = np.full(len(ellipsoids), SOLID_LEVEL * (1.0 + LEVEL_ROUNDING))
        results.append((fit, mixture, levels, cover))
    return tuple(results)


def density_fit(
    robot: Robot, link: str, means: Array, covariances: Array, weights: Array, seed: int
) -> tuple[LinkFit, Mixture]:
    """How well the density of one link's cover describes its surface, and the mixture: arrays as in `Mixture`."""
    points = sample_link(robot, link, count=NUM_SAMPLES, seed=seed)
    mixture = Mixture(weights, means, covariances, log_likelihood=0.0, converged=True)
    mixture = replace(mixture, log_likelihood=_log_likelihood(points, mixture))
    return assess(link, points, mixture, None), mixture


def _log_likelihood(points: Array, mixture: Mixture) -> float:
    exponents = -0.5 * mahalanobis_squared(points, mixture)
    norms = np.log(mixture.weights) - 0.5 * np.linalg.slogdet(2.0 * np.pi * mixture.covariances)[1]
    return float(logsumexp(exponents + norms, axis=1).mean())
