"""Plots of a recording of depth images over time."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from sidestep.drawing.palette import BLUE, SERIES
from sidestep.perception.colours import CELLS, PIXELS
from sidestep.report.camera_figures import STAGES, CameraFigures

Array = npt.NDArray[np.float64]

DPI = 110


def camera_plots(figures: CameraFigures) -> list[tuple[str, bytes]]:
    """Captions and PNG files: holes, and where the images were played the arm, its residual, cells and times."""
    # Without capture times, images are counted.
    times = figures.times if figures.times_known else np.arange(1.0, len(figures.images) + 1.0)
    axis = "time [s]" if figures.times_known else "image"

    def plot(times: Array, lines: Sequence[tuple[str, Array, str]], label: str) -> bytes:
        return _plot(times, lines, label, axis=axis)

    holes = np.array([100.0 * image.holes for image in figures.images])
    plots = [("Pixels without depth", plot(times, [("holes", holes, BLUE)], "share of pixels [%]"))]
    if not figures.reports:
        return plots
    played = times[[image.report is not None for image in figures.images]]
    size = 0.01 * figures.camera.width * figures.camera.height
    arm = figures.series(lambda r: r.arm_pixels) / size
    through = 100.0 * figures.series(lambda r: r.arm.through_share)
    error = 1000.0 * figures.series(lambda r: r.arm.depth_error if r.arm.on_arm else np.nan)
    cells = [
        ("seen now", figures.series(lambda r: r.seen), CELLS["seen"]),
        ("remembered", figures.series(lambda r: r.remembered), CELLS["hidden"]),
        ("never seen", figures.series(lambda r: r.unseen), CELLS["unseen"]),
    ]
    cells = [row for row in cells if row[0] == "seen now" or row[1].any()]
    stages = figures.stage_times()
    costs = [
        (name, 1000.0 * stages[name], SERIES[n % len(SERIES)])
        for n, name in enumerate(STAGES)
        if 1000.0 * stages[name].max() > 0.01  # else it is off
    ]
    return [
        *plots,
        (
            "Pixels of the arm, taken out of the image",
            plot(played, [("arm", arm, PIXELS["arm"])], "share of pixels [%]"),
        ),
        (
            "Rays that see through where the arm should be: its pose or its clock is wrong where they are many",
            plot(played, [("through", through, BLUE)], "share of rays through the arm [%]"),
        ),
        (
            "Measured depth on the arm less that of its cover: it reaches out by centimetres; a change is an error",
            plot(played, [("depth error", error, BLUE)], "depth error [mm]"),
        ),
        ("Cells of the map", plot(played, cells, "number of cells")),
        ("Time of each stage", plot(played, costs, "time [ms]")),
    ]


def _plot(times: Array, lines: Sequence[tuple[str, Array, str]], label: str, *, axis: str) -> bytes:
    def draw(ax: Axes) -> None:
        marker = "o" if len(times) < 50 else None
        for name, values, colour in lines:
            ax.plot(times, values, color=colour, label=name, marker=marker, markersize=3)
        ax.set_ylabel(label, fontsize=9)
        low = min(
            (float(np.nanmin(values)) for _, values, _ in lines if np.isfinite(values).any()), default=0.0
        )
        ax.set_ylim(bottom=min(low, 0.0))
        if len(lines) > 1:
            ax.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))

    return _png(draw, axis)


def _png(draw: Callable[[Axes], None], axis: str) -> bytes:
    figure = Figure(figsize=(8.0, 2.6), layout="constrained")
    axes = figure.subplots()
    draw(axes)
    axes.set_xlabel(axis, fontsize=9)
    if axis == "image":
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=8)
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=DPI)
    return stream.getvalue()
