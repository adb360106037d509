"""Figures 3.1 to 3.5: links as point clouds and Gaussian mixtures."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from sidestep import Body, Obstacles, Robot
from sidestep.body.sampling import sample_link
from sidestep.body.selection import criterion_curve
from sidestep.drawing import style
from sidestep.thesis import CollisionDensity
from sidestep.thesis.reproduce.item import Array, Caption, Figure, Item
from sidestep.thesis.reproduce.registry import Settings

ROBOT = "fr3_arm"
COMPONENTS = 4
DEVIATIONS = 2.0  # at which an ellipsoid is drawn
POSE = np.deg2rad([0.0, 45.0, 0.0, -66.0, 0.0, 66.0, 45.0])  # start of section 6.2.2
OBSTACLE = np.array([0.55, 0.2, 0.75])  # [m]


def link_names(robot: Robot) -> list[str]:
    """Links with geometry that a joint moves: the seven of the arm."""
    moved = {frame.name for frame in robot.frames if frame.joint >= 0}
    return [link.name for link in robot.links if link.name in moved and robot.collision_mesh(link.name)]


def point_clouds(settings: Settings) -> Iterator[Item]:
    """The fifth link: its surface and the points drawn on it."""
    robot = Robot.named(ROBOT)
    name = link_names(robot)[4]
    mesh = robot.collision_mesh(name)
    assert mesh is not None
    points = sample_link(robot, name, count=2000, seed=settings.seed)
    figure = style.new_figure(7.2)
    left: Any = figure.add_subplot(1, 2, 1, projection="3d")
    right: Any = figure.add_subplot(1, 2, 2, projection="3d")
    left.plot_trisurf(
        *mesh.vertices.T, triangles=mesh.faces, color="0.75", edgecolor="none", shade=True, antialiased=False
    )
    right.scatter(*points.T, s=1.5, color=style.BLUE, linewidths=0, depthshade=False)
    left.set_title(f"(a) surface, {len(mesh.faces):,} triangles")
    right.set_title(f"(b) {len(points)} points")
    for ax in (left, right):
        _equal(ax, points)
    yield Figure(
        key="3.1",
        title="The point cloud of link 5",
        caption=Caption(
            shows="The collision mesh of link 5 in its own frame, and points drawn uniformly over its area.",
            answers="Figure 3.1.",
            parameters=f"Franka Research 3, {name}, {len(points)} points, seed {settings.seed}.",
            differs="The thesis shows a denser cloud and does not state how it is drawn.",
        ),
        drawing=figure,
        data={"points_m": points},
    )


def criteria(settings: Settings) -> Iterator[Item]:
    """AIC and BIC over the number of Gaussians."""
    robot = Robot.named(ROBOT)
    names = link_names(robot)
    most, count = (4, 400) if settings.quick else (15, 1500)
    figure = style.new_figure(6.4)
    data: dict[str, Any] = {}
    best = []
    for ax, number in zip(figure.subplots(1, 2), (1, 6), strict=True):
        settings.notify(f"3.2 link {number}")
        points = sample_link(robot, names[number - 1], count=count, seed=settings.seed)
        curve = criterion_curve(points, max_components=most, seed=settings.seed)
        ax.plot(curve.components, curve.aic, "o-", markersize=3, color=style.BLUE, label="AIC")
        ax.plot(curve.components, curve.bic, "s-", markersize=3, color=style.ORANGE, label="BIC")
        for values, color, marker in ((curve.aic, style.BLUE, "o"), (curve.bic, style.ORANGE, "s")):
            low = int(np.argmin(values))
            ax.plot(curve.components[low], values[low], marker, color=color, markersize=9, fillstyle="none")
        ax.set(xlabel="Gaussians", ylabel="criterion, mean of 10 folds [-]", title=f"link {number}")
        ax.legend(title="lowest framed", title_fontsize=6)
        best.append((number, curve.best("aic"), curve.best("bic")))
        data["components"] = curve.components
        data[f"aic_link{number}"], data[f"bic_link{number}"] = curve.aic, curve.bic
    words = ". ".join(f"Link {n}: AIC takes {a}, BIC {b}" for n, a, b in best)
    yield Figure(
        key="3.2",
        title="How many Gaussians: AIC and BIC",
        caption=Caption(
            shows=f"Both criteria on the points held out of each fold. {words}.",
            answers="Figure 3.2.",
            parameters=f"{count} points a link, full covariances, 1 to {most} Gaussians, 10-fold "
            f"cross-validation, seed {settings.seed}.",
            differs="The thesis's curves fall to the end of their range, 15, and lie on each other. It does "
            "not say on which points they are evaluated. On held-out points the penalty weighs more: the "
            "two part, and each has a lowest point inside the range.",
        ),
        drawing=figure,
        data=data,
    )


def mixture(settings: Settings) -> Iterator[Item]:
    """The Gaussians of every link."""
    robot = Robot.named(ROBOT)
    body = Body.fit(robot, components=COMPONENTS, seed=settings.seed)
    figure = style.new_figure(16.0)
    names = link_names(robot)
    for index, name in enumerate(names):
        ax: Any = figure.add_subplot(3, 3, index + 1 if index < 6 else 8, projection="3d")
        points = sample_link(robot, name, count=700, seed=settings.seed)
        ax.scatter(*points.T, s=0.8, color="0.55", linewidths=0, depthshade=False)
        _ellipsoids(ax, body, name, np.eye(4))
        _equal(ax, points, zoom=0.6)
        ax.set_title(f"link {index + 1}", y=0.98)
    yield Figure(
        key="3.3",
        title="The mixture on the arm",
        caption=Caption(
            shows=f"Surface points of each link and the ellipsoids of its Gaussians at {DEVIATIONS:g} "
            "standard deviations, in the frame of the link.",
            answers="Figure 3.3.",
            parameters=f"{COMPONENTS} Gaussians a link, full covariances, EM on 2000 points a link, seed "
            f"{settings.seed}.",
            differs="The thesis states neither the numbers of Gaussians nor the size of the ellipsoids.",
        ),
        drawing=figure,
        data={"weights": body.weights, "means_m": body.means, "covariances_m2": body.covariances},
    )


def task_space(settings: Settings) -> Iterator[Item]:
    """The arm as coloured point clouds, and one obstacle."""
    robot = Robot.named(ROBOT)
    body = Body.fit(robot, components=COMPONENTS, seed=settings.seed)
    value = CollisionDensity(robot, body).evaluate(POSE, np.zeros(7), Obstacles(OBSTACLE[None])).values[0]
    figure = style.new_figure(7.5)
    ax: Any = figure.add_subplot(projection="3d")
    everything = []
    for index, name in enumerate(link_names(robot)):
        X = robot.pose(POSE, name)
        points = sample_link(robot, name, count=500, seed=settings.seed) @ X[:3, :3].T + X[:3, 3]
        ax.scatter(
            *points.T,
            s=1.5,
            color=style.JOINT_COLOURS[index],
            linewidths=0,
            depthshade=False,
            label=f"link {index + 1}",
        )
        everything.append(points)
    style.mark_obstacle(ax, *OBSTACLE, label="")
    ax.text(OBSTACLE[0] + 0.05, OBSTACLE[1], OBSTACLE[2], "obstacle", fontsize=7, va="center")
    _equal(ax, np.concatenate([*everything, OBSTACLE[None]]), unit="m", zoom=1.0)
    figure.legend(*ax.get_legend_handles_labels(), loc="outside right center", markerscale=3)
    ax.view_init(elev=16, azim=-60)
    yield Figure(
        key="3.4",
        title="The arm and an obstacle in the task space",
        caption=Caption(
            shows=f"One point cloud per link, and the obstacle as one point, where ψ = {value:.3g} /m³.",
            answers="Figure 3.4.",
            parameters="q = (0, 45, 0, -66, 0, 66, 45)°, obstacle (0.55, 0.2, 0.75) m, "
            f"{COMPONENTS} Gaussians a link.",
            differs="The thesis does not state configuration and obstacle.",
        ),
        drawing=figure,
        data={"q_rad": POSE, "obstacle_m": OBSTACLE, "psi_per_m3": np.array([value])},
    )


def gaussian_motion(settings: Settings) -> Iterator[Item]:
    """Means travel, covariances turn."""
    robot = Robot.named(ROBOT)
    body = Body.fit(robot, components=1, seed=settings.seed)
    names = link_names(robot)
    name = names[4]
    k = body.links.index(name)
    angles = np.deg2rad([-90.0, -60.0, -30.0])
    figure = style.new_figure(6.4)
    means, spreads = [], []
    axes: list[Any] = [figure.add_subplot(1, 2, i, projection="3d") for i in (1, 2)]
    base = []
    for other in names[:3]:
        X = robot.pose(POSE, other)
        base.append(sample_link(robot, other, count=350, seed=settings.seed) @ X[:3, :3].T + X[:3, 3])
    for ax in axes:
        ax.scatter(*np.concatenate(base).T, s=0.8, color="0.6", linewidths=0, depthshade=False)
    clouds = []
    for angle, color in zip(angles, (style.BLUE, style.ORANGE, style.GREEN), strict=True):
        q = POSE.copy()
        q[3] = angle
        X = robot.pose(q, name)
        cloud = sample_link(robot, name, count=350, seed=settings.seed) @ X[:3, :3].T + X[:3, 3]
        clouds.append(cloud)
        mean = X[:3, :3] @ body.means[k] + X[:3, 3]
        means.append(mean)
        spreads.append(X[:3, :3] @ body.covariances[k] @ X[:3, :3].T)
        axes[0].scatter(*cloud.T, s=0.8, color=color, linewidths=0, depthshade=False, alpha=0.5)
        axes[0].plot(*mean[:, None], "o", color=color, markeredgecolor="k", markersize=6, zorder=9)
        _ellipsoids(axes[1], body, name, X, colours=(color,))
        label = f"q₄ = {np.rad2deg(angle):.0f}°"
        axes[1].plot([], [], "o", color=color, label=label)
    arc = []
    for angle in np.linspace(angles[0], angles[-1], 40):
        q = POSE.copy()
        q[3] = angle
        X = robot.pose(q, name)
        arc.append(X[:3, :3] @ body.means[k] + X[:3, 3])
    axes[0].plot(*np.array(arc).T, color=style.BLACK, linewidth=0.9, zorder=8)
    everything = np.concatenate([*base, *clouds])
    for ax, title in zip(axes, ("(a) means", "(b) covariances"), strict=True):
        _equal(ax, everything, unit="m", zoom=1.0)
        ax.set(yticks=[], ylabel="")
        ax.view_init(elev=0, azim=-90)
        ax.set_title(title)
    axes[1].legend(loc="upper left")
    values = np.array([np.linalg.eigvalsh(spread) for spread in spreads])
    drift = float(np.abs(values / values[0] - 1.0).max())
    yield Figure(
        key="3.5",
        title="How a Gaussian moves with the joints",
        caption=Caption(
            shows="The one Gaussian of link 5 for three angles of joint 4: its mean travels on an arc, its "
            f"covariance turns and keeps its eigenvalues (to {drift:.0e}).",
            answers="Figure 3.5.",
            parameters="Other joints at (0, 45, 0, ·, 0, 66, 45)°; ellipsoids at 2 standard deviations.",
            differs="Same picture. Because eigenvalues stay, nothing needs to be turned: moving the obstacle "
            "point into the frame of the link gives the same density with constant covariances.",
        ),
        drawing=figure,
        data={"q4_rad": angles, "mean_m": np.array(means), "eigenvalues_m2": values},
    )


def _ellipsoids(
    ax: Any,
    body: Body,
    link: str,
    pose: Array,
    *,
    colours: tuple[str, ...] = (style.BLUE, style.ORANGE, style.GREEN, style.VERMILLION),
) -> None:
    longitude, latitude = np.meshgrid(np.linspace(0, 2 * np.pi, 25), np.linspace(0, np.pi, 13))
    sphere = np.stack(
        [np.cos(longitude) * np.sin(latitude), np.sin(longitude) * np.sin(latitude), np.cos(latitude)]
    )
    own = [k for k, owner in enumerate(body.links) if owner == link]
    for number, k in enumerate(own):
        root = np.linalg.cholesky(body.covariances[k])
        local = DEVIATIONS * np.tensordot(root, sphere, axes=1) + body.means[k][:, None, None]
        world = np.tensordot(pose[:3, :3], local, axes=1) + pose[:3, 3][:, None, None]
        ax.plot_surface(*world, color=colours[number % len(colours)], alpha=0.4, linewidth=0)


def _equal(ax: Any, points: Array, *, unit: str = "mm", zoom: float = 0.68) -> None:
    """Equal scales, few ticks, labels with the unit; the data stay in metres."""
    low, high = points.min(axis=0), points.max(axis=0)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    ax.set_box_aspect(high - low, zoom=zoom)
    from matplotlib.ticker import MaxNLocator

    for axis, name in ((ax.xaxis, "x"), (ax.yaxis, "y"), (ax.zaxis, "z")):
        axis.set_major_locator(MaxNLocator(nbins=3))
        if unit == "mm":
            axis.set_major_formatter(lambda value, _: f"{1000.0 * value:.0f}")
        axis.set_label_text(f"{name} [{unit}]", fontsize=7)
        axis.set_tick_params(labelsize=6, pad=-2)
        axis.labelpad = -3
    # At the near corner the numbers of y would meet those of x.
    ticks = MaxNLocator(nbins=3).tick_values(low[1], high[1])
    ax.set_yticks([y for y in ticks if low[1] + 0.2 * (high[1] - low[1]) < y <= high[1]])
    ax.yaxis.labelpad = 1
    # The numbers of z stand beside the axis, not on it; in a narrow box pads are seen shortened.
    x_extent, _, z_extent = high - low
    ax.zaxis.set_tick_params(pad=8 if x_extent < 0.75 * z_extent else 4)
    ax.zaxis.labelpad = 17 if x_extent < 0.75 * z_extent else 5
