"""Figures of a recorded run over time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from sidestep.drawing.palette import BLACK, BLUE, GREEN, ORANGE, PURPLE, SERIES, SKY, VERMILLION, YELLOW
from sidestep.report.recorded_arrays import RecordedArrays

Array = npt.NDArray[np.float64]

WIDTH = 9.0  # [inch]
MOST_LINKS = 6  # lines that can be told apart
MOST_POINTS = 4000  # of a line: more than a page has columns; the extremes of what lies between are kept
STATUS_COLOURS = {
    "ok": GREEN,
    "limited": SKY,
    "relaxed": YELLOW,
    "margin_lost": ORANGE,
    "tracking_lost": PURPLE,
    "stale": "0.6",
    "stopping": "0.3",
    "clearance_lost": VERMILLION,
}
ACTIVITY_COLOURS = {
    "no_goal": "0.85",
    "moving": BLUE,
    "waiting": YELLOW,
    "arrived": GREEN,
    "blocked": VERMILLION,
    "stale": "0.6",
}


def overview(run: RecordedArrays) -> Figure:
    """Everything in one picture: status, activity, clearance by link, velocity and torque as shares of their limits."""
    panels: list[tuple[Callable[[RecordedArrays, Axes], None], float]] = [
        (draw_status, 0.55),
        (draw_clearance, 2.2),
        (draw_velocity, 1.9),
    ]
    if has_torque(run):
        panels.append((draw_torque, 1.9))
    heights = [height for _, height in panels]
    figure = Figure(figsize=(WIDTH, sum(heights) + 1.1), layout="constrained")
    grid = figure.subplots(len(panels), 1, sharex=True, squeeze=False, height_ratios=heights).ravel()
    for (draw, _), axes in zip(panels, grid, strict=True):
        draw(run, axes)
    grid[-1].set_xlabel("time [s]", fontsize=9)
    figure.suptitle(f"{run.arm.name}: {len(run):,} steps, {run.duration:.2f} s", fontsize=10)
    return figure


def single(run: RecordedArrays, draw: Callable[[RecordedArrays, Axes], None], height: float = 2.6) -> Figure:
    """One of the panels as a picture of its own."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    axes = figure.subplots()
    draw(run, axes)
    axes.set_xlabel("time [s]", fontsize=9)
    return figure


def has_torque(run: RecordedArrays) -> bool:
    """Whether torques were commanded, and have limits."""
    return bool(np.isfinite(run.arm.robot.limits.effort).any() and np.any(run.torque != 0.0))


def draw_status(run: RecordedArrays, axes: Axes) -> None:
    """Status above, activity below, as bands."""
    _band(run.time, run.status, STATUS_COLOURS, axes, 1.0)
    _band(run.time, run.activity, ACTIVITY_COLOURS, axes, 0.0)
    axes.set_ylim(0.0, 2.0)
    axes.set_yticks([0.5, 1.5], ["activity", "status"])
    axes.tick_params(axis="y", length=0)
    bands = ((run.status, STATUS_COLOURS), (run.activity, ACTIVITY_COLOURS))
    columns = [
        [
            Patch(color=colours[name], label=name.replace("_", " "))
            for name in colours
            if (names == name).any()
        ]
        for names, colours in bands
    ]
    most = max(map(len, columns))
    none = Patch(alpha=0.0, label=" ")
    shown = [patch for column in columns for patch in column + [none] * (most - len(column))]
    _legend(axes, shown)
    _tidy(axes, run)
    axes.grid(visible=False)


