"""Figures 6.1 to 6.8, B.1 and B.2: the seven-joint arm under the three switches, integrated without "
"physics."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from sidestep import ExactClearance
from sidestep.drawing import style
from sidestep.scenario.assembly import Assembly, assemble
from sidestep.scenario.scenario import Scenario
from sidestep.system import GeometricSystem
from sidestep.thesis import (
    BinarySwitch,
    CollisionDensity,
    DistanceSwitch,
    JointLimitPotential,
    Rollout,
    SigmoidSwitch,
    Sum,
    Unswitched,
    rollout,
)
from sidestep.thesis.reproduce.item import Caption, Figure, Item, Table
from sidestep.thesis.reproduce.registry import Settings
from sidestep.thesis.reproduce.scene3d import add_scene, tip_path

SCENARIO = "thesis-6.2.4"
PERIOD, DURATION = 1e-3, 30.0  # [s]; the thesis: 0.01 s and 3000 steps
KAPPA, SLOPE = 0.5, 10.0  # [1/m³], [m³]: threshold of figure 6.4; slope read off figure 6.6a
THRESHOLDS = (0.1, 0.1, 0.2, 0.2, 0.2, 0.2, 0.1)  # [m] section 6.2.2
DISTANCE_SLOPE = 20.0  # [1/m]
CLEARANCE_SAMPLES = 300
_SETTING = (
    "Start (0, 80, 0, -30, 0, 66, 45)°, goal (100, 10, 0, -66, 0, 66, 45)°, obstacle points (0.3, 0.23, "
    "0.42), (0.2, 0.51, 0.75), (0.2, 0.51, 0.55) m; Franka Research 3 without hand, 2 Gaussians per link, K "
    "= 0.5 /s², D = 1.5 /s, ζ of slope 30 /rad and height 1; semi-implicit Euler with 1 ms, 30 s, no physics"
)
Switch = Unswitched | BinarySwitch | SigmoidSwitch | DistanceSwitch


@dataclass(frozen=True, eq=False)
class Motion:
    """A run of one switch and how it is judged.

    Attributes:
        run: every step.
        clearance: least exact distance to the balls of the scenario [m] at CLEARANCE_SAMPLES instants.
        error: largest joint error at the end [rad].
    """

    run: Rollout
    clearance: float
    error: float


def switches(settings: Settings) -> Iterator[Item]:
    """Everything of section 6.1 from four runs."""
    parts = assemble(Scenario.load(SCENARIO))
    modes: dict[str, Switch] = {
        "unswitched": Unswitched(),
        "binary": BinarySwitch(KAPPA),
        "sigmoid": SigmoidSwitch(KAPPA, SLOPE),
        "distance": DistanceSwitch(list(THRESHOLDS), DISTANCE_SLOPE),
    }
    motions = {}
    for name, switch in modes.items():
        settings.notify(f"6.1 {name}")
        motions[name] = _move(parts, switch)
    yield _configurations(parts, motions)
    yield _angles("6.2", "binary", "Joint angles, binary switch", "Figure 6.2.", parts, motions)
    yield _rates("6.3", "binary", "Velocities and accelerations, binary switch", "Figure 6.3.", motions)
    yield _weights("6.4", "binary", "Weight of the spring, binary switch", "Figure 6.4.", motions)
    yield _rates("6.5", "sigmoid", "Velocities and accelerations, sigmoid switch", "Figure 6.5.", motions)
    yield _weights("6.6", "sigmoid", "Weight of the spring, sigmoid switch", "Figure 6.6.", motions)
    yield _rates("6.7", "distance", "Velocities and accelerations, distance switch", "Figure 6.7.", motions)
    yield _weights("6.8", "distance", "Weights of the spring, distance switch", "Figure 6.8.", motions)
    yield _angles("B.1", "sigmoid", "Joint angles, sigmoid switch", "Figure B.1.", parts, motions)
    yield _angles("B.2", "distance", "Joint angles, distance switch", "Figure B.2.", parts, motions)
    yield _summary(motions)


def _move(parts: Assembly, switch: Switch) -> Motion:
    system = GeometricSystem(
        [Sum([CollisionDensity(parts.robot, parts.body), JointLimitPotential(parts.robot)])],
        stiffness=0.5,
        damping=1.5,
        switch=switch,
    )
    assert not callable(parts.seen)
    run = rollout(
        system,
        parts.start,
        np.zeros(7),
        parts.goal,
        parts.seen,
        period=PERIOD,
        steps=round(DURATION / PERIOD),
    )
    exact = ExactClearance(parts.robot, parts.objects)
    rows = np.unique(np.linspace(0, len(run.q) - 1, CLEARANCE_SAMPLES).round().astype(int))
    clearance = min(exact.distance(run.q[k]).distance for k in rows if np.isfinite(run.q[k]).all())
    return Motion(run, clearance, float(np.abs(run.q[-1] - parts.goal).max()))


def _verdict(motion: Motion) -> str:
    arrival = "arrives" if motion.error < 0.05 else f"ends {motion.error:.2f} rad from the goal"
    touch = "touches a ball" if motion.clearance < 0.0 else "touches nothing"
    return f"The motion {arrival} and {touch} (least clearance {1000 * motion.clearance:.0f} mm)."


def _limits_left(parts: Assembly, motion: Motion) -> str:
    """A sentence on the joints that leave their limits, or nothing."""
    limits = parts.robot.limits
    outside = np.any((motion.run.q < limits.lower) | (motion.run.q > limits.upper), axis=0)
    names = ", ".join(str(j + 1) for j in np.flatnonzero(outside))
    return (
        f" It leaves the limits of joint {names}, which ζ alone does not keep (errata 14)." if names else ""
    )


def _configurations(parts: Assembly, motions: Mapping[str, Motion]) -> Figure:
    figure = style.new_figure(7.4)
    path = tip_path(parts.robot, motions["unswitched"].run.q)
    add_scene(figure, (1, 2, 1), parts.robot, parts.start, objects=parts.objects, title="(a) start")
    add_scene(
        figure,
        (1, 2, 2),
        parts.robot,
        parts.goal,
        objects=parts.objects,
        title="(b) goal",
        tip_path=path,
        goal=parts.goal,
    )
    return Figure(
        key="6.1",
        title="The scenario of section 6.1",
        caption=Caption(
            shows="Start and goal of the arm, and the balls in between; blue: path of the tip in the "
            f"unswitched motion. {_verdict(motions['unswitched'])}",
            answers="Figure 6.1.",
            parameters=_SETTING + "; balls of 3 cm for judging contact.",
            differs="The thesis does not state the numbers behind figure 6.1; those of section 6.2.4 give "
            "its start and goal angles. Unswitched motion is not shown there.",
        ),
        drawing=figure,
        data={"start_rad": parts.start, "goal_rad": parts.goal, "tip_path_unswitched_m": path},
    )


def _angles(
    key: str, mode: str, title: str, answers: str, parts: Assembly, motions: Mapping[str, Motion]
) -> Figure:
    motion = motions[mode]
    figure = style.new_figure(11.5)
    axes = figure.subplots(2, 4, sharex=True)
    for j, ax in enumerate(axes.flat):
        if j == 7:
            ax.axis("off")
            ax.legend(*axes.flat[0].get_legend_handles_labels(), loc="center")
            break
        ax.axhline(parts.goal[j], color=style.BLACK, linestyle="--", linewidth=0.9, label="goal")
        ax.plot(motion.run.time, motion.run.q[:, j], color=style.VERMILLION, label="joint angle")
        ax.plot(
            0.0, parts.start[j], "o", color=style.GREEN, markeredgecolor="k", label="start", clip_on=False
        )
        ax.set_ylim(min(-3.1, motion.run.q.min() - 0.2), max(3.1, motion.run.q.max() + 0.2))
        ax.set_title(f"joint {j + 1}")
        if j % 4 == 0:
            ax.set_ylabel("angle [rad]")
        if j >= 3:
            ax.set_xlabel("time [s]")
            ax.tick_params(labelbottom=True)
        ax.margins(x=0.0)
    return Figure(
        key=key,
        title=title,
        caption=Caption(
            shows=_verdict(motion) + _limits_left(parts, motion),
            answers=answers,
            parameters=f"{_SETTING}; {_switch_words(mode)}.",
            differs=_difference(mode, motion),
        ),
        drawing=figure,
        data={"time_s": motion.run.time[::10], "q_rad": motion.run.q[::10]},
    )


def _rates(key: str, mode: str, title: str, answers: str, motions: Mapping[str, Motion]) -> Figure:
    run = motions[mode].run
    figure = style.new_figure(6.8)
    left, right = figure.subplots(1, 2)
    for j in range(7):
        left.plot(run.time, run.v[:, j], color=style.JOINT_COLOURS[j], linewidth=0.9, label=f"joint {j + 1}")
        right.plot(run.time, run.acceleration[:, j], color=style.JOINT_COLOURS[j], linewidth=0.9)
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=7)
    style.time_axes(left, "joint velocity [rad/s]", title="(a) velocities")
    style.time_axes(right, "joint acceleration [rad/s²]", title="(b) accelerations")
    return Figure(
        key=key,
        title=title,
        caption=Caption(
            shows=f"Velocities up to {np.abs(run.v).max():.2f} rad/s, accelerations up to "
            f"{np.abs(run.acceleration).max():.2f} rad/s². {_verdict(motions[mode])}",
            answers=answers,
            parameters=f"{_SETTING}; {_switch_words(mode)}.",
            differs=_difference(mode, motions[mode]),
        ),
        drawing=figure,
        data={
            "time_s": run.time[::10],
            "v_rad_s": run.v[::10],
            "acceleration_rad_s2": run.acceleration[::10],
        },
    )


def _weights(key: str, mode: str, title: str, answers: str, motions: Mapping[str, Motion]) -> Figure:
    run = motions[mode].run
    figure = style.new_figure(6.4)
    if mode == "sigmoid":
        first, second = figure.subplots(1, 2)
        _sigmoid(first)
        second.set_title("(b) over time")
    else:
        second = figure.subplots()
    if mode == "distance":
        for j in range(7):
            second.plot(run.time, run.switch[:, j], color=style.JOINT_COLOURS[j], label=f"joint {j + 1}")
        second.legend(ncols=2)
    else:
        second.plot(run.time, run.switch[:, 0], color=style.BLUE)
    second.set(xlabel="time [s]", ylabel="weight σ of the spring [-]", ylim=(-0.05, 1.05))
    second.margins(x=0.0)
    changes = int(np.sum(np.abs(np.diff(run.switch[:, 0] > 0.5))))
    return Figure(
        key=key,
        title=title,
        caption=Caption(
            shows="1: spring and damper act; 0: geodesic alone, which knows no goal and has no damping. "
            + (
                f"The weight crosses one half {'once' if changes == 1 else f'{changes} times'}."
                if mode != "distance"
                else f"The least weight is {run.switch.min():.2f}, at the end the weights are "
                f"{', '.join(f'{s:.2f}' for s in run.switch[-1])}."
            ),
            answers=answers,
            parameters=f"{_SETTING}; {_switch_words(mode)}.",
            differs=_difference(mode, motions[mode]),
        ),
        drawing=figure,
        data={"time_s": run.time[::10], "weight": run.switch[::10], "psi_per_m3": run.values[::10, 0]},
    )


def _sigmoid(ax: Axes) -> None:
    psi = np.linspace(0.0, 2.0, 200)
    ax.plot(psi, 1.0 - 1.0 / (1.0 + np.exp(-SLOPE * (psi - KAPPA))), color=style.BLUE)
    ax.axvline(KAPPA, color=style.BLACK, linestyle=":", linewidth=0.8)
    ax.text(KAPPA + 0.04, 0.95, "κ")
    ax.set(xlabel="ψ [1/m³]", ylabel="weight σ [-]", title="(a) over ψ", ylim=(-0.05, 1.05))


def _switch_words(mode: str) -> str:
    return {
        "binary": f"binary switch at κ = {KAPPA:g} /m³",
        "sigmoid": f"sigmoid switch at κ = {KAPPA:g} /m³, slope {SLOPE:g} m³",
        "distance": f"distance switch at {THRESHOLDS} m, slope {DISTANCE_SLOPE:g} /m",
    }[mode]


def _difference(mode: str, motion: Motion) -> str:
    end = "arrives" if motion.error < 0.05 else "does not arrive"
    common = {
        "binary": "The thesis's motion arrives, with bursts of velocity and a weight that flickers. With "
        "correct derivatives the geodesic mode carries the arm off without a pull back to the goal.",
        "sigmoid": "The thesis's motion arrives, with bursts of velocity. With correct derivatives the "
        "smoother weight changes little: past κ there is neither spring nor damper.",
        "distance": "The thesis's motion arrives smoothly. With correct derivatives it is as smooth, but "
        "attraction and damping fade where they are needed, and the links go through the balls.",
    }[mode]
    touch = "" if motion.clearance < 0.0 else " Here nothing is touched."
    gaussians = "The number of Gaussians, which the thesis does not state, may play a part."
    return f"{common} Ours {end}.{touch} {gaussians}"


def _summary(motions: Mapping[str, Motion]) -> Table:
    rows: list[tuple[str, ...]] = []
    data: dict[str, list[float]] = {
        key: [] for key in ("clearance_m", "error_rad", "peak_speed_rad_s", "peak_psi_per_m3")
    }
    for name, motion in motions.items():
        run = motion.run
        values = (motion.clearance, motion.error, np.abs(run.v).max(), run.values.max())
        for key, value in zip(data, values, strict=True):
            data[key].append(value)
        rows.append(
            (
                name,
                "yes" if motion.error < 0.05 else "no",
                f"{motion.error:.3f}",
                f"{1000 * motion.clearance:.0f}",
                f"{values[2]:.2f}",
                f"{values[3]:.0f}" if values[3] >= 100.0 else f"{values[3]:.2f}",
            )
        )
    return Table(
        key="6.1-switches",
        title="The switches of section 6.1 side by side",
        caption=Caption(
            shows="How the same motion ends under each switch.",
            answers="What section 6.1 shows in figures 6.2 to 6.8.",
            parameters=_SETTING + "; clearance: exact meshes against balls of 3 cm.",
            differs="The thesis reports that all three switches arrive; it does not check contact here.",
        ),
        columns=(
            "switch",
            "arrives in 30 s",
            "joint error [rad]",
            "least clearance [mm]",
            "peak speed [rad/s]",
            "largest ψ [1/m³]",
        ),
        rows=tuple(rows),
        data={key: np.array(values) for key, values in data.items()},
    )
