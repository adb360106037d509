"""One look for every figure: colours that colour-blind readers tell apart, and the same marks everywhere."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib
import numpy as np
import numpy.typing as npt
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from sidestep.drawing import palette
from sidestep.drawing.palette import BLACK as BLACK
from sidestep.drawing.palette import BLUE as BLUE
from sidestep.drawing.palette import GREEN as GREEN
from sidestep.drawing.palette import ORANGE as ORANGE
from sidestep.drawing.palette import PURPLE as PURPLE
from sidestep.drawing.palette import SKY as SKY
from sidestep.drawing.palette import VERMILLION as VERMILLION
from sidestep.drawing.palette import YELLOW as YELLOW

Array = npt.NDArray[np.float64]

JOINT_COLOURS = palette.SERIES

PAGE_WIDTH = 16.0  # [cm] the width at which a page shows a figure
DPI = 150
FIELD_MAP = "Blues"  # light to dark in one hue: lines drawn over it stay readable

_STYLE: Any = {
    "font.size": 8.0,
    "axes.titlesize": 8.5,
    "axes.labelsize": 8.0,
    "legend.fontsize": 7.0,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "axes.grid": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.prop_cycle": cycler(color=list(JOINT_COLOURS)),
    "lines.linewidth": 1.2,
    "legend.framealpha": 0.85,
    "svg.fonttype": "path",
    "svg.hashsalt": "sidestep",  # the same figure gives the same file
}


@contextmanager
def applied() -> Iterator[None]:
    """The style, for as long as the context lasts."""
    with matplotlib.rc_context(_STYLE):
        yield


def new_figure(height: float, *, width: float = PAGE_WIDTH) -> Figure:
    """An empty figure of a size in centimetres, without a display."""
    figure = Figure(figsize=(width / 2.54, height / 2.54), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def mark_start(ax: Any, *point: float, label: str | None = "start") -> None:
    """A green disc where a motion starts."""
    _mark(ax, point, marker="o", color=GREEN, size=6.5, label=label)


def mark_goal(ax: Any, *point: float, label: str | None = "goal") -> None:
    """A yellow star where a motion shall end."""
    _mark(ax, point, marker="*", color=YELLOW, size=12.0, label=label)


def mark_obstacle(ax: Any, *point: float, label: str | None = "obstacle") -> None:
    """A black disc with a white cross at the centre of an obstacle."""
    _mark(ax, point, marker="o", color=BLACK, size=9.0, label=label)
    _mark(ax, point, marker="x", color="white", size=4.0, label=None, edge="white")


def _mark(
    ax: Any,
    point: Sequence[float],
    *,
    marker: str,
    color: str,
    size: float,
    label: str | None,
    edge: str = BLACK,
) -> None:
    ax.plot(
        *([value] for value in point),
        marker=marker,
        color=color,
        markersize=size,
        markeredgecolor=edge,
        markeredgewidth=0.8,
        linestyle="none",
        label=label,
        zorder=10,
    )


def draw_path(
    ax: Axes, q: Array, *, color: str = VERMILLION, label: str | None = None, width: float = 1.4
) -> None:
    """A motion in the plane of two joints, with a thin white border so that it stands off any field."""
    ax.plot(q[:, 0], q[:, 1], color="white", linewidth=width + 1.4, zorder=4)
    ax.plot(q[:, 0], q[:, 1], color=color, linewidth=width, label=label, zorder=5)


def draw_field(
    figure: Figure,
    ax: Axes,
    grid: tuple[Array, Array],
    values: Array,
    *,
    label: str | None = "ψ [1/m³]",
    levels: int = 12,
) -> None:
    """A field over the plane of two joints as filled contours, with its scale beside it if it has a label.

    Args:
        grid: values of q1 (n,) and of q2 (m,) [rad].
        values: (m, n), row for q2.
        label: of the colour bar, or None for none.
    """
    top = max(float(values.max()), 1e-12)
    filled = ax.contourf(*grid, values, levels=np.linspace(0.0, top, levels), cmap=FIELD_MAP)
    filled.set_edgecolor("face")
    if label is not None:
        bar = figure.colorbar(filled, ax=ax, label=label, shrink=0.9, pad=0.02)
        bar.locator = MaxNLocator(nbins=5)
        bar.update_ticks()


def joint_axes(ax: Axes, *, title: str | None = None) -> None:
    """Labels and equal scales for the plane of two joints."""
    ax.set(xlabel="q₁ [rad]", ylabel="q₂ [rad]", aspect="equal")
    if title is not None:
        ax.set_title(title)


def time_axes(ax: Axes, label: str, *, title: str | None = None, legend: bool = False) -> None:
    """Labels for a curve over time."""
    ax.set(xlabel="time [s]", ylabel=label)
    ax.margins(x=0.0)
    if title is not None:
        ax.set_title(title)
    if legend:
        ax.legend(loc="best", ncols=2)
