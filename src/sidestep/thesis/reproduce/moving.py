"""Figures 5.7 to 5.9: an obstacle that drops into the workspace, and several obstacles."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sidestep import Obstacles
from sidestep.drawing import style
from sidestep.system import GeometricSystem
from sidestep.thesis import rollout
from sidestep.thesis.reproduce import planar
from sidestep.thesis.reproduce.item import Array, Caption, Figure, Item
from sidestep.thesis.reproduce.registry import Settings

_BODY = (
    f"Links of 1 m, one Gaussian each (deviations {planar.LENGTH_DEVIATION:g}, {planar.WIDTH_DEVIATION:g}, "
    f"{planar.LOW:g} m)"
)
DROP_FROM, DROP_TO = np.array([-0.8, 2.3, 0.0]), np.array([-0.8, 0.5, 0.0])  # [m]
DROP_TIME = 6.0  # [s]
PERIOD = 1e-3  # [s]


def dropping(settings: Settings) -> Iterator[Item]:
    """An obstacle that drops in: how ψ moves, and whether the equations must know its velocity."""
    velocity = (DROP_TO - DROP_FROM) / DROP_TIME
    start, goal = np.array([-0.6, 0.5]), np.array([1.5, 0.3])
    system = GeometricSystem([planar.density()], stiffness=planar.STIFFNESS, damping=planar.DAMPING)
    steps = round(DROP_TIME / PERIOD)
    known = rollout(
        system,
        start,
        np.zeros(2),
        goal,
        Obstacles(DROP_FROM[None], 0.0, velocity[None]),
        period=PERIOD,
        steps=steps,
    )
    ignored = _without_velocity(system, start, goal, velocity, steps)
    times = np.array([0.0, 2.0, 4.0, 6.0])
    figure = style.new_figure(8.6)
    axes = figure.subplots(2, 4, height_ratios=(1.0, 1.0))
    for column, t in enumerate(times):
        position = DROP_FROM + t * velocity
        grid, values = planar.field(
            planar.density(), planar.point(position), limit=1.9, count=41 if settings.quick else 101
        )
        ax = axes[0, column]
        style.draw_field(figure, ax, grid, values, label=None)
        k = round(t / PERIOD)
        style.draw_path(ax, known.q[: k + 1], label="motion")
        style.mark_start(ax, *start)
        style.mark_goal(ax, *goal)
        ax.set(xlim=(-1.1, 1.9), ylim=(-1.5, 1.5))
        style.joint_axes(ax, title=f"t = {t:g} s")
        below = axes[1, column]
        planar.draw_arm(below, known.q[k])
        below.plot(*np.array([DROP_FROM, position])[:, :2].T, ":", color=style.BLACK, linewidth=1.0)
        style.mark_obstacle(below, *position[:2])
        below.set(xlim=(-1.6, 1.6), ylim=(-0.3, 2.5))
        planar.task_axes(below)
    axes[0, 0].legend(loc="lower left", fontsize=5.5)
    path = DROP_FROM + known.time[:, None] * velocity
    clearances = [
        min(planar.clearance(q[k], path[k]) for k in range(0, steps + 1, 10)) for q in (known.q, ignored)
    ]
    apart = float(np.abs(known.q - ignored).max())
    yield Figure(
        key="5.7",
        title="An obstacle drops into the workspace",
        caption=Caption(
            shows="Above: ψ over the joints at four instants, and the motion so far; the "
            "ridge grows, turns upright, and in the end stands across the way of joint 1. Below: arm and "
            f"obstacle at the same instants. Least clearance {1000 * clearances[0]:.0f} mm; "
            f"{1000 * clearances[1]:.0f} mm if the equations are not told the obstacle's velocity (the two "
            f"motions differ by up to {apart:.2f} rad).",
            answers="Figure 5.7.",
            parameters=f"{_BODY}, obstacle from (-0.8, 2.3) to (-0.8, 0.5) m in {DROP_TIME:g} s, start "
            f"(-0.6, 0.5) rad, goal (1.5, 0.3) rad, K = {planar.STIFFNESS:g} /s², D = {planar.DAMPING:g} /s, "
            "no switch.",
            differs="The thesis moves only ψ, holds that the equations stay the same, and shows no motion. "
            "They do not: ψ then depends on time, and d²ψ/dt² has terms with the obstacle's velocity "
            "(errata 11).",
        ),
        drawing=figure,
        data={
            "time_s": known.time,
            "q_rad": known.q,
            "q_velocity_ignored_rad": ignored,
            "obstacle_m": path,
        },
    )


def _without_velocity(
    system: GeometricSystem, start: Array, goal: Array, velocity: Array, steps: int
) -> Array:
    """The same motion (steps + 1, nv) with an obstacle seen at its place, but taken to stand still."""
    q, v = start.copy(), np.zeros(2)
    rows = [q.copy()]
    for k in range(steps):
        position = DROP_FROM + k * PERIOD * velocity
        v = v + PERIOD * system.acceleration(q, v, goal, Obstacles(position[None])).acceleration
        q = q + PERIOD * v
        rows.append(q.copy())
    return np.array(rows)


def several(settings: Settings) -> Iterator[Item]:
    """Several obstacles: one ψ, a sum over points."""
    positions = np.array([[-0.5, 1.4, 0.0], [0.35, 1.45, 0.0]])
    start, goal = np.array([-1.1, 0.5]), np.array([1.2, 0.4])
    system = GeometricSystem([planar.density()], stiffness=planar.STIFFNESS, damping=planar.DAMPING)
    run = rollout(system, start, np.zeros(2), goal, Obstacles(positions), period=PERIOD, steps=40_000)
    vias = np.array([[-0.3, -2.2], [1.4, -2.2]])
    q, v, legs = start, np.zeros(2), []
    for target, steps in ((vias[0], 6_000), (vias[1], 6_000), (goal, 28_000)):
        leg = rollout(system, q, v, target, Obstacles(positions), period=PERIOD, steps=steps)
        q, v = leg.q[-1], leg.v[-1]
        legs.append(leg.q[:-1])
    joined = np.concatenate(legs)
    figure = style.new_figure(8.4)
    left, right = figure.subplots(1, 2)
    grid, values = planar.field(
        planar.density(), Obstacles(positions), limit=2.6, count=61 if settings.quick else 141
    )
    style.draw_field(figure, left, grid, values)
    style.draw_path(left, run.q, label="motion")
    style.draw_path(left, joined, color=style.ORANGE, label="by way of two via points")
    left.plot(*vias.T, "d", color=style.ORANGE, markeredgecolor="k", zorder=10)
    style.mark_start(left, *start)
    style.mark_goal(left, *goal)
    left.set(xlim=(-2.6, 2.6), ylim=(-2.6, 2.6))
    style.joint_axes(left, title="(a) joint space")
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(joined, axis=0), axis=1))])
    for share in np.linspace(0.0, 1.0, 12):
        k = min(int(np.searchsorted(way, share * way[-1])), len(joined) - 1)
        planar.draw_arm(right, joined[k], alpha=0.2 + 0.7 * share, width=1.6)
    for index, position in enumerate(positions):
        style.mark_obstacle(right, *position[:2], label="obstacles" if index == 0 else None)
    style.mark_start(right, *planar.joints(start)[-1], label="tip at start")
    style.mark_goal(right, *planar.joints(goal)[-1], label="tip at goal")
    right.set(xlim=(-2.2, 1.9), ylim=(-0.3, 2.9))
    right.legend(loc="upper center", ncols=3, fontsize=6, columnspacing=0.7, handletextpad=0.1)
    planar.task_axes(right, title="(b) task space, by way of via points")
    distance = float(np.linalg.norm(run.q[-1] - goal))
    yield Figure(
        key="5.8",
        title="Several obstacles",
        caption=Caption(
            shows="ψ of two obstacle points has two ridges. The unswitched motion all but stops before the "
            f"first ({distance:.2f} rad from the goal after 40 s, clearance "
            f"{1000 * planar.least_clearance(run.q, positions):.0f} mm). By way of two via points below both "
            f"it ends {np.linalg.norm(joined[-1] - goal):.0e} rad from the goal (clearance "
            f"{1000 * planar.least_clearance(joined, positions):.0f} mm).",
            answers="Figure 5.8.",
            parameters=f"{_BODY}, obstacles (-0.5, 1.4) and (0.35, 1.45) m, start (-1.1, 0.5) rad, goal "
            f"(1.2, 0.4) rad, via (-0.3, -2.2) and (1.4, -2.2) rad for 6 s each, K = {planar.STIFFNESS:g} "
            f"/s², D = {planar.DAMPING:g} /s, no switch.",
            differs="The thesis's motion goes around both by itself; it does not state obstacles, start or "
            "switch. With correct equations the way around must be shown to it (errata 12).",
        ),
        drawing=figure,
        data={"time_s": run.time[::20], "q_rad": run.q[::20], "q_via_rad": joined[::20]},
    )


def merging(settings: Settings) -> Iterator[Item]:
    """Two obstacles near each other: ridges that merge."""
    positions = np.array([[-0.55, 1.6, 0.0], [-0.55, 0.75, 0.0]])
    pose = np.array([-0.6, 0.9])
    grid, values = planar.field(
        planar.density(), Obstacles(positions), limit=2.6, count=61 if settings.quick else 161
    )
    figure = style.new_figure(7.4)
    left, right = figure.subplots(1, 2)
    planar.draw_arm(left, pose)
    for index, position in enumerate(positions):
        style.mark_obstacle(left, *position[:2], label="obstacles" if index == 0 else None)
    left.set(xlim=(-1.4, 1.4), ylim=(-0.3, 2.2))
    left.legend(loc="lower left")
    planar.task_axes(left, title="(a) task space")
    style.draw_field(figure, right, grid, values)
    style.mark_start(right, *pose, label="the pose in (a)")
    right.legend(loc="lower left")
    style.joint_axes(right, title="(b) configuration space")
    yield Figure(
        key="5.9",
        title="Merging of curvatures",
        caption=Caption(
            shows="Two obstacle points: the one within reach of link 1 makes a ridge upright in q₁, the "
            "other one a slanted ridge; where they meet they merge into one region.",
            answers="Figure 5.9.",
            parameters=f"{_BODY}, obstacles (-0.55, 1.6) and (-0.55, 0.75) m.",
            differs="Same picture; the thesis does not state the positions. A sum can have zero slope "
            "between two obstacles, where each term alone would push: nothing bends a motion there.",
        ),
        drawing=figure,
        data={"q1_rad": grid[0], "q2_rad": grid[1], "psi_per_m3": values},
    )
