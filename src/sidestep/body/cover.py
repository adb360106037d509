"""Covers every link of a robot with ellipsoids and shares the ellipsoids among the links."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import logsumexp

from sidestep.body.cover_certificate import certify, complete
from sidestep.body.cover_overshoot import interior_coverage, overshoot, union_volume
from sidestep.body.cover_refine import OUTLINE, REPAIR, Ellipsoids, initial, refine
from sidestep.body.cover_surface import Array, LinkSurface
from sidestep.body.fitting import LinkFit, assess, mahalanobis_squared
from sidestep.body.mixture import Mixture
from sidestep.body.sampling import check_components, link_seed, links_with_geometry, sample_link

if TYPE_CHECKING:
    from sidestep.robot import Robot

MAX_COMPONENTS = 80
MAX_SHARE = (
    0.08  # of a link's size: the largest overshoot aimed at, 15 mm on an arm's links, 2 mm on a finger
)
MEAN_SHARE = 0.03  # of a link's size: the mean overshoot aimed at, 4 mm on an arm's links, 0.7 mm on a finger
FIXED_ALLOWANCE = (
    2.0  # links that no joint moves may overshoot by this factor more: only self-collision sees them
)
LOOKAHEAD = 3  # numbers tried ahead: one more ellipsoid can be useless where two more are not
GROWTH = 1.3  # numbers of ellipsoids tried on a link grow by this factor
CERTIFICATE_TOLERANCE = 1 / 400  # of a link's size: longest edge of a triangle that is not cut further
NUM_REPAIRS = 3  # rounds after the outline; each takes off a few per cent, later ones nothing
BARE_TOLERANCE = 1 / 150  # of a link's size: how finely bare spots are located for a repair
NUM_BARE = 600  # corners of bare triangles added per repair
TRIAL_DIRECTIONS = 400  # boundary points per ellipsoid while covers are compared
NUM_SAMPLES = 4000  # surface points that steer the refinement; coverage itself is proven without samples
SOLID_LEVEL = 5.0  # (y - mu)^T Sigma^-1 (y - mu) on the boundary of a solid ellipsoid of covariance Sigma
LEVEL_ROUNDING = 1e-9  # levels are larger by this share: rounding of the covariances cannot bare a corner

CoverProgress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class CoverSettings:
    """What a cover was asked for: equal settings on an equal robot give an equal body.

    Attributes:
        components: ellipsoids per link (a number, or {link: number}), or None to share `max_components`.
        max_components: ellipsoids in all, when they are shared.
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
        if self.components is None:
            if self.max_components < len(links):
                raise ValueError(
                    f"max_components is {self.max_components}, must be at least {len(links)}: "
                    f"robot '{robot.name}' has that many links with geometry"
                )
            return
        check_components(self.components, links)


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
        trade_off: what was tried on the way.
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
class _Solution:
    ellipsoids: Ellipsoids
    mean: float
    maximum: float


class _LinkProblem:
    """One link with the best cover known for every number of ellipsoids tried."""

    def __init__(self, triangles: Array, *, seed: int) -> None:
        self.surface = LinkSurface(triangles)
        self.seed = seed
        self.samples = self.surface.steering_points(NUM_SAMPLES, np.random.default_rng(seed))
        self.solutions: dict[int, _Solution] = {}

    def solve(self, number: int) -> _Solution:
        """The best cover found: an outline, then rounds that refine it where the proof found it bare."""
        if number in self.solutions:
            return self.solutions[number]
        rng = np.random.default_rng(self.seed)
        surface, samples = self.surface, self.samples
        tolerance = CERTIFICATE_TOLERANCE * surface.size
        outline = refine(surface, samples, initial(surface, samples, number, self.seed), OUTLINE)
        best: _Solution | None = None
        for repair in range(NUM_REPAIRS + 1):
            if repair > 0:
                bare = certify(surface.triangles, outline, tolerance=BARE_TOLERANCE * surface.size).remaining
                corners = bare.reshape(-1, 3)
                if len(corners) > NUM_BARE:
                    corners = corners[rng.choice(len(corners), NUM_BARE, replace=False)]
                samples = np.concatenate([samples, corners])
                outline = refine(surface, samples, outline, REPAIR)
            covering, _ = complete(
                surface.triangles, outline, tolerance=tolerance, points=surface.pieces.reshape(-1, 3)
            )
            measured = overshoot(surface, covering, directions=TRIAL_DIRECTIONS)
            solution = _Solution(covering, measured.mean, measured.maximum)
            if best is None or self._excess(solution) < self._excess(best):
                best = solution
        assert best is not None
        self.solutions[number] = best
        return best

    def excess(self, number: int) -> float:
        """Overshoot over what is aimed at: the mean of its two measures."""
        return self._excess(self.solve(number))

    def _excess(self, solution: _Solution) -> float:
        size = self.surface.size
        return 0.5 * (solution.maximum / (MAX_SHARE * size) + solution.mean / (MEAN_SHARE * size))

    def trade_off(self) -> tuple[TradeOff, ...]:
        return tuple(TradeOff(k, s.mean, s.maximum) for k, s in sorted(self.solutions.items()))


