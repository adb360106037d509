"""What a cover looks like: a table of the links and two figures."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sidestep.body.body import Body
from sidestep.body.cover_overshoot import overshoot
from sidestep.body.cover_refine import Ellipsoids, sphere_directions
from sidestep.body.cover_surface import LinkSurface
from sidestep.body.report import CLOUD_COLOUR, DPI, PALETTE, _figure, _frame

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sidestep.robot import Robot


@dataclass(frozen=True)
class CoverRow:
    """One line of the table of a cover, in units a reader expects."""

    link: str
    num_components: int
    coverage_percent: float
    mean_overshoot_mm: float
    max_overshoot_mm: float
    volume_ratio: float
    volume_of: str
    interior_coverage_percent: float
    slimness: float


def cover_table(body: Body) -> tuple[CoverRow, ...]:
    """One row per link: ellipsoids, proven coverage, overshoot and volume over that of the mesh.

    Raises:
        ValueError: if the body was not made by `Body.cover`.
    """
    _check_cover(body)
    return tuple(
        CoverRow(
            link=cover.link,
            num_components=cover.num_components,
            coverage_percent=100.0 * cover.coverage,
            mean_overshoot_mm=1000.0 * cover.mean_overshoot,
            max_overshoot_mm=1000.0 * cover.max_overshoot,
            volume_ratio=cover.volume_ratio,
            volume_of=cover.volume_of,
            interior_coverage_percent=100.0 * cover.interior_coverage,
            slimness=cover.slimness,
        )
        for cover in body.link_covers
    )


def plot_cover(body: Body, robot: Robot, directory: str | Path) -> tuple[Path, ...]:
    """Draws the cover: cover_links.png (mesh and ellipsoids) and cover_overshoot.png; returns the files.

    Raises:
        ValueError: if the body was not made by `Body.cover` or belongs to another robot.
    """
    _check_cover(body)
    if body.fingerprint != robot.fingerprint:
        raise ValueError(f"body of robot '{body.robot_name}' cannot be drawn on robot '{robot.name}'")
    directory = Path(directory)
    directory.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, figure in (
        ("cover_links", _draw_links(body, robot)),
        ("cover_overshoot", _draw_overshoot(body, robot)),
    ):
        paths.append(directory / f"{name}.png")
        figure.savefig(paths[-1], dpi=DPI)
    return tuple(paths)


def ellipsoids_of(body: Body, link: str) -> Ellipsoids:
    """The solid ellipsoids of a link of a calibrated body, in the link frame.

    Raises:
        ValueError: if the body has no levels.
    """
    if body.levels is None:
        raise ValueError("the body is not calibrated (it has no levels); use Body.cover")
    own = np.asarray(body.links) == link
    return Ellipsoids(
        body.means[own], np.linalg.cholesky(body.covariances[own] * body.levels[own][:, None, None])
    )


def _draw_links(body: Body, robot: Robot) -> Figure:
    names = [cover.link for cover in body.link_covers]
    columns = min(4, len(names))
    rows = -(-len(names) // columns)
    figure = _figure(3.6 * columns, 3.6 * rows + 0.5)
    directions = sphere_directions(400)
    for index, cover in enumerate(body.link_covers):
        axes = figure.add_subplot(rows, columns, index + 1, projection="3d")
        mesh = robot.collision_mesh(cover.link)
        assert mesh is not None
        surface = mesh.sample(1500, seed=0)
        axes.scatter(*np.asarray(surface).T, s=2.0, color=CLOUD_COLOUR, linewidths=0, depthshade=False)
        ellipsoids = ellipsoids_of(body, cover.link)
        boundary, _ = ellipsoids.boundary(directions)
        for number, points in enumerate(boundary):
            axes.plot_trisurf(
                *points.T,
                triangles=_hull(points),
                color=PALETTE[number % len(PALETTE)],
                alpha=0.18,
                linewidth=0,
            )
        _frame(axes, np.concatenate([np.asarray(surface), boundary.reshape(-1, 3)]), unit="mm", zoom=0.82)
        axes.set_title(f"{cover.link}: {cover.num_components}", fontsize=10)
    figure.suptitle(
        f"{body.robot_name}: surface points and {body.num_components} covering ellipsoids, link frames"
    )
    return figure


def _draw_overshoot(body: Body, robot: Robot) -> Figure:
    figure = _figure(11.0, 4.4)
    left, right = figure.add_subplot(1, 2, 1), figure.add_subplot(1, 2, 2)
    styles = ("-", "--", ":")
    for index, cover in enumerate(body.link_covers):
        mesh = robot.collision_mesh(cover.link)
        assert mesh is not None
        measured = overshoot(LinkSurface(np.asarray(mesh.triangles)), ellipsoids_of(body, cover.link))
        order = measured.distances.argsort()
        share = np.cumsum(measured.areas[order]) / measured.areas.sum()
        style: dict[str, Any] = {
            "color": PALETTE[index % len(PALETTE)],
            "linestyle": styles[index // len(PALETTE) % 3],
        }
        left.plot(1000.0 * measured.distances[order], 100.0 * share, label=cover.link, **style)
        tried = [(point.num_components, 1000.0 * point.mean_overshoot) for point in cover.trade_off]
        if tried:
            right.plot(*zip(*tried, strict=True), marker="o", markersize=3, **style)
    left.set(xlabel="overshoot [mm]", ylabel="share of the union's boundary at most [%]", xlim=(0, None))
    right.set(xlabel="ellipsoids on the link", ylabel="mean overshoot [mm]", xlim=(0, None), ylim=(0, None))
    left.legend(fontsize=7)
    for axes in (left, right):
        axes.grid(alpha=0.3)
    return figure


def _hull(points: np.ndarray) -> np.ndarray:
    from scipy.spatial import ConvexHull

    return np.asarray(ConvexHull(points).simplices)


def _check_cover(body: Body) -> None:
    if not body.link_covers:
        raise ValueError("this body was not made by Body.cover and carries no cover to report")