def draw_clearance(run: RecordedArrays, axes: Axes) -> None:
    """Clearance of the links that come nearest, and the least of every step."""
    nearest = np.min(run.link_clearance, axis=0, initial=np.inf, where=~np.isnan(run.link_clearance))
    order = [k for k in np.argsort(nearest, kind="stable") if np.isfinite(nearest[k])][:MOST_LINKS]
    for index, k in enumerate(order):
        values = np.where(np.isfinite(run.link_clearance[:, k]), 1e3 * run.link_clearance[:, k], np.nan)
        style = "--" if k == len(run.links) - 1 else "-"
        axes.plot(run.link_time, values, style, color=SERIES[index], linewidth=1.3, label=run.links[k])
    times, least = _thinned(run.time, np.where(np.isfinite(run.clearance), 1e3 * run.clearance, np.nan))
    axes.plot(times, least, ":", color=BLACK, linewidth=1.0, label="least, every step")
    axes.axhline(0.0, color=VERMILLION, linewidth=0.8)
    axes.set_ylabel("clearance [mm]", fontsize=8)
    _legend(axes)
    _tidy(axes, run)


def draw_velocity(run: RecordedArrays, axes: Axes) -> None:
    """Commanded velocity of every joint as a share of its limit."""
    _shares(run, run.velocity, run.arm.robot.limits.velocity, axes, "velocity / limit [%]")


def draw_torque(run: RecordedArrays, axes: Axes) -> None:
    """Commanded torque of every joint, gravity included, as a share of its limit."""
    _shares(run, run.torque, run.arm.robot.limits.effort, axes, "torque / limit [%]")


def _shares(run: RecordedArrays, values: Array, limits: Array, axes: Axes, label: str) -> None:
    largest = 0.0
    for j, name in enumerate(run.joint_names):
        if np.isfinite(limits[j]) and limits[j] > 0.0:
            times, share = _thinned(run.time, 100.0 * values[:, j] / limits[j])
            axes.plot(times, share, color=SERIES[j % len(SERIES)], linewidth=1.0, label=name)
            largest = max(largest, float(np.nanmax(np.abs(share), initial=0.0)))
    for sign in (-1.0, 1.0):
        if largest > 50.0:
            axes.axhline(sign * 100.0, color="0.45", linestyle=(0, (1, 1)), linewidth=1.2)
    axes.set_ylabel(label, fontsize=8)
    _legend(axes)
    _tidy(axes, run)


def _thinned(times: Array, values: Array) -> tuple[Array, Array]:
    """At most MOST_POINTS points of a line, with the least and the largest value of every stretch."""
    if len(times) <= MOST_POINTS:
        return times, values
    edges = np.linspace(0, len(times), MOST_POINTS // 2 + 1).astype(int)
    kept: list[int] = []
    for begin, end in pairwise(edges):
        part = values[begin:end]
        if np.isnan(part).all():
            kept.append(int(begin))
        else:
            kept += sorted({int(begin + np.nanargmin(part)), int(begin + np.nanargmax(part))})
    return times[kept], values[kept]


def _band(times: Array, names: npt.NDArray[np.str_], colours: dict[str, str], axes: Axes, low: float) -> None:
    if len(times) == 0:
        return
    begins = np.concatenate([[0], 1 + np.flatnonzero(names[1:] != names[:-1])])
    ends = np.concatenate([begins[1:], [len(times) - 1]])
    for name, colour in colours.items():
        own = names[begins] == name
        spans = [(times[b], times[e] - times[b]) for b, e in zip(begins[own], ends[own], strict=True)]
        if spans:
            axes.broken_barh(spans, (low + 0.08, 0.84), color=colour, linewidth=0)


def _legend(axes: Axes, handles: Sequence[Patch] | None = None) -> None:
    place: dict[str, Any] = {
        "frameon": False,
        "fontsize": 7,
        "loc": "center left",
        "bbox_to_anchor": (1.0, 0.5),
    }
    if handles is not None:
        axes.legend(handles=list(handles), ncols=2, handlelength=1.0, columnspacing=0.8, **place)
    elif axes.get_legend_handles_labels()[0]:
        axes.legend(**place)


def _tidy(axes: Axes, run: RecordedArrays) -> None:
    if run.duration > 0.0:
        axes.set_xlim(run.time[0], run.time[-1])
    axes.grid(alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=8)
