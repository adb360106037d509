"""The picture of what a controller believes of a source of obstacles, from a run; see make.py."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from figures import save
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import sidestep as ss
from sidestep.drawing.palette import BLACK, BLUE, ORANGE, SKY, VERMILLION

PERIOD, DURATION = 1e-3, 6.0  # [s]
SPEED = 0.25  # of the ball [m/s]
DELAY = 0.1  # from the capture of a set to its arrival [s]
SET = 0.05  # between two captures [s]
SILENT, BACK, GONE = 1.2, 2.2, 3.2  # the tracker fails, comes again, and sees nothing any more [s]


@dataclass
class Run:
    """A run of a controller whose tracker fails: a row for each step."""

    time: list[float] = field(default_factory=list)
    believed: list[float] = field(default_factory=list)  # place of the ball [m]; NaN: none
    reach: list[float] = field(default_factory=list)  # by which an overdue ball counts as larger [m]
    age: list[float] = field(default_factory=list)  # of the source [s]
    speed: list[float] = field(default_factory=list)  # of the fastest joint [rad/s]
    stale: list[bool] = field(default_factory=list)
    sets: list[tuple[float, float]] = field(default_factory=list)  # capture [s], place [m]
    valid_for: float = 0.0  # [s]


def place(time: Any) -> Any:
    """Of the ball at times [s], on its way past the arm [m]."""
    return -0.4 + SPEED * time


def tracked() -> Run:
    """An arm turns while a tracker tells of a ball, fails, comes again, and sees nothing any more."""
    arm = ss.Arm.load("planar3")
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True))
    largest = controller.settings.sources.largest_speed
    q, v, run = np.array([-0.8, 0.4, 0.4]), np.zeros(3), Run()
    for step in range(round(DURATION / PERIOD)):
        captured = step * PERIOD - DELAY
        if step % round(SET / PERIOD) == 0 and captured >= 0.0 and not SILENT < captured + DELAY < BACK:
            seen = ss.Obstacles.none()
            if captured + DELAY < GONE:
                seen = ss.Obstacles([[1.9, place(captured), 0.0]], velocities=[[0.0, SPEED, 0.0]])
                run.sets.append((captured, place(captured)))
            controller.set_obstacles(seen, source="tracker", time=captured)
        controller.set_velocity([0.3, 0.0, 0.0])
        command = controller.step(q, v)
        q, v = command.position, command.velocity
        (source,) = controller.sources or (None,)
        if source is None:  # nothing was set yet
            continue
        run.valid_for = max(run.valid_for, source.valid_for)
        run.time.append(step * PERIOD)
        run.believed.append(controller.obstacles.points[0, 1] if source.size else np.nan)
        run.reach.append(largest * max(0.0, source.age - source.valid_for) if source.size else 0.0)
        run.age.append(source.age)
        run.speed.append(np.abs(v).max())
        run.stale.append(command.status == ss.SafetyStatus.stale)
    return run


def believes() -> None:
    """What is believed of a ball while its tracker fails: its place, the age of the source, the speed of the arm."""
    run = tracked()
    time, stale, believed = np.array(run.time), np.array(run.stale), np.array(run.believed)
    changes = time[np.flatnonzero(np.diff(stale)) + 1]
    figure = Figure(figsize=(9.0, 5.4), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    above, middle, below = axes = list(figure.subplots(3, 1, sharex=True, height_ratios=(3.2, 1.2, 1.2)))
    above.plot(time, place(time), "--", color="0.5", linewidth=1.2, label="where the ball is")
    above.plot(
        *np.array(run.sets).T, ".", color=BLACK, markersize=4, label="where the tracker saw it, and when"
    )
    above.plot(time, believed, color=BLUE, linewidth=2, label="where the controller believes it is")
    above.fill_between(
        time,
        believed - run.reach,
        believed + run.reach,
        color=SKY,
        alpha=0.3,
        linewidth=0,
        label="where it could be by now",
    )
    above.set(ylabel="place [m]", ylim=(-1.25, 1.25), xlim=(0.0, DURATION))
    above.legend(fontsize=8, frameon=False, loc="lower left", ncols=2)
    for begin, end, text in (
        (0.0, SILENT, f"sets arrive, {DELAY:g} s late"),
        (SILENT, BACK, "the tracker is silent"),
        (BACK, GONE, "it sends again"),
        (GONE, changes[-1], "it sends empty sets"),
        (changes[-1], DURATION, "believed empty"),
    ):
        above.text(0.5 * (begin + end), 1.12, text, ha="center", fontsize=8)
    for words, at, to in (
        (
            "valid_for reached:\nit stands still,\nits reach grows",
            (1.26, 0.45),
            (changes[0], np.interp(changes[0], time, believed)),
        ),
        ("moved on\nto now", (0.15, 0.25), (0.6, place(0.6))),
        (
            f"empty for {changes[-1] - GONE:.0f} s",
            (4.1, 0.05),
            (changes[-1], place(GONE + run.valid_for - DELAY)),
        ),
    ):
        above.annotate(
            words, to, at, fontsize=8, color="0.25", arrowprops={"arrowstyle": "->", "color": "0.4"}
        )
    middle.plot(time, run.age, color=ORANGE)
    middle.axhline(run.valid_for, color=VERMILLION, linewidth=1, linestyle="--")
    middle.text(0.05, run.valid_for + 0.1, "valid_for", fontsize=8, color=VERMILLION)
    middle.set(ylabel="age of the\nsource [s]", ylim=(0.0, None))
    below.plot(time, run.speed, color=BLUE)
    below.set(ylabel="speed of\nthe arm [rad/s]", xlabel="time [s]", ylim=(0.0, None))
    for ax in axes:
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(labelsize=8)
        ax.yaxis.label.set_size(9)
        ax.xaxis.label.set_size(9)
        for begin, end in zip(changes[::2], changes[1::2], strict=True):
            ax.axvspan(begin, end, color=VERMILLION, alpha=0.1, linewidth=0)
        for when in (SILENT, BACK, GONE, changes[-1]):
            ax.axvline(when, color="0.8", linewidth=0.8, zorder=0)
    for begin, end in zip(changes[::2], changes[1::2], strict=True):
        below.text(
            0.5 * (begin + end),
            0.8 * max(run.speed),
            "the arm stops",
            ha="center",
            fontsize=8,
            color=VERMILLION,
        )
    save(figure, "believes")
