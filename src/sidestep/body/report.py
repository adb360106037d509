"""What a fit looks like: a table of the links and three figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sidestep.body.body import Body
from sidestep.body.fitting import ELLIPSOID_STD, LinkFit
from sidestep.body.sampling import sample_link
from sidestep.drawing.palette import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION
from sidestep.math.pose import moved

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.axes3d import Axes3D

    from sidestep.robot import Robot

PALETTE = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY)  # of ellipsoids side by side
CLOUD_COLOUR = "#555555"
POINTS_DRAWN = 600  # per link: enough to see the surface through the ellipsoids
DPI = 130


@dataclass(frozen=True)
class FitRow:
    """One line of the table of a fit, in units a reader expects."""

    link: str
    num_components: int
    log_likelihood: float
    coverage_percent: float
    mean_distance_mm: float
    converged: bool


def fit_table(body: Body) -> tuple[FitRow, ...]:
    """One row per link: components, log-likelihood, coverage and distance to the means.

    Raises:
        ValueError: if the body was made by hand and so carries no fit.
    """
    _check_fitted(body)
    return tuple(
        FitRow(
            link=fit.link,
            num_components=fit.num_components,
            log_likelihood=fit.log_likelihood,
            coverage_percent=100.0 * fit.coverage,
            mean_distance_mm=1000.0 * fit.mean_distance,
            converged=fit.converged,
        )
        for fit in body.link_fits
    )


def plot_fit(body: Body, robot: Robot, directory: str | Path) -> tuple[Path, ...]:
    """Draws the fit: links.png, arm.png and, if AIC or BIC chose the components, criterion.png.

    Args:
        body: a fitted body of this robot.
        robot: the robot.
        directory: folder for the figures; made if absent.

    Returns:
        The files written.

    Raises:
        ValueError: if the body was made by hand or belongs to another robot.

    Source: Bosc, figures 3.1 to 3.3.
    """
    _check_fitted(body)
    if body.fingerprint != robot.fingerprint:
        raise ValueError(f"body of robot '{body.robot_name}' cannot be drawn on robot '{robot.name}'")
    figures = {"links": draw_links(body, robot), "arm": draw_arm(body, robot)}
    curves = [fit for fit in body.link_fits if fit.curve is not None]
    if curves:
        figures["criterion"] = draw_criterion(
            curves, chosen_by=str(body.settings and body.settings.components)
        )
    directory = Path(directory)
    directory.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, figure in figures.items():
        path = directory / f"{name}.png"
        figure.savefig(path, dpi=DPI)
        paths.append(path)
    return tuple(paths)


def draw_links(body: Body, robot: Robot) -> Figure:
    """Every link in its own frame: the sampled surface and the 2-sigma ellipsoids."""
    names = [fit.link for fit in body.link_fits]
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    figure = _figure(4.0 * columns, 3.9 * rows + 0.5)
    for index, name in enumerate(names):
        axes: Axes3D = figure.add_subplot(rows, columns, index + 1, projection="3d")
        points = _drawn_points(body, robot, name)
        axes.scatter(*points.T, s=3.0, color=CLOUD_COLOUR, alpha=0.8, linewidths=0, depthshade=False)
        reached = [points, *draw_ellipsoids(axes, body, name)]
        _frame(axes, np.concatenate(reached), unit="mm", zoom=0.8)  # room for the labels
        axes.set_title(f"{name}: {body.links.count(name)} components", fontsize=10)
    figure.suptitle(f"{body.robot_name}: surface samples and {ELLIPSOID_STD:g}-sigma ellipsoids, link frames")
    return figure


def draw_arm(body: Body, robot: Robot, q: ArrayLike | None = None) -> Figure:
    """The arm at q (nv,), neutral by default, in the world frame: at an angle, and from the side."""
    configuration = robot.neutral if q is None else robot.check_configuration(q)
    figure = _figure(11.0, 5.8)
    for index, (elevation, azimuth, projection) in enumerate(((20.0, -55.0, "persp"), (0.0, -90.0, "ortho"))):
        axes: Axes3D = figure.add_subplot(1, 2, index + 1, projection="3d", proj_type=projection)
        reached = []
        for number, name in enumerate(fit.link for fit in body.link_fits):
            pose = robot.pose(configuration, name)
            colour = PALETTE[number % len(PALETTE)]
            points = moved(_drawn_points(body, robot, name), pose)
            axes.scatter(*points.T, s=1.5, color=CLOUD_COLOUR, alpha=0.6, linewidths=0, depthshade=False)
            reached += [points, *draw_ellipsoids(axes, body, name, pose=pose, colours=(colour,))]
        _frame(axes, np.concatenate(reached), unit="m", zoom=0.88)  # beyond it wide arms are cut off
        axes.view_init(elev=elevation, azim=azimuth)
        if projection == "ortho":  # seen along y, whose ticks would all fall on one spot
            axes.set_yticks([])
            axes.set_ylabel("")
    figure.suptitle(
        f"{body.robot_name}: {body.num_components} Gaussians at {ELLIPSOID_STD:g} sigma, one colour per link"
    )
    return figure


def draw_criterion(fits: Sequence[LinkFit], *, chosen_by: str) -> Figure:
    """AIC and BIC of every link against its number of components, the lowest of each marked."""
    columns = min(3, len(fits))
    rows = -(-len(fits) // columns)
    figure = _figure(4.0 * columns, 2.9 * rows + 0.5)
    for index, fit in enumerate(fits):
        axes = figure.add_subplot(rows, columns, index + 1)
        if fit.curve is None:
            raise ValueError(f"link '{fit.link}' has no criterion curve")
        for name, values, colour, marker in (
            ("AIC", fit.curve.aic, PALETTE[0], "o"),
            ("BIC", fit.curve.bic, PALETTE[1], "s"),
        ):
            axes.plot(fit.curve.components, values, color=colour, marker=marker, markersize=3.5, label=name)
            best = int(np.argmin(values))
            axes.plot(
                fit.curve.components[best],
                values[best],
                marker,
                color=colour,
                markersize=10,
                fillstyle="none",
            )
        axes.set_title(f"{fit.link}: {fit.num_components} chosen", fontsize=10)
        axes.set_xticks(fit.curve.components)
        axes.set_xlabel("components")
        axes.set_ylabel("criterion, mean of the folds")
        axes.grid(alpha=0.3)
    figure.axes[0].legend(title="lowest framed", fontsize=8, title_fontsize=8)
    figure.suptitle(
        f"Held-out AIC and BIC, 10-fold cross-validation; components chosen by {chosen_by.upper()}"
    )
    return figure


def draw_ellipsoids(
    axes: Axes3D,
    body: Body,
    link: str,
    *,
    pose: NDArray[np.float64] | None = None,
    colours: Sequence[str] = PALETTE,
) -> list[NDArray[np.float64]]:
    """Draws the 2-sigma ellipsoids of a link, at a pose (4, 4) or in its own frame; returns their points."""
    X = np.eye(4) if pose is None else pose
    longitude, latitude = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 25), np.linspace(0.0, np.pi, 13))
    sphere = np.stack(
        [np.cos(longitude) * np.sin(latitude), np.sin(longitude) * np.sin(latitude), np.cos(latitude)]
    )
    drawn = []
    own = [k for k, owner in enumerate(body.links) if owner == link]
    for number, k in enumerate(own):
        root = np.linalg.cholesky(body.covariances[k])
        local = ELLIPSOID_STD * np.tensordot(root, sphere, axes=1) + body.means[k][:, None, None]
        world = np.tensordot(X[:3, :3], local, axes=1) + X[:3, 3][:, None, None]
        axes.plot_surface(*world, color=colours[number % len(colours)], alpha=0.22, linewidth=0, shade=True)
        drawn.append(world.reshape(3, -1).T)
    return drawn


def _drawn_points(body: Body, robot: Robot, link: str) -> NDArray[np.float64]:
    seed = body.settings.seed if body.settings is not None else 0
    return sample_link(robot, link, count=POINTS_DRAWN, seed=seed)


def _figure(width: float, height: float) -> Figure:
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # here: only reports need matplotlib
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)  # no display and no global state of pyplot is touched
    return figure


def _frame(axes: Axes3D, points: NDArray[np.float64], *, unit: str, zoom: float) -> None:
    """Equal scale on all axes, few ticks, labels with the unit; the data stay in metres."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.02 * float((high - low).max())
    axes.set(
        xlim=(low[0] - margin, high[0] + margin),
        ylim=(low[1] - margin, high[1] + margin),
        zlim=(low[2] - margin, high[2] + margin),
    )
    axes.set_box_aspect(high - low + 2.0 * margin, zoom=zoom)
    for axis, name in ((axes.xaxis, "x"), (axes.yaxis, "y"), (axes.zaxis, "z")):
        axis.set_major_locator(_few_ticks())
        if unit == "mm":
            axis.set_major_formatter(lambda value, _: f"{1000.0 * value:.0f}")
        axis.set_label_text(f"{name} [{unit}]", fontsize=8)
        axis.set_tick_params(labelsize=7)


def _few_ticks() -> object:
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(nbins=4)


def _check_fitted(body: Body) -> None:
    if not body.link_fits:
        raise ValueError("this body was made by hand and carries no fit to report")
