"""Covers every link of a robot with ellipsoids and shares the ellipsoids among the links."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import logsumexp

from sidestep.body.cover_certificate import complete
from sidestep.body.cover_overshoot import interior_coverage, overshoot, union_volume
from sidestep.body.cover_refine import Ellipsoids, RefineSettings, initial, refine
from sidestep.body.cover_surface import Array, LinkSurface
from sidestep.body.fitting import LinkFit, assess, mahalanobis_squared
from sidestep.body.mixture import Mixture
from sidestep.body.sampling import link_seed, links_with_geometry, sample_link

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
GROWTH = 1.25  # numbers of ellipsoids tried on a link grow by this factor
CERTIFICATE_TOLERANCE = 1 / 400  # of a link's size: longest edge of a triangle that is not cut further
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
        if isinstance(self.components, Mapping):
            unknown = sorted(set(self.components) - set(links))
            absent = [link for link in links if link not in self.components]
            if unknown or absent:
                fault = f"names unknown links {unknown}" if unknown else f"has no number for links {absent}"
                raise ValueError(f"components {fault}; the links with geometry are {', '.join(links)}")
        for link in links:
            number = self.components[link] if isinstance(self.components, Mapping) else self.components
            if isinstance(number, bool) or not isinstance(number, int) or number < 1:
                raise ValueError(
                    f"components of link '{link}' is {number!r}, must be a whole number of at least 1"
                )


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
    coverage: float


class _LinkProblem:
    """One link with the best cover known for every number of ellipsoids tried."""

    def __init__(self, triangles: Array, *, allowance: float, seed: int) -> None:
        self.surface = LinkSurface(triangles)
        self.allowance = allowance
        self.seed = seed
        self.samples = _steering_samples(self.surface, np.random.default_rng(seed))
        self.solutions: dict[int, _Solution] = {}

    def solve(self, number: int) -> _Solution:
        if number not in self.solutions:
            start = initial(self.surface, self.samples, number, self.seed)
            refined = refine(self.surface, self.samples, start, RefineSettings())
            tolerance = CERTIFICATE_TOLERANCE * self.surface.size
            ellipsoids, certificate = complete(
                self.surface.triangles,
                refined,
                tolerance=tolerance,
                points=self.surface.pieces.reshape(-1, 3),
            )
            measured = overshoot(self.surface, ellipsoids)
            share = certificate.covered_area / certificate.total_area
            self.solutions[number] = _Solution(ellipsoids, measured.mean, measured.maximum, min(share, 1.0))
        return self.solutions[number]

    def excess(self, number: int) -> float:
        """Overshoot over what is aimed at: the mean of its two measures."""
        solution = self.solve(number)
        scale = self.allowance * self.surface.size
        return 0.5 * (solution.maximum / (MAX_SHARE * scale) + solution.mean / (MEAN_SHARE * scale))

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
    joint_of = {frame.name: frame.joint for frame in robot.frames}
    problems: dict[str, _LinkProblem] = {}
    for link in links_with_geometry(robot):
        mesh = robot.collision_mesh(link)
        assert mesh is not None
        problems[link] = _LinkProblem(
            np.asarray(mesh.triangles, dtype=np.float64),
            allowance=FIXED_ALLOWANCE if joint_of[link] < 0 else 1.0,
            seed=link_seed(link, seed=settings.seed),
        )
    numbers = _numbers(problems, settings, progress)
    return tuple(
        (_assess(robot, link, problem, numbers[link]), problem.solve(numbers[link]).ellipsoids)
        for link, problem in problems.items()
    )


def _numbers(
    problems: Mapping[str, _LinkProblem], settings: CoverSettings, progress: CoverProgress | None
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
    reached = dict(best)  # largest number tried: more are not always better, as the refinement is local
    while True:
        spare = total - sum(best.values())
        gains = {}
        for link, problem in problems.items():
            if problem.excess(best[link]) <= 1.0:
                continue
            following = max(best[link] + 1, reached[link])
            while following - best[link] <= spare:
                report(link, total - spare, total)
                reached[link] = following
                gain = problem.excess(best[link]) ** 2 - problem.excess(following) ** 2
                if gain > 0.0:
                    gains[link] = (gain / (following - best[link]), following)
                    break
                following = max(following + 1, round(GROWTH * following))
        if not gains:
            break
        link = max(gains, key=lambda name: gains[name][0])
        best[link] = gains[link][1]
    report(link, total, total)
    return best


def _assess(robot: Robot, link: str, problem: _LinkProblem, number: int) -> LinkCover:
    solution = problem.solve(number)
    mesh = robot.collision_mesh(link)
    assert mesh is not None
    closed = bool(mesh.is_watertight)
    volume = abs(float(mesh.volume if closed else mesh.convex_hull.volume))
    axes = np.linalg.svd(solution.ellipsoids.shapes, compute_uv=False)
    return LinkCover(
        link=link,
        num_components=number,
        coverage=solution.coverage,
        mean_overshoot=solution.mean,
        max_overshoot=solution.maximum,
        volume_ratio=union_volume(solution.ellipsoids, np.random.default_rng(problem.seed)) / volume,
        volume_of="mesh" if closed else "hull",
        interior_coverage=interior_coverage(problem.surface, solution.ellipsoids),
        slimness=float((axes[:, 2] / axes[:, 0]).min()),
        trade_off=problem.trade_off(),
    )


def _steering_samples(surface: LinkSurface, rng: np.random.Generator) -> Array:
    corners = np.unique(surface.triangles.reshape(-1, 3).round(9), axis=0)
    if len(corners) > NUM_SAMPLES // 3:
        corners = corners[rng.choice(len(corners), NUM_SAMPLES // 3, replace=False)]
    return np.concatenate([corners, surface.sample(NUM_SAMPLES - len(corners), rng)])


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
