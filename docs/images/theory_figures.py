"""Pictures of the theory, each computed by the library itself; see make.py."""

from __future__ import annotations

from typing import Any

import numpy as np
from figures import ball_on, draw_planar, joints_of, plain, save, sheet

import sidestep as ss
from sidestep import thesis
from sidestep.control import acceleration_bounds
from sidestep.distance import ExactClearance
from sidestep.drawing.palette import BLACK, BLUE, GREEN, ORANGE, VERMILLION
from sidestep.obstacles import Sphere, pose_at
from sidestep.system import GeometricSystem


def density() -> None:
    """The density of a planar arm's body in the world, and the potential of a ball over its joint space."""
    robot = ss.Robot.named("planar2")
    density_ = thesis.CollisionDensity(robot, ss.Body.fit(robot, components=2, seed=0))
    centre, radius, rest = np.array([0.62, 0.32, 0.0]), 0.1, np.zeros(2)
    ball = ss.Obstacles([centre], radii=radius)
    postures = ((np.array([0.95, 0.3]), BLUE, "o"), (np.array([0.5, 0.1]), BLACK, "s"))

    def psi(q: Any, obstacles: ss.Obstacles) -> float:
        return float(density_.evaluate(q, rest, obstacles).values[0])

    figure, (left, right) = sheet(2, height=4.0)
    x, y = np.linspace(-0.25, 1.15, 113), np.linspace(-0.25, 1.05, 105)
    of_body = [[psi(postures[0][0], ss.Obstacles([[a, b, 0.0]], radii=0.0)) for a in x] for b in y]
    left.contourf(x, y, of_body, levels=16, cmap="Blues")
    for q, colour, marker in postures:
        draw_planar(left, robot, q, colour=colour, alpha=0.8)
        left.plot(*joints_of(robot, q)[-1], marker, color=colour, label=f"ψ = {psi(q, ball):.1f} /m³")
    ball_on(left, centre, radius)
    left.legend(fontsize=8, frameon=False, loc="upper left")
    plain(left, "density of the blue arm, at points of radius 0")

    x, y = np.linspace(-1.2, 2.2, 103), np.linspace(-2.6, 2.6, 105)
    exact = ExactClearance(robot, Sphere(radius, pose_at(centre)))
    height = [[psi([a, b], ball) for a in x] for b in y]
    clearance = [[exact.distance(np.array([a, b])).distance for a in x] for b in y]
    shown = right.contourf(x, y, height, levels=16, cmap="Blues")
    figure.colorbar(shown, ax=right, label="ψ [1/m³]").ax.tick_params(labelsize=8)
    right.contour(x, y, clearance, levels=[0.0], colors=[VERMILLION], linewidths=1.5)
    for q, colour, marker in postures:
        right.plot(*q, marker, color=colour, markeredgecolor="white", markersize=8)
    right.set(xlabel="joint 1 [rad]", ylabel="joint 2 [rad]")
    right.set_title("ψ of the ball over the joint space; contact (red line)", fontsize=10)
    save(figure, "density")


