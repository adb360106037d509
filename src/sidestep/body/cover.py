"""Covers every link of a robot with ellipsoids and shares the ellipsoids among the links."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import logsumexp

from sidestep.body.cover_certificate import complete
from sidestep.body.cover_overshoot import interior_coverage, overshoot, union_volume
from sidestep.body.cover_problem import EFFORTS, LinkProblem
from sidestep.body.cover_refine import Ellipsoids
from sidestep.body.cover_settings import CoverSettings, LinkCover
from sidestep.body.cover_store import CoverStore
from sidestep.body.cover_surface import Array
from sidestep.body.fitting import LinkFit, assess, mahalanobis_squared
from sidestep.body.mixture import Mixture
from sidestep.body.sampling import links_with_geometry, sample_link
from sidestep.math.matrices import determinant, principal_axes, product

if TYPE_CHECKING:
    import trimesh

    from sidestep.robot import Robot

FIXED_ALLOWANCE = 2.0  # in the mean, its square beyond MAX_AIM, of links that only self-collision sees
LOOKAHEAD = 3  # numbers tried ahead: one more ellipsoid can be useless where two more are not
GROWTH = 1.3  # numbers of ellipsoids tried on a link grow by this factor
NUM_SAMPLES = 4000  # surface points by which the density of the cover is assessed
DRAFT_SAMPLES = 500  # the same of a draft
SOLID_LEVEL = 5.0  # (y - mu)^T Sigma^-1 (y - mu) on the boundary of a solid ellipsoid of covariance Sigma
LEVEL_ROUNDING = 1e-9  # levels are larger by this share: rounding of the covariances cannot bare a corner

DRAFT_COMPONENTS = 6  # ellipsoids of a link in a draft

CoverProgress = Callable[[str, int, int], None]


def cover_links(
    robot: Robot,
    settings: CoverSettings,
    progress: CoverProgress | None = None,
    *,
    cached: bool = False,
    only: Sequence[str] | None = None,
) -> tuple[tuple[LinkCover, Ellipsoids], ...]:
    """Covers links with geometry; shares the ellipsoids so that the worst link is as good as possible.

    The cover of a link depends on its surface, on the settings, and on whether it moves: of another robot with the same
    link it is taken from the user's cache.

    Args:
        only: these links; by default all.

    Raises:
        ValueError: if the settings do not suit the robot.
    """
    settings.validate(robot)
    moves = {frame.name: frame.joint >= 0 for frame in robot.frames}
    store = CoverStore(settings, enabled=cached)
    twins: dict[tuple[bytes, float], LinkProblem] = {}
    problems: dict[str, LinkProblem] = {}
    for link in links_with_geometry(robot) if only is None else only:
        allowance = 1.0 if moves[link] else FIXED_ALLOWANCE
        known = store.read(link, _mesh(robot, link), allowance)
        triangles = _triangles(robot, link)
        key = (np.unique(triangles.reshape(-1, 3).round(9), axis=0).tobytes(), allowance)
        if key not in twins:  # fingers are often equal
            twins[key] = LinkProblem(
                triangles,
                seed=settings.seed,
                allowance=allowance,
                effort=EFFORTS[settings.effort],
                known=known.trials,
            )
        problems[link] = twins[key]
    # Most of the work is NumPy's and the core's.
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as threads:
        try:
            numbers = _numbers(problems, settings, threads, progress)
            return _finished(robot, problems, numbers, store, threads, progress)
        except BaseException:
            threads.shutdown(wait=False, cancel_futures=True)
            raise


def _finished(
    robot: Robot,
    problems: Mapping[str, LinkProblem],
    numbers: Mapping[str, int],
    store: CoverStore,
    threads: ThreadPoolExecutor,
    progress: CoverProgress | None,
) -> tuple[tuple[LinkCover, Ellipsoids], ...]:
    """The covers with these numbers, each kept as soon as it is made."""
    total = sum(numbers.values())
    alike: dict[int, list[str]] = {}  # links that share a problem, one after the other
    for link, problem in problems.items():
        alike.setdefault(id(problem), []).append(link)

    def cover_alike(links: list[str]) -> list[tuple[LinkCover, Ellipsoids]]:
        return [store.stored_or_made(link, problems[link], numbers[link], made(link)) for link in links]

    def made(link: str) -> Callable[[], tuple[LinkCover, Ellipsoids]]:
        return lambda: _assess(robot, link, problems[link], numbers[link])

    found: dict[str, tuple[LinkCover, Ellipsoids]] = {}
    for covers in as_completed([threads.submit(cover_alike, links) for links in alike.values()]):
        for cover, ellipsoids in covers.result():
            found[cover.link] = cover, ellipsoids
            if progress is not None:
                done = sum(each.num_components for each, _ in found.values())
                progress(cover.link, total + done, 2 * total)
    return tuple(found[link] for link in problems)


def _mesh(robot: Robot, link: str) -> trimesh.Trimesh:
    mesh = robot.collision_mesh(link)
    assert mesh is not None  # only links with geometry are asked for
    return mesh


def _triangles(robot: Robot, link: str) -> Array:
    return np.asarray(_mesh(robot, link).triangles, dtype=np.float64)


def _numbers(
    problems: Mapping[str, LinkProblem],
    settings: CoverSettings,
    threads: ThreadPoolExecutor,
    progress: CoverProgress | None,
) -> dict[str, int]:
    asked = settings.components
    if isinstance(asked, int):
        asked = dict.fromkeys(problems, asked)
    elif settings.effort == "draft":
        asked = {**dict.fromkeys(problems, DRAFT_COMPONENTS), **(asked or {})}
    best = {link: 1 if asked is None else asked.get(link, 1) for link in problems}
    shared = [link for link in problems if asked is None or link not in asked]

    def looked_at(wanted: Mapping[str, Sequence[int]]) -> None:
        """Solves what is compared next, several links at once."""
        tries = {(id(problems[link]), number): link for link in wanted for number in wanted[link]}
        tries = {key: link for key, link in tries.items() if key[1] not in problems[link].trials}
        solving = {threads.submit(problems[link].excess, key[1]): link for key, link in tries.items()}
        for solved in as_completed(solving):
            solved.result()
            if progress is not None:
                progress(solving[solved], sum(best.values()), 2 * settings.max_components)

    while shared:
        spare = settings.max_components - sum(best.values())
        looked_at({link: [best[link]] for link in shared})
        poor = {link: excess for link in shared if (excess := problems[link].excess(best[link])) > 1.0}
        following = {link: _following(best[link], spare, problems[link].effort.most) for link in poor}
        looked_at(following)
        gains: list[tuple[float, str, int]] = []
        for link, now in poor.items():
            for number in following[link]:
                gain = now**2 - problems[link].excess(number) ** 2
                if gain > 0.0:
                    gains.append((gain / (number - best[link]), link, number))
        if not gains:
            break
        _, link, number = max(gains)
        best[link] = number
    return best


def _following(number: int, spare: int, most: int) -> list[int]:
    """The larger numbers of ellipsoids that a link is tried with next."""
    found: list[int] = []
    following = number
    for _ in range(LOOKAHEAD):
        following = max(following + 1, round(GROWTH * following))
        if following - number > spare or following > most:
            break
        found.append(following)
    return found


def _assess(robot: Robot, link: str, problem: LinkProblem, number: int) -> tuple[LinkCover, Ellipsoids]:
    surface = problem.surface
    triangles, mesh = _triangles(robot, link), _mesh(robot, link)
    solution = problem.finish(number)
    ellipsoids, coverage = solution.ellipsoids, 1.0
    if not np.array_equal(triangles, problem.triangles):  # of a twin, which is equal but for rounding
        tolerance = problem.effort.piece * surface.size
        ellipsoids, certificate = complete(
            triangles, ellipsoids, tolerance=tolerance, points=triangles.reshape(-1, 3)
        )
        if not certificate.complete:
            coverage = min(1.0, certificate.covered_area / certificate.total_area)
    directions = problem.effort.final_directions
    measured = overshoot(surface, ellipsoids, directions=directions) if directions else solution.measured
    closed = bool(mesh.is_watertight)
    volume = abs(float(mesh.volume if closed else mesh.convex_hull.volume))
    squares = [principal_axes(product(shape, shape.T))[0] for shape in ellipsoids.shapes]  # of the semi-axes
    cover = LinkCover(
        link=link,
        num_components=number,
        coverage=coverage,
        mean_overshoot=measured.mean,
        max_overshoot=measured.maximum,
        volume_ratio=union_volume(
            ellipsoids, np.random.default_rng(problem.seed), problem.effort.volume_samples
        )
        / volume,
        volume_of="mesh" if closed else "hull",
        interior_coverage=interior_coverage(surface, ellipsoids),
        slimness=float(min(np.sqrt(each[0] / each[2]) for each in squares)),
        trade_off=problem.trade_off(),
    )
    return cover, ellipsoids


def cover_mixtures(
    robot: Robot,
    settings: CoverSettings,
    progress: CoverProgress | None = None,
    *,
    cached: bool = False,
    only: Sequence[str] | None = None,
) -> tuple[tuple[LinkFit, Mixture, Array, LinkCover], ...]:
    """The covers of links as mixtures of solid ellipsoids, with the levels of their boundaries (K,)."""
    results = []
    for cover, ellipsoids in cover_links(robot, settings, progress, cached=cached, only=only):
        volumes = np.abs(determinant(ellipsoids.shapes))
        covariances = product(ellipsoids.shapes, ellipsoids.shapes.transpose(0, 2, 1)) / SOLID_LEVEL
        fit, mixture = density_fit(
            robot,
            cover.link,
            ellipsoids.centres,
            0.5 * (covariances + covariances.transpose(0, 2, 1)),
            volumes / volumes.sum(),
            settings.seed,
            samples=DRAFT_SAMPLES if settings.effort == "draft" else NUM_SAMPLES,
        )
        levels = np.full(len(ellipsoids), SOLID_LEVEL * (1.0 + LEVEL_ROUNDING))
        results.append((fit, mixture, levels, cover))
    return tuple(results)


def density_fit(
    robot: Robot,
    link: str,
    means: Array,
    covariances: Array,
    weights: Array,
    seed: int,
    *,
    samples: int = NUM_SAMPLES,
) -> tuple[LinkFit, Mixture]:
    """How well the density of one link's cover describes its surface, and the mixture: arrays as in `Mixture`."""
    points = sample_link(robot, link, count=samples, seed=seed)
    mixture = Mixture(weights, means, covariances, log_likelihood=0.0, converged=True)
    mixture = replace(mixture, log_likelihood=_log_likelihood(points, mixture))
    return assess(link, points, mixture, None), mixture


def _log_likelihood(points: Array, mixture: Mixture) -> float:
    exponents = -0.5 * mahalanobis_squared(points, mixture)
    norms = np.log(mixture.weights) - 0.5 * np.log(determinant(2.0 * np.pi * mixture.covariances))
    return float(logsumexp(exponents + norms, axis=1).mean())
