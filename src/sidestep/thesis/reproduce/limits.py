"""Figure 5.6: joint limits as walls of ψ; and the alternative of section 5.4, kernels along the limits."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator
from functools import partial
from itertools import product

import numpy as np

from sidestep import Obstacles
from sidestep.drawing import style
from sidestep.system import GeometricSystem
from sidestep.thesis import BinarySwitch, GeodesicOnly, JointLimitPotential, Sum, rollout
from sidestep.thesis.reproduce import planar
from sidestep.thesis.reproduce.item import Array, Caption, Figure, Item, Table
from sidestep.thesis.reproduce.registry import Settings

SLOPE, HEIGHT = 30.0, 10.0  # [1/rad], [1/m³]: as high as the obstacle
KAPPA = 0.5


def joint_limits(settings: Settings) -> Iterator[Item]:
    """T5.7 alone, and with an obstacle."""
    robot = planar.arm()
    limits = JointLimitPotential(robot, slope=SLOPE, height=HEIGHT)
    direction = np.array([0.8, -0.6])
    free = rollout(
        GeometricSystem([limits], switch=GeodesicOnly()),
        planar.START,
        0.5 * direction,
        planar.GOAL,
        Obstacles.none(),
        period=1e-3,
        steps=120_000,
        integrator="runge_kutta_4",
    )
    both = Sum([planar.density(), limits])
    obstructed = rollout(
        GeometricSystem(
            [both], stiffness=planar.STIFFNESS, damping=planar.DAMPING, switch=BinarySwitch(KAPPA)
        ),
        planar.START,
        np.zeros(2),
        np.array([2.9, 0.15]),
        planar.point(),
        period=1e-4,
        steps=200_000,
    )
    outside = np.any(np.abs(free.q) > np.pi, axis=1)
    crossing = int(np.argmax(outside)) if outside.any() else len(free.q) - 1
    figure = style.new_figure(7.6)
    left, right = figure.subplots(1, 2)
    count = 61 if settings.quick else 141
    for ax, embedding, obstacles in (
        (left, limits, Obstacles.none()),
        (right, both, planar.point()),
    ):
        grid, values = planar.field(embedding, obstacles, limit=np.pi + 0.25, count=count)
        style.draw_field(figure, ax, grid, np.minimum(values, HEIGHT), label="ψ [1/m³]")
        ax.plot(
            np.pi * np.array([-1, 1, 1, -1, -1]),
            np.pi * np.array([-1, -1, 1, 1, -1]),
            color=style.BLACK,
            linewidth=0.7,
            linestyle=":",
            label="limits",
        )
    style.draw_path(left, free.q[: crossing + 200], label="motion")
    left.plot(*free.q[crossing], "X", color=style.PURPLE, markeredgecolor="k", label="leaves", zorder=11)
    style.mark_start(left, *planar.START)
    style.joint_axes(left, title="(a) geodesic, limits alone")
    finite = np.isfinite(obstructed.q).all(axis=1)
    style.draw_path(right, obstructed.q[finite], label="motion")
    style.mark_start(right, *planar.START)
    style.mark_goal(right, 2.9, 0.15)
    style.joint_axes(right, title="(b) switched, with an obstacle")
    for ax in (left, right):
        ax.set(xlim=(-3.5, 3.5), ylim=(-3.5, 3.5))
    left.legend(loc="upper left")
    right.legend(loc="upper left")
    delay = free.time[crossing]
    end = obstructed.q[finite][-1]
    yield Figure(
        key="5.6",
        title="Joint limits as walls",
        caption=Caption(
            shows="(a) A geodesic slides along the walls that stand for the limits, climbing them all the "
            "while, "
            + (
                f"and leaves the limits after {delay:.0f} s. "
                if outside.any()
                else f"and is still inside after {delay:.0f} s. "
            )
            + f"(b) Switched motion past the obstacle to a goal near the limit of joint 1; after 20 s "
            f"it is at ({end[0]:.2f}, {end[1]:.2f}) rad"
            + (", far outside the limits." if np.abs(end).max() > 3.5 else "."),
            answers="Figure 5.6.",
            parameters=f"Limits ±π, ζ with slope {SLOPE:g} /rad and height {HEIGHT:g} /m³ (sum over joints), "
            f"geodesic from (-0.5, -1.2) rad at 0.5 rad/s towards (0.8, -0.6); (b) K = "
            f"{planar.STIFFNESS:g} /s², D = {planar.DAMPING:g} /s.",
            differs="(a) looks like the thesis's until the motion has climbed the wall: ζ is bounded, so a "
            "wall of height H only delays a geodesic by about H divided by its normal speed (errata 14). "
            "Hard limits are kept by the torque controller, not by ζ.",
        ),
        drawing=figure,
        data={
            "time_s": free.time[::100],
            "q_geodesic_rad": free.q[::100],
            "time_switched_s": obstructed.time[::100],
            "q_switched_rad": obstructed.q[::100],
        },
    )


class KernelBorder:
    """Gaussians on a grid along the borders of the joint limits: the alternative that section 5.4 sets aside.

    ζ(q) = height · sum_c exp(-|q - c|² / (2 width²)), c on the faces of the box of the limits.

    Args:
        lower, upper: limits (nv,) [rad].
        spacing: between kernels [rad]; their width is the same.
        height: of one kernel.
    """

    def __init__(self, lower: Array, upper: Array, *, spacing: float, height: float = 1.0) -> None:
        axes = [np.linspace(a, b, round((b - a) / spacing) + 1) for a, b in zip(lower, upper, strict=True)]
        nodes = np.array(list(product(*axes)))
        on_border = np.any((nodes == lower) | (nodes == upper), axis=1)
        self.centres: Array = nodes[on_border]
        self.width, self.height = spacing, height

    def evaluate(self, q: Array) -> tuple[float, Array, Array]:
        """Value, gradient (nv,) and Hessian (nv, nv)."""
        offset = (q - self.centres) / self.width
        weight = self.height * np.exp(-0.5 * np.einsum("ij,ij->i", offset, offset))
        gradient = -(weight @ offset) / self.width
        hessian = (offset.T * weight) @ offset - weight.sum() * np.eye(len(q))
        return float(weight.sum()), gradient, hessian / self.width**2


class PotentialBorder:
    """T5.7 in NumPy, so that it is timed against the kernels on equal terms."""

    def __init__(self, lower: Array, upper: Array, *, slope: float = SLOPE, height: float = 1.0) -> None:
        self.lower, self.upper, self.slope, self.height = lower, upper, slope, height

    def evaluate(self, q: Array) -> tuple[float, Array, Array]:
        """Value, gradient (nv,) and Hessian (nv, nv)."""
        above = 1.0 / (1.0 + np.exp(-self.slope * (q - self.upper)))
        below = 1.0 / (1.0 + np.exp(-self.slope * (self.lower - q)))
        first = above * (1.0 - above), below * (1.0 - below)
        gradient = self.height * self.slope * (first[0] - first[1])
        curvature = first[0] * (1.0 - 2.0 * above) + first[1] * (1.0 - 2.0 * below)
        value = self.height * float(above.sum() + below.sum())
        return value, gradient, np.diag(self.height * self.slope**2 * curvature)


def kernels(settings: Settings) -> Iterator[Item]:
    """What kernels along the limits cost against the potential as joints are added."""
    most = 3 if settings.quick else 4
    repeats = 5 if settings.quick else 30
    spacing = np.pi / 8.0
    counts, kernel_cost, potential_cost = [], [], []
    joints = np.arange(1, most + 1)
    for d in joints:
        settings.notify(f"kernels for {d} joints")
        lower, upper = np.full(d, -np.pi), np.full(d, np.pi)
        border = KernelBorder(lower, upper, spacing=spacing)
        counts.append(len(border.centres))
        q = np.random.default_rng(settings.seed).uniform(-3.0, 3.0, d)
        kernel_cost.append(_median_time(partial(border.evaluate, q), repeats))
        potential_cost.append(_median_time(partial(PotentialBorder(lower, upper).evaluate, q), repeats))
    ratios = np.array(kernel_cost) / np.array(potential_cost)
    yield Table(
        key="5.4-kernels",
        title="Kernels along the joint limits against the potential",
        caption=Caption(
            shows="Number of Gaussians on the faces of the box of the limits, and the time of one value with "
            "gradient and Hessian, for both ways of section 5.4. For 7 joints this spacing asks for "
            f"{17**7 - 15**7:,} kernels.",
            answers="The two approaches of section 5.4, which the thesis compares in words.",
            parameters=f"Limits ±π, spacing and width π/8 rad (17 kernels an axis: 17ᵈ - 15ᵈ), NumPy, "
            f"median of {repeats} calls.",
            differs="Agrees with the thesis: exponential against linear.",
        ),
        columns=("joints", "kernels", "kernels: time [µs]", "potential: time [µs]", "ratio"),
        rows=tuple(
            (f"{d}", f"{n:,}", f"{1e6 * a:.0f}", f"{1e6 * b:.0f}", f"{r:.2g}")
            for d, n, a, b, r in zip(joints, counts, kernel_cost, potential_cost, ratios, strict=True)
        ),
        data={
            "joints": joints,
            "kernels": np.array(counts),
            "kernel_time_s": np.array(kernel_cost),
            "potential_time_s": np.array(potential_cost),
        },
    )


def _median_time(call: Callable[[], object], repeats: int) -> float:
    call()
    times = []
    for _ in range(repeats):
        begin = clock.perf_counter()
        call()
        times.append(clock.perf_counter() - begin)
    return float(np.median(times))
