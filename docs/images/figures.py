"""Pictures of the concepts, each computed by the library itself; see make.py."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle

import sidestep as ss
from sidestep.controller import SafetySettings
from sidestep.drawing.palette import BLACK, BLUE, GREEN, ORANGE, SKY, VERMILLION
from sidestep.planning import PathPlanner

HERE = Path(__file__).parent
LINK = 0.5  # [m] of a link of the planar arms
BOX = '<rect x="{x}" y="{y}" width="{w}" height="{h}" rx="8" fill="{fill}" stroke="{line}"/>'
TEXT = '<text x="{x}" y="{y}" text-anchor="{anchor}" fill="#222" font-weight="{weight}">{text}</text>'
ARROW = '<path d="{d}" fill="none" stroke="#555" stroke-width="1.6" marker-end="url(#tip)"/>'


def sheet(columns: int, *, width: float = 9.0, height: float = 3.6) -> tuple[Figure, list[Any]]:
    """A figure with plots side by side."""
    figure = Figure(figsize=(width, height), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    axes = [figure.add_subplot(1, columns, k + 1) for k in range(columns)]
    for ax in axes:
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(labelsize=8)
    return figure, axes


def joints_of(robot: ss.Robot, q: np.ndarray) -> np.ndarray:
    """Where the joints and the tip of a planar arm are, (nv + 1, 2) [m]."""
    angles = np.cumsum(q)
    steps = LINK * np.column_stack([np.cos(angles), np.sin(angles)])
    return np.vstack([np.zeros(2), np.cumsum(steps, axis=0)])


def draw_planar(ax: Any, robot: ss.Robot, q: np.ndarray, *, colour: str, alpha: float = 1.0) -> None:
    """A planar arm as thick lines."""
    places = joints_of(robot, q)
    ax.plot(
        *places.T, color=colour, alpha=alpha, linewidth=5, solid_capstyle="round", solid_joinstyle="round"
    )
    ax.plot(*places[:-1].T, "o", color="white", markersize=2.5, alpha=alpha)


def ball_on(ax: Any, centre: np.ndarray, radius: float) -> None:
    ax.add_patch(Circle(tuple(centre[:2]), radius, color=VERMILLION, zorder=3))


def plain(ax: Any, title: str) -> None:
    """A plot of places: equal axes, no ticks."""
    ax.set_aspect("equal")
    ax.set_axis_off()
    ax.set_title(title, fontsize=10)


def save(figure: Figure, name: str) -> None:
    figure.savefig(HERE / f"{name}.png", facecolor="white")


def loop() -> None:
    """What goes into a step, what it does, what runs beside it, and what comes out; drawn, not computed."""
    parts = [
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 900 360" font-family="sans-serif" font-size="14">',
        '<defs><marker id="tip" markerWidth="9" markerHeight="9" refX="7" refY="4" orient="auto">'
        '<path d="M0,0 L8,4 L0,8 z" fill="#555"/></marker></defs>',
        '<rect width="900" height="360" fill="white"/>',
    ]

    def box(x: int, y: int, w: int, h: int, lines: list[str], fill: str, line: str) -> None:
        parts.append(BOX.format(x=x, y=y, w=w, h=h, fill=fill, line=line))
        for k, text in enumerate(lines):
            middle = y + h / 2 + 5 + 18 * (k - (len(lines) - 1) / 2)
            weight = "bold" if k == 0 else "normal"
            parts.append(TEXT.format(x=x + w / 2, y=middle, anchor="middle", weight=weight, text=text))

    blue, grey, green = ("#e3f0f8", BLUE), ("#f2f2f2", "#999"), ("#e2f3ee", GREEN)
    box(20, 30, 170, 50, ["state q, v", "measured"], *grey)
    box(20, 100, 170, 50, ["goal", "or velocity, twist, path"], *grey)
    box(20, 170, 170, 50, ["obstacles", "points or shapes"], *grey)
    parts.append(BOX.format(x=235, y=16, w=430, h=218, fill="none", line=BLUE))
    parts.append(
        TEXT.format(x=450, y=38, anchor="middle", weight="bold", text="step(q, v), every millisecond")
    )
    box(250, 54, 120, 60, ["clearances", "of the body"], *blue)
    box(390, 54, 120, 60, ["attraction", "to the reference"], *blue)
    box(530, 54, 120, 60, ["barriers", "bend it"], *blue)
    box(530, 152, 120, 60, ["quadratic", "program: limits"], *blue)
    box(390, 152, 120, 60, ["reference", "integrated"], *blue)
    box(250, 152, 120, 60, ["feedback", "to the arm"], *blue)
    box(710, 62, 170, 50, ["command", "torque … position"], *grey)
    box(710, 132, 170, 50, ["status, activity", "explain()"], *grey)
    box(235, 282, 130, 56, ["planner", "every 20 ms"], *green)
    box(385, 282, 130, 56, ["look-ahead", "every 0.1 s"], *green)
    box(535, 282, 130, 56, ["posture search", "for pose goals"], *green)
    for x in (300, 450, 600):
        parts.append(ARROW.format(d=f"M{x - 12},280 V238"))
        parts.append(ARROW.format(d=f"M{x + 12},236 V278"))
    for y in (55, 125, 195):
        parts.append(ARROW.format(d=f"M190,{y} H232"))
    for d in ("M370,84 H388", "M510,84 H528", "M590,114 V150", "M530,182 H512", "M390,182 H372"):
        parts.append(ARROW.format(d=d))
    parts.append(ARROW.format(d="M667,87 H708"))
    parts.append(ARROW.format(d="M667,157 H708"))
    parts.append(
        TEXT.format(x=110, y=315, anchor="middle", weight="normal", text="beside the loop, in threads")
    )
    parts.append("</svg>")
    (HERE / "loop.svg").write_text("\n".join(parts) + "\n", encoding="utf-8")


def barriers() -> None:
    """The value of a barrier over its clearance; a planar arm that slides along a ball."""
    arm = ss.Arm.load("planar3")
    q, rest = np.array([0.4, 0.3, 0.2]), np.zeros(3)
    tip, before = joints_of(arm.robot, q)[-1], joints_of(arm.robot, q)[-2]
    along = (tip - before) / np.linalg.norm(tip - before)
    figure, (left, right) = sheet(2)
    for activation, colour in ((0.05, SKY), (0.1, BLUE), (0.15, ORANGE)):
        settings = ss.controller.BarrierSettings(activation=activation)
        system = ss.Controller(
            arm, ss.ControllerSettings(synchronous=True, planner=None, barriers=settings)
        ).system
        found = []
        for distance in np.geomspace(2.2e-3, 0.2, 160):
            point = ss.Obstacles([[*(tip + (distance + 0.02) * along), 0.0]], radii=0.0)
            step = system.acceleration(q, rest, ss.JointGoal(q), point)
            k = int(np.argmin(step.clearances.values))
            found.append((step.clearances.values[k], step.values[k]))
        h, psi = np.array(sorted(found)).T
        seen = np.isfinite(h)
        left.plot(100 * h[seen], psi[seen], color=colour, label=f"activation {100 * activation:.0f} cm")
    left.set(xlabel="clearance h of an ellipsoid [cm]", ylabel="barrier ψ", xlim=(0, 16), ylim=(0, 3))
    left.legend(fontsize=8, frameon=False)
    left.set_title("a barrier grows without bound towards contact", fontsize=10)
    start, goal = np.array([1.5, -0.6, 0.3]), np.array([-0.9, 1.2, 1.4])
    centre, radius = np.array([0.91, 0.76, 0.0]), 0.05
    controller = ss.Controller(
        arm, ss.ControllerSettings(synchronous=True, planner=None, look_ahead=None, local_minimum=None)
    )
    controller.set_obstacles(ss.Obstacles([centre], radii=radius))
    controller.set_goal(goal)
    motion = ss.integrate(controller, start, rest, steps=6000, goal=goal, tolerance=0.01)
    tips = np.array([joints_of(arm.robot, row)[-1] for row in motion.q])
    line = np.array(
        [joints_of(arm.robot, start + s * (goal - start))[-1] for s in np.linspace(0.0, 1.0, 200)]
    )
    for k in np.linspace(0, len(motion.q) - 1, 6).astype(int):
        draw_planar(right, arm.robot, motion.q[k], colour="0.45", alpha=0.25)
    draw_planar(right, arm.robot, motion.q[len(motion.q) // 3], colour="0.35")
    right.plot(*line.T, "--", color="0.5", linewidth=1.2, label="spring alone")
    right.plot(*tips.T, color=BLUE, linewidth=2, label="with barriers")
    ball_on(right, centre, radius)
    right.legend(fontsize=8, frameon=False, bbox_to_anchor=(-0.15, 1.0))
    plain(right, f"the tip goes around a ball, {1e3 * motion.clearance.min():.0f} mm clear")
    save(figure, "barriers")


def planner() -> None:
    """The joint space of an arm with two joints, and the path that the planner finds in it."""
    arm = ss.Arm.load("planar2")
    robot = arm.robot
    start, goal = np.array([-0.3, 0.6]), np.array([1.6, 0.8])
    centres = np.array([[0.62, 0.32, 0.0], [0.2, 0.75, 0.0], [-0.55, 0.45, 0.0]])
    balls = ss.Obstacles(centres, radii=0.1)
    search = PathPlanner(robot, arm.body, pairs=arm.pairs, tables=arm.tables)
    plan = search.plan(start, goal, balls)
    grid = np.linspace(-np.pi, np.pi, 181)
    clearance = np.array([[search.clearance([x, y], balls, cap=0.2).clearance for x in grid] for y in grid])
    figure, (left, right) = sheet(2, height=4.2)
    left.contourf(grid, grid, clearance, levels=[-1.0, 0.0], colors=[VERMILLION], alpha=0.75)
    left.contourf(grid, grid, clearance, levels=[0.0, 0.06], colors=[VERMILLION], alpha=0.2)
    left.plot(*np.array([start, goal]).T, "--", color="0.35", linewidth=1.3, label="straight: blocked")
    left.plot(*plan.path.T, "-o", color=BLUE, linewidth=2, markersize=3, label="path")
    left.plot(*start, "o", color=BLACK)
    left.plot(*goal, "*", color=GREEN, markersize=12)
    left.set(xlabel="joint 1 [rad]", ylabel="joint 2 [rad]", xlim=(-1.6, 3.1), ylim=(-3.1, 3.1))
    left.set_title("joint space: in collision (red), nearer than 6 cm (pale)", fontsize=10)
    left.legend(fontsize=8, frameon=True, loc="lower left")
    distance = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(plan.path, axis=0), axis=1))])
    for s in np.linspace(0.0, distance[-1], 9):
        q = np.array([np.interp(s, distance, plan.path[:, k]) for k in range(2)])
        draw_planar(right, robot, q, colour=BLUE, alpha=0.15)
    draw_planar(right, robot, start, colour="0.3")
    draw_planar(right, robot, goal, colour=GREEN)
    for centre in centres:
        ball_on(right, centre, 0.1)
    plain(right, "the same motion in the world")
    save(figure, "planner")


def look_ahead() -> None:
    """The clearance while a ball flies at the hand, with look-ahead and without."""
    arm = ss.Arm.load("fr3")
    q = arm.neutral
    tip = arm.robot.pose(q, "fr3_hand")[:3, 3]
    measure = PathPlanner(arm.robot, arm.body, pairs=arm.pairs, tables=arm.tables)
    figure, (left, right) = sheet(2)
    for name, settings, colour in (
        ("with look-ahead", {}, BLUE),
        ("without", {"look_ahead": None}, ORANGE),
    ):
        controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True, **settings))
        controller.set_goal(q)
        velocity = np.array([-0.7, 0.0, 0.0])
        begin = tip - 1.3 * velocity
        controller.set_obstacles(ss.Obstacles([begin], radii=0.07, velocities=[velocity]), valid_for=np.inf)
        motion = ss.integrate(controller, q, np.zeros(7), steps=3500)
        time = np.arange(0, 3500, 10) * 1e-3
        clear = [
            measure.clearance(
                motion.q[k], ss.Obstacles([begin + t * velocity], radii=0.07), cap=0.3
            ).clearance
            for k, t in zip(range(0, 3500, 10), time, strict=True)
        ]
        left.plot(time, 100 * np.array(clear), color=colour, label=name)
        right.plot(time, np.abs(motion.q[::10] - q).max(axis=1), color=colour, label=name)
    left.axhline(0.0, color=VERMILLION, linewidth=1)
    left.set(xlabel="time [s]", ylabel="clearance of the body [cm]")
    left.set_title("a ball flies at the hand, 0.7 m/s", fontsize=10)
    right.set(xlabel="time [s]", ylabel="largest way of a joint [rad]")
    right.set_title("the arm leaves, and comes back to its goal", fontsize=10)
    left.legend(fontsize=8, frameon=False)
    save(figure, "look-ahead")


def body() -> None:
    """The meshes of an arm, and the ellipsoids that cover them."""
    from sidestep.drawing import draw_arm
    from sidestep.drawing.views import fit_view

    arm, robot = ss.Arm.load("fr3"), ss.Robot.named("fr3")
    q = np.array([0.3, -0.5, 0.0, -2.2, 0.0, 1.9, 0.8])
    figure = Figure(figsize=(9.0, 4.4), dpi=110)
    FigureCanvasAgg(figure)
    u, w = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 25), np.linspace(0.0, np.pi, 13))
    ball = np.stack([np.cos(u) * np.sin(w), np.sin(u) * np.sin(w), np.cos(w)], axis=-1)
    shells = []
    body = arm.body
    for link, mean, covariance, level in zip(
        body.links, body.means, body.covariances, body.levels, strict=True
    ):
        squares, axes = np.linalg.eigh(level * covariance)
        X = robot.pose(q, link)
        shells.append((ball @ (axes * np.sqrt(squares)).T + mean) @ X[:3, :3].T + X[:3, 3])
    seen = np.concatenate([shell.reshape(-1, 3) for shell in shells])
    for column, (title, meshes, opacity) in enumerate(
        (("the links", True, 0.0), ("and the ellipsoids that hold them", True, 0.12))
    ):
        ax: Any = figure.add_axes((0.5 * column, 0.0, 0.5, 0.93), projection="3d", computed_zorder=False)
        ax.set_axis_off()
        ax.set_proj_type("ortho")
        ax.view_init(elev=12.0, azim=-60.0)
        fit_view(ax, seen, size=(495, 450))
        if meshes:
            draw_arm(ax, robot, q)
        if opacity:
            for shell in shells:
                ax.plot_surface(
                    *np.moveaxis(shell, -1, 0), color=BLUE, alpha=opacity, linewidth=0, shade=True
                )
        ax.set_title(title if column == 0 else f"{title}: {body.num_components}", fontsize=10)
    save(figure, "body")


def guarantees() -> None:
    """Joint velocities that drive an arm against a joint limit, and against a ball."""
    arm = ss.Arm.load("planar3")
    figure, (left, right) = sheet(2)
    limit = arm.limits.upper[0]
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True))
    controller.set_obstacles(ss.Obstacles.none())
    q, v = np.array([0.0, 0.4, 0.4]), np.zeros(3)
    rows = []
    for _ in range(4000):
        controller.set_velocity([1.5, 0.0, 0.0])
        command = controller.step(q, v)
        q, v = command.position, command.velocity
        rows.append((q[0], v[0]))
    position, speed = np.array(rows).T
    time = np.arange(len(rows)) * 1e-3
    left.plot(time, position, color=BLUE, label="position [rad]")
    left.plot(time, speed, color=ORANGE, label="velocity [rad/s]")
    left.axhline(limit, color=VERMILLION, linewidth=1, linestyle="--", label="position limit")
    left.set(xlabel="time [s]")
    left.set_title("told 1.5 rad/s into a joint limit", fontsize=10)
    left.legend(fontsize=8, frameon=False, loc=(0.5, 0.35))
    wall = ss.Obstacles([[1.0, 0.6, 0.0]], radii=0.1)
    for margin, colour in ((0.005, BLUE), (0.03, GREEN)):
        controller = ss.Controller(
            arm, ss.ControllerSettings(synchronous=True, safety=SafetySettings(margin=margin))
        )
        controller.set_obstacles(wall)
        q, v = np.array([-0.4, 0.3, 0.2]), np.zeros(3)
        clear = []
        for _ in range(3000):
            controller.set_velocity([0.8, 0.0, 0.0])
            command = controller.step(q, v)
            clear.append(command.clearance)
            q, v = command.position, command.velocity
        clear = np.array(clear)
        right.plot(
            np.arange(3000) * 1e-3,
            np.where(np.isfinite(clear), 1e3 * clear, np.nan),
            color=colour,
            label=f"margin {1e3 * margin:.0f} mm",
        )
        right.axhline(1e3 * margin, color=colour, linewidth=1, linestyle="--")
    right.set(xlabel="time [s]", ylabel="clearance [mm]", ylim=(0, None))
    right.set_title("told 0.8 rad/s into a ball", fontsize=10)
    right.legend(fontsize=8, frameon=False)
    save(figure, "guarantees")
