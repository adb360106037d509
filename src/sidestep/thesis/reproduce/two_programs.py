"""Figure 6.9: controller and simulator as two programs, and the scenarios of section 6.2 across them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from sidestep.drawing import style
from sidestep.scenario import Scenario
from sidestep.scenario.assembly import assemble
from sidestep.scenario.two_programs import TwoProgramsRun, run_in_two_programs
from sidestep.simulation.link import Link
from sidestep.thesis.reproduce.item import Caption, Figure, Item
from sidestep.thesis.reproduce.registry import Settings
from sidestep.thesis.reproduce.simulated import CLUSTER, DIAGONAL, FREE

LATE = Link(delay=(0.001, 0.005), jitter=0.0005, loss=0.1)


def two_programs(settings: Settings) -> Iterator[Item]:
    """The two programs, and joint angles of the three scenarios over a perfect and over a bad connection."""
    names = (CLUSTER,) if settings.quick else (FREE, CLUSTER, DIAGONAL)
    runs: dict[str, dict[str, TwoProgramsRun]] = {}
    for name in names:
        scenario = replace(Scenario.load(name), method="controller")
        runs[name] = {}
        for words, link in (("at once", Link()), ("late and lossy", replace(LATE, seed=settings.seed))):
            settings.notify(f"{name} in two programs, messages {words}")
            runs[name][words] = run_in_two_programs(scenario, assemble(scenario), link=link)
    figure = style.new_figure(10.6)
    parts: Any = figure.subfigures(2, 1, height_ratios=(1.0, 1.25))
    above, below = parts
    _draw_programs(above.subplots())
    axes = below.subplots(1, len(names), squeeze=False)[0]
    for ax, (name, both) in zip(axes, runs.items(), strict=True):
        _draw_motion(ax, name.removeprefix("thesis-"), both)
    axes[0].set_ylabel("joint angles [rad]")
    yield Figure(
        key="6.9",
        title="Controller and simulator as two programs",
        caption=Caption(
            shows="Above: what each program does in a cycle of 1 ms, and the messages between them. Below: all joints "
            "of the scenarios of section 6.2 across the two programs; lines: messages arrive at once; dots: they are "
            "late and some are lost. " + " ".join(_sentence(name, both) for name, both in runs.items()),
            answers="Figure 6.9.",
            parameters="Franka Research 3 without hand; the Controller with its defaults, torque; MuJoCo at 1 kHz in a "
            "process of its own (`sidestep simulate`, as fast as it is asked). Late: 1 to 5 ms in each direction, "
            "drawn once a second, 0.5 ms of jitter, 10 % of the messages lost in each direction.",
            differs="The thesis shows the structure alone. Here the two programs are the loop of the Controller and "
            "`sidestep simulate` over a local socket, and the Controller moves the arm, not the method as written.",
        ),
        drawing=figure,
        data={
            f"{column}, {name}, {words}": values
            for name, both in runs.items()
            for words, run in both.items()
            for column, values in (("time_s", run.time), ("q_rad", run.q))
        },
    )


def _draw_programs(ax: Any) -> None:
    """Two boxes with what happens in a cycle, and the messages as arrows."""
    ax.set(xlim=(0.0, 16.0), ylim=(0.0, 4.4))
    ax.axis("off")
    boxes = (
        (
            0.2,
            "Program 1: the controller",
            ("goal, obstacles", "reads the state", "Controller.step", "writes the torque"),
        ),
        (
            10.6,
            "Program 2: the simulator",
            ("takes the torque", "adds gravity", "MuJoCo: a step of 1 ms", "says the state"),
        ),
    )
    for left, title, lines in boxes:
        ax.add_patch(
            FancyBboxPatch(
                (left, 0.4), 5.2, 3.6, boxstyle="round,pad=0.0,rounding_size=0.2",
                facecolor="white", edgecolor=style.BLACK, linewidth=1.0,
            )
        )  # fmt: skip
        ax.text(left + 2.6, 3.55, title, ha="center", va="center", fontweight="bold")
        for row, line in enumerate(lines):
            ax.text(left + 2.6, 2.85 - 0.62 * row, line, ha="center", va="center", fontsize=7.5)
    messages = (
        (10.6, 5.4, 2.75, "state: $q$, $\\dot q$, torque, time", style.BLUE),
        (5.4, 10.6, 1.35, "command: torque without gravity", style.VERMILLION),
    )
    for start, end, height, words, colour in messages:
        ax.add_patch(
            FancyArrowPatch((start, height), (end, height), arrowstyle="-|>", mutation_scale=12, color=colour)
        )
        ax.text(8.0, height + 0.28, words, ha="center", va="bottom", color=colour)
    for height, words in ((0.85, "local socket, 1 kHz;"), (0.5, "late and lossy on request")):
        ax.text(8.0, height, words, ha="center", va="center", fontsize=7.0)


def _draw_motion(ax: Any, title: str, both: dict[str, TwoProgramsRun]) -> None:
    for run, line in zip(both.values(), ("-", ":"), strict=True):
        for joint, colour in zip(range(run.q.shape[1]), style.JOINT_COLOURS, strict=False):
            ax.plot(run.time, run.q[:, joint], line, color=colour, linewidth=1.1 if line == "-" else 1.6)
    style.time_axes(ax, "", title=f"section {title}")


def _sentence(name: str, both: dict[str, TwoProgramsRun]) -> str:
    ends = ", ".join(
        f"{run.report.end.name} after {_seconds(run):.2f} s with {run.found['contacts']} contacts ({words})"
        for words, run in both.items()
    )
    return f"{name.removeprefix('thesis-')}: {ends}."


def _seconds(run: TwoProgramsRun) -> float:
    """Until the arm had arrived [s], or of the whole motion."""
    return float(run.time[-1]) if run.time_to_goal is None else run.time_to_goal
