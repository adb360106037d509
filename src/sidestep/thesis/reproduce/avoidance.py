"""Figures 5.3 to 5.5: the geodesic alone, with the spring, and with the switch between them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sidestep.drawing import style
from sidestep.system import GeometricSystem
from sidestep.thesis import BinarySwitch, GeodesicOnly, HarmonicOnly, Rollout, Unswitched, rollout
from sidestep.thesis.reproduce import planar
from sidestep.thesis.reproduce.item import Array, Caption, Figure, Item, Table
from sidestep.thesis.reproduce.registry import Settings

SPEED = 0.3  # [rad/s] at which a geodesic is started towards the goal
FINE = 1e-4  # [s] period of the switched runs: their result depends on it, see figure 5.5
KAPPAS = (0.1, 0.3, 0.5)  # the thesis's
_SETTING = (
    f"Links of 1 m, one Gaussian each (deviations {planar.LENGTH_DEVIATION:g}, {planar.WIDTH_DEVIATION:g} m "
    f"in the plane), obstacle point (-0.5, 1.4) m, start (-0.5, -1.2) rad, goal (1.0, 0.15) rad, "
    f"K = {planar.STIFFNESS:g} /s², D = {planar.DAMPING:g} /s"
)
Switch = Unswitched | HarmonicOnly | GeodesicOnly | BinarySwitch


def move(
    switch: Switch,
    *,
    start: Array = planar.START,
    velocity: Array | None = None,
    thickness: float = planar.LOW,
    duration: float = 20.0,
    period: float = 1e-3,
) -> Rollout:
    """A motion of the two-joint arm past the obstacle; Runge-Kutta unless there is a switch to jump."""
    system = GeometricSystem(
        [planar.density(thickness=thickness)],
        stiffness=planar.STIFFNESS,
        damping=planar.DAMPING,
        switch=switch,
    )
    return rollout(
        system,
        start,
        np.zeros(2) if velocity is None else velocity,
        planar.GOAL,
        planar.point(),
        period=period,
        steps=round(duration / period),
        integrator="semi_implicit_euler" if isinstance(switch, BinarySwitch) else "runge_kutta_4",
    )


def aimed(start: Array) -> Array:
    """A velocity of SPEED from a configuration straight at the goal [rad/s]."""
    offset = planar.GOAL - start
    velocity: Array = SPEED * offset / np.linalg.norm(offset)
    return velocity


def starts_behind_the_obstacle(count: int, *, seed: int) -> Array:
    """Configurations (count, 2) [rad] on the far side of the ridge, outside it."""
    rng = np.random.default_rng(seed)
    centre, normal = np.array([0.35, 0.0]), np.array([0.87, 0.49])  # of the ridge in figure 3.7
    found: list[Array] = []
    while len(found) < count:
        q = rng.uniform(-1.5, 1.5, 2)
        if (q - centre) @ normal < -0.5:
            found.append(q)
    return np.array(found)


def geodesic(settings: Settings) -> Iterator[Item]:
    """T5.3: free motion, aimed at the goal."""
    runs = {
        name: move(GeodesicOnly(), velocity=aimed(planar.START), thickness=thickness, duration=60.0)
        for name, thickness in (("low", planar.LOW), ("high", planar.HIGH))
    }
    figure = style.new_figure(11.5)
    axes = figure.subplots(2, 2, height_ratios=(1.5, 1.0))
    for ax, name, thickness in zip(axes[0], runs, (planar.LOW, planar.HIGH), strict=True):
        run = runs[name]
        grid, values = planar.field(
            planar.density(thickness=thickness),
            planar.point(),
            limit=1.6,
            count=61 if settings.quick else 121,
        )
        style.draw_field(figure, ax, grid, values)
        style.draw_path(ax, run.q, label="motion")
        style.mark_start(ax, *planar.START)
        style.mark_goal(ax, *planar.GOAL)
        ax.set(xlim=(-1.6, 1.6), ylim=(-1.6, 1.6))
        peak = values.max()
        style.joint_axes(ax, title=f"({'ab'[name == 'high']}) ψ up to {peak:.3g} /m³")
    axes[0, 0].legend(loc="upper right")
    for ax, name in zip(axes[1], runs, strict=True):
        for j in range(2):
            ax.plot(runs[name].time, runs[name].acceleration[:, j], label=f"joint {j + 1}", linewidth=0.9)
        style.time_axes(ax, "acceleration [rad/s²]", legend=name == "low")
    drift = {
        name: energy_drift(run, thickness)
        for (name, run), thickness in zip(runs.items(), (planar.LOW, planar.HIGH), strict=True)
    }
    yield Figure(
        key="5.3",
        title="Pure geodesic motion",
        caption=Caption(
            shows="A free motion, aimed at the goal at 0.3 rad/s, bends away from the obstacle and does not "
            "reach the goal, which it does not know. (a) A low hill is climbed after some turns around it "
            f"(least clearance {1000 * planar.least_clearance(runs['low'].q):.0f} mm: contact). (b) A high "
            f"one is passed by ({1000 * planar.least_clearance(runs['high'].q):.0f} mm). Below: "
            "accelerations.",
            answers="Figure 5.3.",
            parameters=f"{_SETTING}; deviation out of the plane {planar.LOW:g} m (a), {planar.HIGH:g} m (b). "
            f"vᵀGv drifts by {drift['low']:.0e} and {drift['high']:.0e} (relative).",
            differs="The thesis shows one turn along the flank and over the end of the ridge. A geodesic "
            "keeps vᵀGv, so any finite hill can be climbed; how far it is pushed aside grows with the "
            "height, and the height depends on the unit of length and on the thickness of the links. Figure "
            "3.7's scale ends near 9.7, which is case (a).",
        ),
        drawing=figure,
        data={
            "time_s": runs["low"].time[::20],
            "q_low_rad": runs["low"].q[::20],
            "q_high_rad": runs["high"].q[::20],
            "acceleration_low": runs["low"].acceleration[::20],
            "acceleration_high": runs["high"].acceleration[::20],
        },
    )
    yield _heights(settings)


def energy_drift(run: Rollout, thickness: float) -> float:
    """Largest relative change of vᵀGv along a motion; a geodesic keeps it."""
    density = planar.density(thickness=thickness)
    rows = np.linspace(0, len(run.time) - 1, 300).astype(int)
    energy = []
    for k in rows:
        slope = density.evaluate(run.q[k], run.v[k], planar.point()).jacobian[0]
        energy.append(run.v[k] @ run.v[k] + (slope @ run.v[k]) ** 2)
    return float(np.abs(np.array(energy) / energy[0] - 1.0).max())


def _heights(settings: Settings) -> Table:
    """How many aimed geodesics pass without contact, by the height of ψ."""
    starts = starts_behind_the_obstacle(8 if settings.quick else 40, seed=settings.seed)
    thicknesses = (0.15, 0.05, 0.02, 0.01, 0.005)
    peaks, shares = [], []
    for thickness in thicknesses:
        settings.notify(f"5.3 geodesics, thickness {thickness:g} m")
        runs = [
            move(GeodesicOnly(), start=q, velocity=aimed(q), thickness=thickness, duration=40.0, period=2e-3)
            for q in starts
        ]
        clear = [planar.least_clearance(run.q, count=400) > 0.0 for run in runs]
        peaks.append(
            planar.density(thickness=thickness).evaluate([0.343, 0.0], [0, 0], planar.point()).values[0]
        )
        shares.append(float(np.mean(clear)))
    return Table(
        key="5.3-height",
        title="The height of ψ decides whether geodesics avoid",
        caption=Caption(
            shows="Share of geodesics, aimed at the goal from random configurations behind the obstacle, "
            "that pass it without contact in 40 s.",
            answers="The sentence of section 5.3 that the trajectory avoids the most non-linear regions.",
            parameters=f"{len(starts)} starts, seed {settings.seed}, {SPEED:g} rad/s; contact: a ball of "
            f"{100 * planar.OBSTACLE_RADIUS:g} cm touches a link {100 * planar.LINK_WIDTH:g} cm wide. "
            f"{_SETTING}.",
            differs="The thesis has no such table. It shows that the strength of the avoidance is a choice "
            "of units: nothing in chapters 2 to 5 says how large ψ must be.",
        ),
        columns=("deviation out of the plane [m]", "largest ψ [1/m³]", "pass without contact"),
        rows=tuple(
            (f"{t:g}", f"{p:.3g}", f"{100 * s:.0f} %")
            for t, p, s in zip(thicknesses, peaks, shares, strict=True)
        ),
        data={
            "thickness_m": np.array(thicknesses),
            "peak_per_m3": np.array(peaks),
            "share": np.array(shares),
        },
    )


def switching(settings: Settings) -> Iterator[Item]:
    """T5.4 against T5.6."""
    duration = 60.0
    unswitched = move(Unswitched(), duration=duration)
    switched = move(BinarySwitch(KAPPAS[-1]), duration=20.0, period=FINE)
    energies = {"unswitched": energy(unswitched), "switched": energy(switched)}
    figure = style.new_figure(12.0)
    axes = figure.subplots(2, 2, height_ratios=(1.5, 1.0))
    grid, values = planar.field(
        planar.density(), planar.point(), limit=1.6, count=61 if settings.quick else 121
    )
    for ax, run, title in (
        (axes[0, 0], unswitched, "(a) without switch (T5.4), 60 s"),
        (axes[0, 1], switched, f"(b) binary switch (T5.6), κ = {KAPPAS[-1]:g}, 20 s"),
    ):
        style.draw_field(figure, ax, grid, values)
        style.draw_path(ax, run.q, label="motion")
        style.mark_start(ax, *planar.START)
        style.mark_goal(ax, *planar.GOAL)
        ax.set(xlim=(-1.6, 1.6), ylim=(-1.6, 1.6))
        style.joint_axes(ax, title=title)
    axes[0, 0].legend(loc="upper right")
    for ax, run, name in zip(axes[1], (unswitched, switched), energies, strict=True):
        ax.plot(run.time, energies[name], color=style.BLUE)
        ax.set_ylim(bottom=0.0)
        style.time_axes(ax, "energy E [rad²/s²]")
    rest = float(np.linalg.norm(unswitched.q[-1] - planar.GOAL))
    gain = float(energies["switched"].max() / energies["switched"][0])
    yield Figure(
        key="5.4",
        title="With the spring, without and with a switch",
        caption=Caption(
            shows=f"(a) The motion all but stops in front of the obstacle: after {duration:g} s it is "
            f"{rest:.2f} rad from the goal, moves at {np.abs(unswitched.v[-1]).max():.0e} rad/s and has kept "
            f"{1000 * planar.least_clearance(unswitched.q):.0f} mm of clearance. (b) With the switch it "
            f"arrives, but through the obstacle ({1000 * planar.least_clearance(switched.q):.0f} mm), with "
            f"a peak of {np.abs(switched.v).max():.1f} rad/s and {gain:.0f} times its first energy. "
            "Below: E = ½(vᵀGv + K|q - q*|²).",
            answers="Figure 5.4.",
            parameters=f"{_SETTING}; semi-implicit Euler with {FINE:g} s (b), Runge-Kutta with 1 ms (a).",
            differs="(a) agrees with the thesis, but it is not a stop: the only point of rest of T5.4 is the "
            "goal, and the motion creeps on over the hill (errata 12). (b) in the thesis passes around the "
            "ridge. With correct derivatives the switch adds energy each time it opens, because the spring "
            "moves the arm without the geodesic term where ψ already has a slope.",
        ),
        drawing=figure,
        data={
            "time_unswitched_s": unswitched.time[::20],
            "q_unswitched_rad": unswitched.q[::20],
            "energy_unswitched": energies["unswitched"][::20],
            "time_switched_s": switched.time[::50],
            "q_switched_rad": switched.q[::50],
            "energy_switched": energies["switched"][::50],
        },
    )


def energy(run: Rollout, *, thickness: float = planar.LOW) -> Array:
    """½ (vᵀGv + K |q - q*|²): what T2.12 dissipates."""
    density = planar.density(thickness=thickness)
    slopes = np.array(
        [density.evaluate(q, v, planar.point()).jacobian[0] for q, v in zip(run.q, run.v, strict=True)]
    )
    kinetic = np.sum(run.v**2, axis=1) + np.einsum("ij,ij->i", slopes, run.v) ** 2
    energy: Array = 0.5 * (kinetic + planar.STIFFNESS * np.sum((run.q - planar.GOAL) ** 2, axis=1))
    return energy


def kappa(settings: Settings) -> Iterator[Item]:
    """The threshold of T5.5, and how much hangs on it."""
    runs = [move(BinarySwitch(k), duration=20.0, period=FINE) for k in KAPPAS]
    swept = np.geomspace(0.03, 8.0, 8 if settings.quick else 40)
    speeds, clearances = [], []
    for threshold in swept:
        run = move(BinarySwitch(float(threshold)), duration=10.0, period=FINE)
        speeds.append(float(np.abs(run.v).max()))
        clearances.append(planar.least_clearance(run.q, count=500))
    figure = style.new_figure(16.0)
    axes = figure.subplots(3, 2, height_ratios=(1.4, 1.4, 1.0))
    grid, values = planar.field(
        planar.density(), planar.point(), limit=1.6, count=61 if settings.quick else 121
    )
    for ax, run, k, letter in zip(axes.flat, runs, KAPPAS, "abc", strict=False):
        style.draw_field(figure, ax, grid, values)
        ax.contour(*grid, values, levels=[k], colors=style.BLACK, linewidths=0.7, linestyles="--")
        style.draw_path(ax, run.q, label="motion")
        ax.plot([], [], "--", color=style.BLACK, linewidth=0.7, label="ψ = κ")
        style.mark_start(ax, *planar.START)
        style.mark_goal(ax, *planar.GOAL)
        ax.set(xlim=(-1.6, 1.6), ylim=(-1.6, 1.6))
        style.joint_axes(ax, title=f"({letter}) κ = {k:g}, peak speed {np.abs(run.v).max():.1f} rad/s")
    axes[0, 1].legend(loc="upper right", fontsize=6)
    _task_picture(axes[1, 1], runs[-1], f"(d) task space, κ = {KAPPAS[-1]:g}")
    for ax, series, label in (
        (axes[2, 0], 1000.0 * np.array(clearances), "least clearance [mm]"),
        (axes[2, 1], np.array(speeds), "peak joint speed [rad/s]"),
    ):
        ax.semilogx(swept, series, "o-", color=style.BLUE, markersize=3)
        ax.set(xlabel="κ [1/m³]", ylabel=label)
    axes[2, 0].axhline(0.0, color=style.BLACK, linewidth=0.7, linestyle=":")
    axes[2, 0].text(swept[0], 2.0, "contact below", fontsize=7, va="bottom")
    touched = int(np.sum(np.array(clearances) < 0.0))
    yield Figure(
        key="5.5",
        title="Effect of the threshold κ",
        caption=Caption(
            shows="(a–c) The motion for three thresholds; dashed: where the switch acts. (d) The arm on the "
            f"way for κ = {KAPPAS[-1]:g}. Below: least clearance and peak speed over κ; {touched} of "
            f"{len(swept)} thresholds end in contact.",
            answers="Figure 5.5.",
            parameters=f"{_SETTING}; deviation out of the plane {planar.LOW:g} m, semi-implicit Euler with "
            f"{FINE:g} s, 20 s (below: 10 s).",
            differs="In the thesis κ = 0.3 and 0.5 pass around the obstacle. With correct derivatives no "
            "threshold avoids contact from this start, and a larger κ makes the motion faster, "
            "since the switch then opens on a steeper slope.",
        ),
        drawing=figure,
        data={
            "kappa": swept,
            "least_clearance_m": np.array(clearances),
            "peak_speed_rad_s": np.array(speeds),
        },
    )


def _task_picture(ax: object, run: Rollout, title: str) -> None:
    from matplotlib.axes import Axes

    assert isinstance(ax, Axes)
    distance = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(run.q, axis=0), axis=1))])
    for share in np.linspace(0.0, 1.0, 14):
        k = int(np.searchsorted(distance, share * distance[-1]))
        planar.draw_arm(ax, run.q[min(k, len(run.q) - 1)], alpha=0.25 + 0.6 * share, width=1.6)
    style.mark_start(ax, *planar.joints(planar.START)[-1], label="tip at start")
    style.mark_goal(ax, *planar.joints(planar.GOAL)[-1], label="tip at goal")
    style.mark_obstacle(ax, *planar.OBSTACLE[:2])
    planar.task_axes(ax, title=title)
    ax.set(xlim=(-2.1, 2.1), ylim=(-1.0, 2.1), yticks=[0.0, 1.0, 2.0])
    ax.legend(loc="lower center", ncols=3, fontsize=5.5, columnspacing=0.7, handletextpad=0.1)
