"""Figures 2.1 and 3.7: a plane and a sphere, and the joint space of a two-joint arm as a surface."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from sidestep.drawing import style
from sidestep.thesis import geodesic_acceleration
from sidestep.thesis.reproduce import planar
from sidestep.thesis.reproduce.item import Array, Caption, Figure, Item
from sidestep.thesis.reproduce.registry import Settings


def plane_and_sphere(_: Settings) -> Iterator[Item]:
    """Shortest lines on a flat and on a curved surface."""
    P, Q = np.array([-0.55, 0.15]), np.array([0.35, 0.65])
    p, q = np.append(P, np.sqrt(1 - P @ P)), np.append(Q, np.sqrt(1 - Q @ Q))
    angle = float(np.arccos(p @ q))
    tangent = (q - np.cos(angle) * p) / np.sin(angle)
    path = graph_geodesic(P, tangent[:2], angle)
    exact = np.cos(np.linspace(0, angle, len(path)))[:, None] * p
    exact = exact + np.sin(np.linspace(0, angle, len(path)))[:, None] * tangent
    lifted = np.column_stack([path, np.sqrt(1.0 - np.sum(path**2, axis=1))])
    error = float(np.linalg.norm(lifted - exact, axis=1).max())
    flat = float(np.linalg.norm(Q - P))

    figure = style.new_figure(6.8)
    left: Any = figure.add_subplot(1, 2, 1, projection="3d", computed_zorder=False)
    right: Any = figure.add_subplot(1, 2, 2, projection="3d", computed_zorder=False)
    x, y = np.meshgrid([-1.0, 1.0], [-1.0, 1.0])
    left.plot_surface(x, y, 0 * x, color=style.SKY, alpha=0.35, linewidth=0)
    left.plot(*np.array([[*P, 0], [*Q, 0]]).T, color=style.VERMILLION, zorder=5)
    left.set_title(f"(a) plane: length {flat:.3f}")
    longitude, latitude = np.meshgrid(np.linspace(0, 2 * np.pi, 49), np.linspace(0, np.pi, 25))
    sphere = (
        np.cos(longitude) * np.sin(latitude),
        np.sin(longitude) * np.sin(latitude),
        np.cos(latitude),
    )
    right.plot_surface(*sphere, color=style.SKY, alpha=0.3, linewidth=0)
    right.plot(*lifted.T, color=style.VERMILLION, zorder=5, label=f"geodesic, {angle:.3f}")
    right.plot(
        *np.array([p, q]).T,
        "--",
        color=style.BLACK,
        linewidth=0.9,
        zorder=5,
        label=f"chord, {np.linalg.norm(q - p):.3f}",
    )
    right.set_title("(b) unit sphere")
    right.legend(loc="upper right", fontsize=6)
    for ax, a, b in ((left, [*P, 0], [*Q, 0]), (right, p, q)):
        for point, name in ((a, "P"), (b, "Q")):
            ax.plot(*np.array(point)[:, None], "o", color=style.BLACK, markersize=3, zorder=6)
            ax.text(*(np.array(point) + 0.07), name, zorder=7)
        ax.set(
            xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1), xticks=[-1, 0, 1], yticks=[-1, 0, 1], zticks=[-1, 0, 1]
        )
        ax.set(xlabel="x [-]", ylabel="y [-]", zlabel="z [-]")
        ax.set_box_aspect((1, 1, 1), zoom=0.78)
        ax.view_init(elev=28, azim=-60)
    yield Figure(
        key="2.1",
        title="Flat and curved surfaces",
        caption=Caption(
            shows="The shortest line between P and Q on a plane and on a sphere. The line on the sphere is "
            "integrated as a geodesic of the graph z = √(1 - x² - y²) by the closed form that the arm uses; "
            f"it stays within {error:.0e} of the great circle.",
            answers="Figure 2.1.",
            parameters="Radius 1, P = (-0.55, 0.15), Q = (0.35, 0.65) in x and y; Runge-Kutta, 400 steps.",
            differs="Adds the lengths. The distance formula beside the thesis's figure has minus signs "
            "where plus belongs (errata 3).",
        ),
        drawing=figure,
        data={"geodesic": lifted, "great_circle": exact},
    )


def graph_geodesic(start: Array, velocity: Array, duration: float, *, steps: int = 400) -> Array:
    """A geodesic of the upper unit half sphere in its (x, y) chart, by Runge-Kutta.

    Args:
        start, velocity: (2,) in the chart.
        duration: of the motion; equal to its length at unit speed.

    Returns:
        Points (steps + 1, 2) of the chart.
    """

    def rate(state: Array) -> Array:
        at, v = state[:2], state[2:]
        z = np.sqrt(1.0 - at @ at)
        slope = -at / z
        hessian = -(np.eye(2) + np.outer(slope, slope)) / z
        return np.concatenate([v, geodesic_acceleration(slope[None], [v @ hessian @ v])])

    state, h = np.concatenate([start, velocity]), duration / steps
    points = [state[:2]]
    for _ in range(steps):
        a = rate(state)
        b = rate(state + 0.5 * h * a)
        c = rate(state + 0.5 * h * b)
        d = rate(state + h * c)
        state = state + h / 6.0 * (a + 2 * b + 2 * c + d)
        points.append(state[:2])
    return np.array(points)


def joint_space(settings: Settings) -> Iterator[Item]:
    """ψ of one obstacle over the joints of the two-joint arm: as a surface and as a map."""
    grid, values = planar.field(
        planar.density(), planar.point(), limit=np.pi / 2, count=41 if settings.quick else 141
    )
    figure = style.new_figure(7.2)
    left: Any = figure.add_subplot(1, 2, 1, projection="3d")
    right = figure.add_subplot(1, 2, 2)
    left.plot_surface(
        *np.meshgrid(*grid),
        values,
        cmap=style.FIELD_MAP,
        edgecolor="0.6",
        linewidth=0.15,
        rcount=60,
        ccount=60,
    )
    left.set(xlabel="q₁ [rad]", ylabel="q₂ [rad]", zlabel="ψ [1/m³]", title="(a) surface")
    ticks = [-1.5, 0.0, 1.5]
    left.set(xticks=ticks, yticks=ticks)
    left.set_box_aspect((1, 1, 0.8), zoom=0.9)
    left.view_init(elev=24, azim=-70)
    style.draw_field(figure, right, grid, values)
    style.joint_axes(right, title="(b) map")
    yield Figure(
        key="3.7",
        title="The joint space of a two-joint arm, embedded by ψ",
        caption=Caption(
            shows="ψ of one obstacle point over the joint angles. The ridge is where link 2 passes through "
            f"the point; its top is {values.max():.2f} /m³.",
            answers="Figure 3.7.",
            parameters=f"Two links of {planar.LINK_LENGTH:g} m, one Gaussian each (deviations "
            f"{planar.LENGTH_DEVIATION:g}, {planar.WIDTH_DEVIATION:g}, {planar.LOW:g} m), obstacle "
            "(-0.5, 1.4) m.",
            differs="The thesis does not state its covariances; ours give its colour scale (9.7) and the "
            "width of its ridge. ψ is a density in 1/m³, not a probability, and may exceed 1. Curvature "
            "does not grow with ψ: on the crest's flank, where ψ is steepest, it passes through zero "
            "(errata 15).",
        ),
        drawing=figure,
        data={"q1_rad": grid[0], "q2_rad": grid[1], "psi_per_m3": values},
    )
