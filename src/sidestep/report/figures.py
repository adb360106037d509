"""Figures of a run over time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from sidestep.drawing.palette import BLACK, BLUE, GREEN, ORANGE, SERIES, VERMILLION
from sidestep.scenario.result import ScenarioResult
from sidestep.simulation import SimulationRun

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

Array = npt.NDArray[np.float64]

JOINT_STYLES = ("-", "--", "-.", ":")
DPI = 120
MOST_CURVES = 6  # of barriers: more cannot be told apart
SEEN = 0.01  # of the strongest barrier: a weaker one is a line at zero
LIMIT_STYLE: dict[str, Any] = {"color": "0.45", "linestyle": (0, (1, 1)), "linewidth": 1.2}


def write_figures(result: ScenarioResult, folder: Path) -> tuple[Path, ...]:
    """Writes one PNG per quantity into the folder; those that the run does not have are left out."""
    makers: dict[str, Callable[[ScenarioResult], Figure | None]] = {
        "position": position_figure,
        "velocity": velocity_figure,
        "acceleration": acceleration_figure,
        "torque": torque_figure,
        "switch": switch_figure,
        "psi": psi_figure,
        "clearance": clearance_figure,
    }
    written = []
    for name, make in makers.items():
        figure = make(result)
        if figure is not None:
            path = folder / f"{name}.png"
            figure.savefig(path, dpi=DPI)
            written.append(path)
    return tuple(written)


def position_figure(result: ScenarioResult) -> Figure:
    """Every coordinate over time with start, goal and limits."""
    run = result.run
    limits = run.robot.limits

    def draw(axes: Axes, index: int, scale: float) -> None:
        axes.plot(run.time, scale * run.q[:, index], color=BLUE, label="position")
        axes.plot(run.time[0], scale * run.start[index], "o", color=BLACK, markersize=5, label="start")
        label = "goal" if run.pose is None else "end"
        axes.axhline(scale * run.goal[index], color=GREEN, linestyle="--", label=label)
        low, high = scale * limits.lower[index], scale * limits.upper[index]
        shown = [*(scale * run.q[:, index]), scale * run.goal[index]]
        span = max(max(shown) - min(shown), (0.2 if scale < 1000.0 else 0.02) * scale)  # [rad | m]
        for value in (low, high):
            if np.isfinite(value) and min(shown) - 0.6 * span < value < max(shown) + 0.6 * span:
                axes.axhline(value, **LIMIT_STYLE, label="limit")
        axes.set_title(_limit_note(low, high), fontsize=7, color="0.4", loc="right", pad=3)
        _keep_span(axes, shown, span)

    return _per_joint(result, draw, angle="deg", per="", title="Joint position", length="mm")


def velocity_figure(result: ScenarioResult) -> Figure:
    """Every velocity over time."""
    run = result.run

    def draw(axes: Axes, index: int, scale: float) -> None:
        axes.plot(run.time, run.v[:, index], color=BLUE, label="v")
        _limits_if_near(axes, run.v[:, index], run.robot.limits.velocity[index])

    return _per_joint(result, draw, angle="rad", per="/s", title="Joint velocity")


def acceleration_figure(result: ScenarioResult) -> Figure:
    """Every acceleration over time: wanted by the dynamical system, and achieved by the arm."""
    run = result.run
    physics = isinstance(run, SimulationRun)

    def draw(axes: Axes, index: int, scale: float) -> None:
        if physics:
            axes.plot(run.time, run.achieved[:, index], color=ORANGE, linewidth=2.6, label="achieved")
        axes.plot(run.time, run.wanted[:, index], color=BLUE, linewidth=1.0, label="wanted")
        _limits_if_near(axes, run.wanted[:, index], run.robot.limits.acceleration[index])

    return _per_joint(result, draw, angle="rad", per="/s²", title="Joint acceleration")


def torque_figure(result: ScenarioResult) -> Figure | None:
    """Every torque over time with its limits; None without physics."""
    run = result.run
    if not isinstance(run, SimulationRun):
        return None

    def draw(axes: Axes, index: int, scale: float) -> None:
        axes.plot(run.time, run.torque[:, index], color=BLUE, label="torque")
        limit = run.robot.limits.effort[index]
        if np.isfinite(limit):
            for sign in (-1.0, 1.0):
                axes.axhline(sign * limit, **LIMIT_STYLE, label="limit")

    return _per_joint(result, draw, angle="N·m", per="", title="Joint torque", length="N")


def switch_figure(result: ScenarioResult) -> Figure | None:
    """Switch weight of every coordinate; None where the method has no switch."""
    run = result.run
    if not result.switched:
        return None
    names = run.robot.coordinate_names if run.switch.shape[1] == run.robot.num_coordinates else ["all joints"]
    figure, axes = _single("Switch weight", "weight [-]   (1 harmonic, 0 geodesic)")
    _lines(axes, run.time, run.switch, names)
    axes.set_ylim(-0.05, 1.05)
    return figure


def psi_figure(result: ScenarioResult) -> Figure | None:
    """Embedding coordinates over time, by name; of barriers those that were active most. None where none ever was.

    Several barriers with one name, such as those of the ellipsoids of one link, are one curve: the largest of them.
    """
    values = np.nan_to_num(result.run.values)
    names = np.array(result.embedding_names, dtype=str)
    curves = {name: values[:, names == name].max(axis=1) for name in dict.fromkeys(result.embedding_names)}
    written = result.scenario.method == "custom"
    largest = max((float(curve.max()) for curve in curves.values()), default=0.0)
    least = 0.0 if written else SEEN * largest
    active = [name for name, curve in curves.items() if curve.max() > least]
    if not active:
        return None
    shown = active if written else sorted(active, key=lambda name: -curves[name].mean())[:MOST_CURVES]
    title = "Embedding"
    if not written:
        most = (
            f"the {len(shown)} most active of {len(active)}"
            if len(shown) < len(active)
            else "all that were active"
        )
        title = f"What bent the motion: barriers by part, {most}"
    density = written and list(curves) == ["collision density"]
    figure, axes = _single(
        title, "collision density ψ [1/m³]" if density else "ψ [-]" if written else "strength [-]"
    )
    _lines(axes, result.run.time, np.column_stack([curves[name] for name in shown]), shown)
    return figure


def clearance_figure(result: ScenarioResult) -> Figure | None:
    """Exact distance between arm and obstacles over time; None without obstacles."""
    if not len(result.clearance):
        return None
    figure, axes = _single("Exact clearance, meshes of the arm to obstacles", "clearance [mm]")
    axes.plot(result.clearance_time, 1000.0 * result.clearance, color=BLUE, label="clearance")
    axes.axhline(0.0, color=VERMILLION, linestyle="--", label="contact")
    minimum, when = result.evaluation.min_clearance_m, result.evaluation.clearance_time_s
    if minimum is not None and when is not None:
        label = f"minimum {1000.0 * minimum:.1f} mm ({result.evaluation.clearance_pair})"
        axes.plot(when, 1000.0 * minimum, "v", color=BLACK, label=label)
    axes.legend(frameon=False, fontsize=8)
    return figure


def _per_joint(
    result: ScenarioResult,
    draw: Callable[[Axes, int, float], None],
    *,
    angle: str,
    per: str,
    title: str,
    length: str = "m",
) -> Figure:
    """One small plot per coordinate; `draw` gets the factor from rad or m to the unit shown."""
    robot = result.run.robot
    count = robot.num_coordinates
    columns = 1 if count <= 2 else 2
    rows = -(-count // columns)
    figure = Figure(figsize=(4.6 * columns + 0.4, 1.75 * rows + 0.7), layout="constrained")
    grid = figure.subplots(rows, columns, sharex=True, squeeze=False).ravel()
    for index, axes in enumerate(grid[:count]):
        unit = angle if robot.coordinate_units[index] == "rad" else length
        draw(axes, index, {"deg": float(np.rad2deg(1.0)), "mm": 1000.0}.get(unit, 1.0))
        axes.set_ylabel(f"{robot.coordinate_names[index]}\n[{unit}{per}]", fontsize=8)
        _tidy(axes)
    for axes in grid[count:]:
        axes.set_visible(False)
    for axes in grid[max(0, count - columns) : count]:
        axes.set_xlabel("time [s]", fontsize=8)
        axes.tick_params(labelbottom=True)
    entries: dict[str, Artist] = {}
    for axes in grid[:count]:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    figure.suptitle(f"{title}, {result.scenario.name}", fontsize=10)
    if len(entries) > 1:
        figure.legend(
            list(entries.values()),
            list(entries),
            loc="outside lower center",
            ncols=5,
            frameon=False,
            fontsize=8,
        )
    return figure


def _single(title: str, label: str) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(8.0, 3.2), layout="constrained")
    axes = figure.subplots()
    axes.set_title(title, fontsize=10)
    axes.set_xlabel("time [s]", fontsize=9)
    axes.set_ylabel(label, fontsize=9)
    _tidy(axes)
    return figure, axes


def _lines(axes: Axes, time: Array, columns: Array, names: list[str]) -> None:
    for index, name in enumerate(names):
        colour = SERIES[index % len(SERIES)]
        axes.plot(time, columns[:, index], color=colour, linestyle=JOINT_STYLES[index % 4], label=name)
    if len(names) > 1:
        axes.legend(frameon=False, fontsize=8, ncols=1, loc="center left", bbox_to_anchor=(1.0, 0.5))


def _limits_if_near(axes: Axes, values: Array, limit: float) -> None:
    """Limits as lines where the values come near them, else as a note, so that the curve stays readable."""
    largest = float(np.abs(values).max(initial=0.0))
    if np.isfinite(limit) and largest > 0.5 * limit:
        for sign in (-1.0, 1.0):
            axes.axhline(sign * limit, **LIMIT_STYLE, label="limit")
    axes.set_title(f"limit ±{limit:.3g}", fontsize=7, color="0.4", loc="right", pad=3)
    _keep_span(axes, values.tolist(), max(float(np.ptp(values)), 0.02))


def _keep_span(axes: Axes, shown: list[float], span: float) -> None:
    """Keeps rounding noise on a joint that stands still from filling its plot."""
    low, high = axes.get_ylim()
    if high - low < span:
        middle = 0.5 * (min(shown) + max(shown))
        axes.set_ylim(middle - 0.6 * span, middle + 0.6 * span)


def _limit_note(low: float, high: float) -> str:
    return f"limits [{low:.0f}, {high:.0f}]" if np.isfinite(low) and np.isfinite(high) else "no limits"


def _tidy(axes: Axes) -> None:
    axes.grid(alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=8)