def systems() -> None:
    """A damped spring in flat space, on the graph of a density, and with a switch: path and energy."""
    robot = ss.Robot.named("planar2")
    psi = thesis.CollisionDensity(robot, ss.Body.fit(robot, components=2, seed=0))
    centre, radius, rest = np.array([0.62, 0.32, 0.0]), 0.1, np.zeros(2)
    ball, exact = ss.Obstacles([centre], radii=radius), ExactClearance(robot, Sphere(radius, pose_at(centre)))
    starts, goal = np.array([[-0.3, 0.0], [-0.3, -0.6]]), np.array([2.0, -2.2])
    stiffness, damping, period, every = 2.0, 2.0, 1e-4, 100
    x, y = np.linspace(-1.2, 2.8, 101), np.linspace(-2.8, 2.6, 109)
    height = [[psi.evaluate([a, b], rest, ball).values[0] for a in x] for b in y]
    clearance = [[exact.distance(np.array([a, b])).distance for a in x] for b in y]
    figure, (left, right) = sheet(2, height=4.0)
    left.contourf(x, y, height, levels=16, cmap="Blues")
    left.contour(x, y, clearance, levels=[0.0], colors=[VERMILLION], linewidths=1.5)
    for name, switch, colour in (
        ("flat space", None, "0.5"),
        ("curved, no switch (3.2)", thesis.Unswitched(), GREEN),
        ("curved, binary switch", thesis.BinarySwitch(threshold=0.5), ORANGE),
    ):
        system = GeometricSystem(
            [psi] if switch else [],
            robot=None if switch else robot,
            stiffness=stiffness,
            damping=damping,
            damping_form="metric",
            switch=switch,
        )
        numbers = {"period": period, "steps": 40_000 if name.endswith("switch") else 250_000}
        motion = thesis.rollout(system, starts[0], rest, goal, ball, **numbers)
        left.plot(*motion.q.T, color=colour, label=name)
        energy = []
        for q, v in zip(motion.q[::every], motion.v[::every], strict=True):
            jacobian = psi.evaluate(q, v, ball).jacobian if switch else np.zeros((1, 2))
            energy.append(
                v @ thesis.metric_matrix(jacobian) @ v / 2 + stiffness * np.sum((q - goal) ** 2) / 2
            )
        right.plot(period * every * np.arange(len(energy)), energy, color=colour, label=name)
        if name.startswith("curved, no"):
            stalled = thesis.rollout(system, starts[1], rest, goal, ball, **numbers)
            left.plot(*stalled.q.T, color=colour, linewidth=1.0, linestyle="--")
            left.plot(*stalled.q[-1], "x", color=BLACK)
    left.plot(*starts.T, "o", color=BLACK, markersize=4)
    left.plot(*goal, "*", color=BLACK, markersize=11)
    left.set(xlabel="joint 1 [rad]", ylabel="joint 2 [rad]", xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    left.set_title("to the goal (star); contact (red line)", fontsize=10)
    right.set(xlabel="time [s]", ylabel="energy E [rad²/s²]", xlim=(0, 4), ylim=(0, None))
    right.set_title("energy of the three solid lines", fontsize=10)
    right.legend(fontsize=8, frameon=False)
    save(figure, "systems")


def geometry() -> None:
    """Geodesics of the graph of a density over the joint space of an arm with two joints."""
    robot = ss.Robot.named("planar2")
    body_ = ss.Body.fit(robot, components=1, seed=0)
    ball = ss.Obstacles([[0.65, 0.45, 0.0]], radii=0.25)
    psi = thesis.CollisionDensity(robot, body_)
    x, y = np.linspace(-1.2, 2.2, 90), np.linspace(-1.6, 2.6, 90)
    rest = np.zeros(2)
    height = np.array([[psi.evaluate([a, b], rest, ball).values[0] for a in x] for b in y])
    system = GeometricSystem([psi], stiffness=0.0, damping=0.0, switch=thesis.GeodesicOnly())
    figure, (left, right) = sheet(2, height=4.0)
    left.remove()
    surface: Any = figure.add_subplot(1, 2, 1, projection="3d")
    X, Y = np.meshgrid(x, y)
    surface.plot_surface(X, Y, height, cmap="Blues", linewidth=0, alpha=0.85)
    surface.set_xlabel("q1", fontsize=8)
    surface.set_ylabel("q2", fontsize=8)
    surface.set_title("the graph q ↦ (q, ψ(q))", fontsize=10)
    surface.tick_params(labelsize=7)
    right.contourf(X, Y, height, levels=20, cmap="Blues")
    for level in np.linspace(-0.8, 2.0, 15):
        start = np.array([-1.1, level])
        motion = thesis.rollout(system, start, np.array([1.0, 0.0]), start, ball, steps=9000)
        inside = (np.abs(motion.q[:, 0] - 0.5) < 1.75) & (motion.q[:, 1] > y[0]) & (motion.q[:, 1] < y[-1])
        end = len(inside) if inside.all() else int(np.argmin(inside))
        right.plot(*motion.q[:end].T, color=BLACK, linewidth=0.9)
    right.set(xlabel="q1 [rad]", ylabel="q2 [rad]", xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    right.set_title("geodesics bend around the hill, or climb it", fontsize=10)
    save(figure, "geometry")


def control() -> None:
    """Position, velocity and acceleration limits of one joint as bounds on its acceleration."""
    robot = ss.Robot.named("fr3_arm")
    limits, neutral = robot.limits, np.asarray(robot.neutral)
    upper, fastest = limits.upper[0], limits.velocity[0]
    positions = np.linspace(upper - 1.0, upper, 201)
    speeds = np.linspace(-fastest, fastest, 161)
    bound = np.full((len(speeds), len(positions)), np.nan)
    for i, speed in enumerate(speeds):
        for k, position in enumerate(positions):
            q, v = neutral.copy(), np.zeros(7)
            q[0], v[0] = position, speed
            bound[i, k] = acceleration_bounds(robot, q, v, 1e-3)[1][0]
    figure, (left, right) = sheet(2)
    shown = left.contourf(upper - positions, speeds, bound, levels=21, cmap="RdBu")
    figure.colorbar(shown, ax=left).ax.tick_params(labelsize=8)
    left.set(xlabel="way left to the position limit [rad]", ylabel="velocity [rad/s]")
    left.set_title("largest acceleration that is allowed [rad/s²]", fontsize=10)
    q, v = neutral.copy(), np.zeros(7)
    q[0] = upper - 1.2
    rows = []
    for _ in range(1500):
        most = acceleration_bounds(robot, q, v, 1e-3)[1][0]
        rows.append((upper - q[0], v[0], most))
        v[0] += 1e-3 * most
        q[0] += 1e-3 * v[0]
    way, speed, acceleration = np.array(rows).T
    time = np.arange(len(rows)) * 1e-3
    right.plot(time, speed, color=ORANGE, label="velocity [rad/s]")
    right.plot(time, way, color=BLUE, label="way left [rad]")
    right.plot(time, acceleration / limits.acceleration[0], color="0.4", label="acceleration / limit")
    right.set(xlabel="time [s]")
    right.set_title("always as hard as the bound allows", fontsize=10)
    right.legend(fontsize=8, frameon=False)
    save(figure, "control")


def clearances() -> None:
    """The barriers of an arm with two joints over its joint space, and motions from many starts."""
    arm = ss.Arm.load("planar2")
    ball = ss.Obstacles([[0.62, 0.5, 0.0]], radii=0.08)
    goal = np.array([0.9, 1.6])
    settings = ss.ControllerSettings(
        synchronous=True, planner=None, look_ahead=None, local_minimum=None, local_activation=False
    )
    system = ss.Controller(arm, settings).system
    x, y = np.linspace(-1.4, 2.6, 121), np.linspace(-2.6, 2.6, 121)
    rest = np.zeros(2)
    total = np.array(
        [
            [np.linalg.norm(system.acceleration([a, b], rest, ss.JointGoal(goal), ball).values) for a in x]
            for b in y
        ]
    )
    figure, (ax,) = sheet(1, width=6.5, height=4.4)
    shown = ax.contourf(x, y, np.log10(np.maximum(total, 1e-4)), levels=24, cmap="Oranges", extend="both")
    figure.colorbar(shown, ax=ax, label="log10 |ψ|").ax.tick_params(labelsize=8)
    for start in [(-1.2, s) for s in np.linspace(-2.2, 2.2, 9)]:
        controller = ss.Controller(arm, settings)
        controller.set_obstacles(ball)
        controller.set_goal(goal)
        motion = ss.integrate(controller, np.array(start), rest, steps=8000, goal=goal, tolerance=0.01)
        ax.plot(*motion.q.T, color=BLUE, linewidth=1.3)
        if not motion.arrived:
            ax.plot(*motion.last_q, "x", color=BLACK)
    ax.plot(*goal, "*", color=GREEN, markersize=13)
    ax.set(xlabel="joint 1 [rad]", ylabel="joint 2 [rad]")
    ax.set_title("barriers over the joint space; motions to the goal (star)", fontsize=10)
    save(figure, "clearances")


def timed_path() -> None:
    """Joint velocities, accelerations and jerks over their limits, along a path that the planner found."""
    arm = ss.Arm.load("fr3")
    start, goal = arm.neutral + 0.3, arm.neutral - np.array([1.2, 0, 0, 0, 0, 0, 0])
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True))
    controller.set_obstacles(ss.Obstacles([[0.7, -0.2, 0.7]], radii=0.08))
    controller.set_goal(goal)
    motion = ss.integrate(controller, start, np.zeros(7), steps=4000, goal=goal, tolerance=0.005)
    limits, time = arm.limits, np.arange(len(motion.q)) * 1e-3
    jerk = np.diff(motion.acceleration, axis=0, prepend=np.zeros((1, 7))) / 1e-3
    figure, (left, right) = sheet(2)
    for values, bound, name, colour in (
        (motion.v, limits.velocity, "velocity", BLUE),
        (motion.acceleration, limits.acceleration, "acceleration", ORANGE),
        (jerk, limits.jerk, "jerk", "0.6"),
    ):
        left.plot(time, (np.abs(values) / bound).max(axis=1), color=colour, label=name, linewidth=1.2)
    left.axhline(1.0, color=VERMILLION, linewidth=1, linestyle="--")
    left.set(xlabel="time [s]", ylabel="largest of all joints, over its limit", ylim=(0, 1.1))
    left.set_title("a motion around a ball keeps every limit", fontsize=10)
    left.legend(fontsize=8, frameon=False)
    near = np.where(np.isfinite(motion.clearance), 100 * motion.clearance, np.nan)
    right.plot(time, near, color=GREEN)
    right.set(xlabel="time [s]", ylabel="clearance [cm]", xlim=(0, time[-1]), ylim=(0, None))
    right.set_title("its clearance, where below 10 cm", fontsize=10)
    save(figure, "timed-path")
