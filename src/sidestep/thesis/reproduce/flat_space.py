"""Figure 5.1: the damped spring in flat space, beside its closed form."""

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

DURATION = 15.0  # [s]
PERIOD = 1e-3  # [s]


def flat_space(_: Settings) -> Iterator[Item]:
    """Trajectory and velocities of T5.1."""
    system = GeometricSystem([], stiffness=planar.STIFFNESS, damping=planar.DAMPING, robot=planar.arm())
    steps = round(DURATION / PERIOD)
    run = rollout(
        system,
        planar.START,
        np.zeros(2),
        planar.GOAL,
        Obstacles.none(),
        period=PERIOD,
        steps=steps,
        integrator="runge_kutta_4",
    )
    exact = damped_oscillation(run.time)[:, None] * (planar.START - planar.GOAL) + planar.GOAL
    error = float(np.abs(run.q - exact).max())

    figure = style.new_figure(6.6)
    left, right = figure.subplots(1, 2)
    left.plot(run.q[:, 0], run.q[:, 1], color=style.VERMILLION, label="motion")
    left.plot(*exact[::1000].T, "+", color=style.BLACK, label="closed form, each second")
    style.mark_start(left, *planar.START)
    style.mark_goal(left, *planar.GOAL)
    left.set(xlim=(-np.pi, np.pi), ylim=(-np.pi, np.pi))
    style.joint_axes(left, title="(a) joint trajectory")
    left.legend(loc="upper left")
    for j in range(2):
        right.plot(run.time, run.v[:, j], label=f"v{'₁₂'[j]}")
    style.time_axes(right, "joint velocity [rad/s]", title="(b) joint velocities", legend=True)
    yield Figure(
        key="5.1",
        title="Trajectory of the damped spring in flat space",
        caption=Caption(
            shows="A straight line to the goal, and velocities that rise and are damped away. The crosses "
            f"are the closed form of the damped oscillator; the motion stays within {error:.0e} rad of it.",
            answers="Figure 5.1.",
            parameters=f"K = {planar.STIFFNESS:g} /s², D = {planar.DAMPING:g} /s, start (-0.5, -1.2) rad, "
            f"goal (1.0, 0.15) rad, Runge-Kutta with {PERIOD:g} s.",
            differs="The line is straight because K and D are multiples of the identity and the start is at "
            "rest; the thesis says so of every K and D. These gains are below critical damping "
            "(D² < 4K), so the motion overshoots by 3 % before it settles.",
        ),
        drawing=figure,
        data={"time_s": run.time, "q_rad": run.q, "v_rad_s": run.v, "q_closed_form_rad": exact},
    )


def damped_oscillation(time: Array) -> Array:
    """The solution of x'' = -K x - D x', x(0) = 1, x'(0) = 0, below critical damping."""
    rate = planar.DAMPING / 2.0
    frequency = np.sqrt(planar.STIFFNESS - rate**2)
    wave: Array = np.exp(-rate * time) * (
        np.cos(frequency * time) + rate / frequency * np.sin(frequency * time)
    )
    return wave