def cover_links(
    robot: Robot, settings: CoverSettings, progress: CoverProgress | None = None
) -> tuple[tuple[LinkCover, Ellipsoids], ...]:
    """Covers all links with geometry; shares the ellipsoids so that the worst link is as good as possible.

    Raises:
        ValueError: if the settings do not suit the robot.
    """
    settings.validate(robot)
    twins: dict[bytes, _LinkProblem] = {}
    problems: dict[str, _LinkProblem] = {}
    for link in links_with_geometry(robot):
        triangles = _triangles(robot, link)
        key = np.unique(triangles.reshape(-1, 3).round(9), axis=0).tobytes()  # fingers are often equal
        if key not in twins:
            twins[key] = _LinkProblem(triangles, seed=link_seed(link, seed=settings.seed))
        problems[link] = twins[key]
    moves = {frame.name: frame.joint >= 0 for frame in robot.frames}
    allowances = {link: 1.0 if moves[link] else FIXED_ALLOWANCE for link in problems}
    numbers = _numbers(problems, allowances, settings, progress)
    return tuple(_assess(robot, link, problem, numbers[link]) for link, problem in problems.items())


def _triangles(robot: Robot, link: str) -> Array:
    mesh = robot.collision_mesh(link)
    assert mesh is not None  # only links with geometry are asked for
    return np.asarray(mesh.triangles, dtype=np.float64)


def _numbers(
    problems: Mapping[str, _LinkProblem],
    allowances: Mapping[str, float],
    settings: CoverSettings,
    progress: CoverProgress | None,
) -> dict[str, int]:
    total = settings.max_components

    def report(link: str, done: int, of: int) -> None:
        if progress is not None:
            progress(link, done, of)

    if settings.components is not None:
        asked = settings.components
        numbers = {link: asked[link] if isinstance(asked, Mapping) else asked for link in problems}
        for done, link in enumerate(problems):
            report(link, done, len(problems))
            problems[link].solve(numbers[link])
        report(link, len(problems), len(problems))
        return numbers
    best = dict.fromkeys(problems, 1)
    while True:
        spare = total - sum(best.values())
        gains: list[tuple[float, str, int]] = []
        for link, problem in problems.items():
            now = problem.excess(best[link]) / allowances[link]
            if now <= 1.0:
                continue
            following = best[link]
            for _ in range(LOOKAHEAD):
                following = max(following + 1, round(GROWTH * following))
                if following - best[link] > spare:
                    break
                report(link, total - spare, total)
                gain = now**2 - (problem.excess(following) / allowances[link]) ** 2
                if gain > 0.0:
                    gains.append((gain / (following - best[link]), link, following))
        if not gains:
            break
        _, link, number = max(gains)
        best[link] = number
    report(link, total, total)
    return best


def _assess(robot: Robot, link: str, problem: _LinkProblem, number: int) -> tuple[LinkCover, Ellipsoids]:
    surface = problem.surface
    triangles = _triangles(robot, link)
    tolerance = CERTIFICATE_TOLERANCE * surface.size
    ellipsoids, certificate = complete(
        triangles, problem.solve(number).ellipsoids, tolerance=tolerance, points=triangles.reshape(-1, 3)
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
        points = sample_link(robot, cover.link, count=NUM_SAMPLES, seed=settings.seed)
        mixture = Mixture(
            weights=volumes / volumes.sum(),
            means=ellipsoids.centres,
            covariances=0.5 * (covariances + covariances.transpose(0, 2, 1)),
            log_likelihood=0.0,
            converged=True,
        )
        mixture = replace(mixture, log_likelihood=_log_likelihood(points, mixture))
        levels = np.full(len(ellipsoids), SOLID_LEVEL * (1.0 + LEVEL_ROUNDING))
        results.append((assess(cover.link, points, mixture, None), mixture, levels, cover))
    return tuple(results)


def _log_likelihood(points: Array, mixture: Mixture) -> float:
    exponents = -0.5 * mahalanobis_squared(points, mixture)
    norms = np.log(mixture.weights) - 0.5 * np.linalg.slogdet(2.0 * np.pi * mixture.covariances)[1]
    return float(logsumexp(exponents + norms, axis=1).mean())
