"""Figures 6.10 to 6.14 and the four criteria of section 6.2: torque control in MuJoCo."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from sidestep.drawing import style
from sidestep.scenario import Scenario, ScenarioResult, run_scenario
from sidestep.scenario.scenario import SwitchConfig
from sidestep.simulation import SimulationRun
from sidestep.thesis.reproduce.item import Caption, Figure, Item, Table
from sidestep.thesis.reproduce.registry import Settings
from sidestep.thesis.reproduce.scene3d import add_scene, tip_path
from sidestep.thesis.reproduce.seven_joints import KAPPA, SLOPE

FREE, CLUSTER, DIAGONAL = "thesis-6.2.2", "thesis-6.2.3", "thesis-6.2.4"
OTHER_SWITCHES = {
    "none": SwitchConfig("none"),
    "binary": SwitchConfig("binary", threshold=KAPPA),
    "sigmoid": SwitchConfig("sigmoid", threshold=KAPPA, slope=SLOPE),
}
_SETTING = (
    "Franka Research 3 without hand, MuJoCo with torque motors and the real meshes at 1 kHz, torque from the "
    "quadratic program; K = 0.5 /s², D = 1.5 /s, distance switch at (0.1, 0.1, 0.2, 0.2, 0.2, 0.2, 0.1) m, "
    "slope 20 /m, 2 Gaussians per link, balls of 3 cm that float until touched (the controller sees their "
    "centres)"
)


def simulated(settings: Settings) -> Iterator[Item]:
    """The three scenarios of section 6.2, and the last one under the other switches."""
    results: dict[tuple[str, str], ScenarioResult] = {}
    for name in (FREE, CLUSTER, DIAGONAL):
        settings.notify(f"{name} in MuJoCo")
        results[name, "distance"] = run_scenario(Scenario.load(name))
    if not settings.quick:
        for name in (CLUSTER, DIAGONAL):
            for switch, choice in OTHER_SWITCHES.items():
                settings.notify(f"{name}, switch: {switch}")
                scenario = Scenario.load(name)
                scenario = replace(scenario, system=replace(scenario.system, switch=choice))
                results[name, switch] = run_scenario(scenario)
    yield _first_and_last(results[FREE, "distance"])
    yield _tracking(results[FREE, "distance"])
    yield _sequence(
        "6.12",
        "Past a cluster of balls",
        "Figure 6.12.",
        {"distance switch": results[CLUSTER, "distance"]},
        "The thesis shows two pictures of a motion under the cluster; this one passes it with the clearance "
        "given above, measured on the exact meshes.",
    )
    yield _joint_four(results[CLUSTER, "distance"])
    diagonal = {"distance switch": results[DIAGONAL, "distance"]}
    if (DIAGONAL, "none") in results:
        diagonal["no switch"] = results[DIAGONAL, "none"]
    yield _sequence(
        "6.14",
        "The diagonal motion",
        "Figure 6.14.",
        diagonal,
        "The thesis reports avoidance and arrival. With correct derivatives its switch touches a ball and "
        "stops short of the goal; without a switch nothing is touched, but the motion all but stops "
        "before the balls.",
    )
    yield _criteria(results)


def _first_and_last(result: ScenarioResult) -> Figure:
    run = result.run
    figure = style.new_figure(7.4)
    add_scene(figure, (1, 2, 1), run.robot, run.q[0], title=f"(a) {run.time[0]:.1f} s")
    add_scene(
        figure,
        (1, 2, 2),
        run.robot,
        run.q[-1],
        title=f"(b) {run.time[-1]:.1f} s",
        tip_path=tip_path(run.robot, run.q),
        goal=run.goal,
    )
    return Figure(
        key="6.10",
        title="Without obstacles: first and last configuration",
        caption=Caption(
            shows=f"{result.sentence()} Blue: path of the tip.",
            answers="Figure 6.10.",
            parameters=_SETTING + "; start (0, 45, 0, -66, 0, 66, 45)°, goal (90, 45, 0, -66, 0, 66, 45)°.",
            differs="Same motion; MuJoCo in place of Bullet.",
        ),
        drawing=figure,
        data={"start_rad": run.q[0], "end_rad": run.q[-1]},
    )


def _tracking(result: ScenarioResult) -> Figure:
    run = result.run
    figure = style.new_figure(6.4)
    left, right = figure.subplots(1, 2)
    left.axhline(run.goal[0], color=style.BLACK, linestyle="--", linewidth=0.9, label="goal")
    left.plot(run.time, run.q[:, 0], color=style.VERMILLION, label="joint 1")
    style.time_axes(left, "angle [rad]", title="(a) q₁", legend=True)
    right.plot(run.time, run.wanted[:, 0], color=style.BLACK, linewidth=2.4, label="wanted")
    right.plot(run.time, run.achieved[:, 0], color=style.SKY, linewidth=1.0, label="achieved")
    style.time_axes(right, "acceleration [rad/s²]", title="(b) q₁''", legend=True)
    error = result.evaluation.max_tracking_error
    return Figure(
        key="6.11",
        title="Tracking without obstacles",
        caption=Caption(
            shows="Joint 1 goes to its goal; the simulated arm has the acceleration that the dynamical "
            f"system wants (largest difference over all joints {error:.0e} rad/s²).",
            answers="Figure 6.11.",
            parameters=_SETTING + ".",
            differs="Same curves. The quadratic program has gravity and Coriolis terms with their right "
            "signs (errata 10), and with a full model in both places the tracking is exact up to rounding.",
        ),
        drawing=figure,
        data={"time_s": run.time, "q_rad": run.q, "wanted": run.wanted, "achieved": run.achieved},
    )


def _sequence(key: str, title: str, answers: str, results: dict[str, ScenarioResult], differs: str) -> Figure:
    rows = len(results)
    section = next(iter(results.values())).scenario.name.removeprefix("thesis-")
    figure = style.new_figure(0.6 + 5.2 * rows)
    data = {}
    for row, (mode, result) in enumerate(results.items()):
        run = result.run
        moved = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(run.q, axis=0)).sum(axis=1))])
        path = tip_path(run.robot, run.q)
        for column, share in enumerate((0.0, 0.5, 1.0)):
            k = min(int(np.searchsorted(moved, share * moved[-1])), len(run) - 1)
            add_scene(
                figure,
                (rows, 3, 3 * row + column + 1),
                run.robot,
                run.q[k],
                objects=run.objects,
                object_poses=run.object_poses[k],
                title=f"{mode}, {run.time[k]:.1f} s" if column == 0 else f"{run.time[k]:.1f} s",
                tip_path=path,
                goal=run.goal,
                view=(20.0, 60.0),
                labelled=False,
            )
        data[f"q_rad, {mode}"] = run.q[::10]
        data[f"time_s, {mode}"] = run.time[::10]
    return Figure(
        key=key,
        title=title,
        caption=Caption(
            shows=" ".join(f"With {mode}: {result.sentence()}" for mode, result in results.items())
            + " Pictures at equal shares of the way; one square of the grid is 0.4 m; blue: path of the tip, "
            "disc and star: tip at start and goal.",
            answers=answers,
            parameters=f"{_SETTING}; obstacles, start and goal of section {section}.",
            differs=differs,
        ),
        drawing=figure,
        data=data,
    )


def _joint_four(result: ScenarioResult) -> Figure:
    run = result.run
    figure = style.new_figure(6.4)
    left, right = figure.subplots(1, 2)
    left.axhline(run.goal[3], color=style.BLACK, linestyle="--", linewidth=0.9, label="goal")
    left.plot(run.time, run.q[:, 3], color=style.VERMILLION, label="joint 4")
    style.time_axes(left, "angle [rad]", title="(a) q₄")
    left.legend(loc="lower left")
    right.plot(run.time, run.wanted[:, 3], color=style.BLACK, linewidth=2.4, label="wanted")
    right.plot(run.time, run.achieved[:, 3], color=style.SKY, linewidth=1.0, label="achieved")
    style.time_axes(right, "acceleration [rad/s²]", title="(b) q₄''", legend=True)
    deviation = float(np.abs(run.q[:, 3] - run.goal[3]).max())
    return Figure(
        key="6.13",
        title="Joint 4 on the way past the cluster",
        caption=Caption(
            shows=f"Joint 4, which would not move on the straight path, leaves it by up to {deviation:.2f} rad.",
            answers="Figure 6.13.",
            parameters=_SETTING + "; scenario of section 6.2.3.",
            differs="Same behaviour: the forearm folds to pass the balls.",
        ),
        drawing=figure,
        data={"time_s": run.time, "q4_rad": run.q[:, 3], "wanted": run.wanted[:, 3]},
    )


def _criteria(results: dict[tuple[str, str], ScenarioResult]) -> Table:
    rows = []
    for (name, switch), result in results.items():
        found = result.evaluation
        assert isinstance(result.run, SimulationRun)
        clearance = "-" if found.min_clearance_m is None else f"{1000 * found.min_clearance_m:.1f} mm"
        pushed = ", ".join(found.moved_objects) or "none"
        tracking = "-" if found.max_tracking_error is None else f"{found.max_tracking_error:.1e}"
        limits = [
            kind for kind in ("position", "velocity", "acceleration", "torque") if getattr(found.limits, kind)
        ]
        rows.append(
            (
                name.removeprefix("thesis-"),
                switch,
                f"{'yes' if found.reached else 'no'} ({found.position_error_rad:.3f} rad)",
                f"{found.path_deviation_rad:.2f} rad",
                f"{'yes' if found.collision_free else 'no'} ({clearance}; pushed: {pushed})",
                tracking,
                ", ".join(limits) or "none",
            )
        )
    return Table(
        key="6.2-criteria",
        title="The four criteria of section 6.2",
        caption=Caption(
            shows="1: does the arm arrive; 2: how far it leaves the straight path in joint space; 3: is it "
            "free of contact (least clearance between the exact meshes, between samples too; balls that "
            "moved); 4: largest difference between wanted and achieved acceleration [rad/s²]; limits "
            "exceeded.",
            answers="The list of conditions in section 6.2, which the thesis checks by eye.",
            parameters=_SETTING + f"; binary and sigmoid: κ = {KAPPA:g} /m³, slope {SLOPE:g} m³.",
            differs="The thesis reports success for all three scenarios. Ours: see the rows. After a "
            "contact the fourth criterion fails too, since the ball pushes back.",
        ),
        columns=(
            "scenario",
            "switch",
            "1 arrives",
            "2 leaves the path by",
            "3 free of contact",
            "4 tracking error",
            "limits exceeded",
        ),
        rows=tuple(rows),
    )
