"""Figure A.1: what ψ of seven joints looks like over every pair of them."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator
from itertools import combinations

import numpy as np
import numpy.typing as npt

from sidestep.drawing import style
from sidestep.scenario.assembly import assemble
from sidestep.scenario.scenario import Scenario
from sidestep.thesis import CollisionDensity
from sidestep.thesis.reproduce.item import Array, Caption, Figure, Item
from sidestep.thesis.reproduce.registry import Settings

SCENARIO = "thesis-6.2.4"
CELLS = 12  # a side of each map
SAMPLES = 12_000  # of all joints at a time; each lands in one cell of every pair


def projections(settings: Settings) -> Iterator[Item]:
    """The mean of ψ over the other five joints, for all 21 pairs."""
    parts = assemble(Scenario.load(SCENARIO))
    assert not callable(parts.seen)
    density = CollisionDensity(parts.robot, parts.body)
    rest = np.zeros(7)
    count = 2_000 if settings.quick else 50 * SAMPLES
    limit = 5.0 if settings.quick else 60.0  # [s]
    rng = np.random.default_rng(settings.seed)
    lower, upper = parts.robot.limits.lower, parts.robot.limits.upper
    q = np.empty((count, 7))
    values = np.empty(count)
    begin, done = clock.perf_counter(), 0
    for k in range(count):
        q[k] = rng.uniform(lower, upper)
        values[k] = density.evaluate(q[k], rest, parts.seen).values[0]
        done = k + 1
        if clock.perf_counter() - begin > limit:
            break
    q, values = q[:done], values[:done]
    cell = np.minimum(((q - lower) / (upper - lower) * CELLS).astype(int), CELLS - 1)
    pairs = list(combinations(range(7), 2))
    means = np.empty((len(pairs), CELLS, CELLS))
    errors = np.empty_like(means)
    least = done
    for index, (i, j) in enumerate(pairs):
        means[index], errors[index], fewest = _cells(cell[:, i], cell[:, j], values)
        least = min(least, fewest)
    spread = float(np.median(errors / np.maximum(means, 1e-12)))
    figure = style.new_figure(21.5)
    axes = figure.subplots(6, 4)
    top = float(np.quantile(means, 0.995))
    for ax, (i, j), mean in zip(axes.flat, pairs, means, strict=False):
        drawn = ax.imshow(
            mean.T,
            origin="lower",
            extent=(lower[i], upper[i], lower[j], upper[j]),
            aspect="auto",
            cmap=style.FIELD_MAP,
            vmin=0.0,
            vmax=top,
        )
        style.mark_start(ax, parts.start[i], parts.start[j])
        style.mark_goal(ax, parts.goal[i], parts.goal[j])
        ax.set_xlabel(f"q{_SUB[i]} [rad]", labelpad=1)
        ax.set_ylabel(f"q{_SUB[j]} [rad]", labelpad=1)
    for ax in axes.flat[len(pairs) :]:
        ax.axis("off")
    axes.flat[len(pairs)].legend(*axes.flat[0].get_legend_handles_labels(), loc="center")
    figure.colorbar(
        drawn,
        ax=list(axes.flat[len(pairs) + 1 :]),
        label="mean ψ [1/m³]",
        orientation="horizontal",
        aspect=12,
    )
    yield Figure(
        key="A.1",
        title="ψ over every pair of joints",
        caption=Caption(
            shows="Mean of ψ over the other five joints, drawn uniformly within their limits. "
            f"{done:,} samples; a cell holds at least {least}; the standard error of a cell is "
            f"{100 * spread:.0f} % of its mean (median over all cells).",
            answers="Figure A.1.",
            parameters=f"Obstacles, start and goal of section 6.2.4, 2 Gaussians per link, {CELLS} × "
            f"{CELLS} cells, seed {settings.seed}.",
            differs="The thesis sums ψ over a coarse grid, at a cost of nᵈ, which gives its diamond shapes, "
            "and its formula for ψᵢⱼ takes ψ of links i and j as functions of two joints, though they "
            "depend on all joints below (errata 16). A mean with a stated error needs no grid; every "
            "sample serves all pairs.",
        ),
        drawing=figure,
        data={"mean_psi_per_m3": means, "standard_error": errors, "pairs": np.array(pairs) + 1},
    )


_SUB = "₁₂₃₄₅₆₇"
Indices = npt.NDArray[np.int64]


def _cells(column: Indices, row: Indices, values: Array) -> tuple[Array, Array, int]:
    """Mean and standard error per cell (CELLS, CELLS), and the fewest samples in a cell."""
    flat = column * CELLS + row
    counts = np.bincount(flat, minlength=CELLS**2)
    safe = np.maximum(counts, 1)
    mean = np.bincount(flat, values, CELLS**2) / safe
    square = np.bincount(flat, values**2, CELLS**2) / safe
    error = np.sqrt(np.maximum(square - mean**2, 0.0) / safe)
    return mean.reshape(CELLS, CELLS), error.reshape(CELLS, CELLS), int(counts.min())
