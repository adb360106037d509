"""Live progress of a run: simulated time, clearance and distance to the goal."""

from __future__ import annotations

import time as clock
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from sidestep.cli.output import lines_without_terminal
from sidestep.distance import ExactClearance
from sidestep.scenario.runner import run_scenario
from sidestep.simulation.joint_words import in_words, largest_ways

if TYPE_CHECKING:
    from rich.console import Console

    from sidestep.scenario.assembly import Assembly
    from sidestep.scenario.result import ScenarioResult
    from sidestep.scenario.scenario import Scenario

Array = npt.NDArray[np.float64]

REFRESH = 0.25  # [s] between two updates: exact clearance costs milliseconds, the run must not wait for it


def run_with_progress(scenario: Scenario, terminal: Console) -> ScenarioResult:
    """Runs a scenario and shows how it goes."""
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        TextColumn("{task.fields[facts]}"),
        TimeElapsedColumn(),
        console=terminal,
        transient=True,
    )
    told = lines_without_terminal(terminal)
    with bar:
        fit = bar.add_task("body", total=None, facts="")
        task = bar.add_task("run", total=scenario.simulation.duration, facts="", visible=False)
        follower: _Follower | None = None

        def on_fit(item: str, done: int, total: int) -> None:
            bar.update(fit, completed=done, total=total, facts=item)
            told(f"preparing {item} ({done} of {total})")

        def on_start(parts: Assembly) -> None:
            nonlocal follower
            follower = _Follower(parts, bar, task)
            bar.update(
                fit, completed=1, total=1, facts=f"{parts.body.num_components} Gaussians", visible=False
            )
            bar.update(task, visible=True)

        def on_step(time: float, q: Array) -> None:
            assert follower is not None
            follower.update(time, q)

        return run_scenario(scenario, on_step=on_step, on_start=on_start, fit_progress=on_fit)


class _Follower:
    """Updates the bar of a run now and then. Obstacles that were pushed are taken where they started."""

    def __init__(self, parts: Assembly, bar: Progress, task: object) -> None:
        from sidestep.math.pose import pose_vector

        self._parts, self._bar, self._task = parts, bar, task
        self._clearance = ExactClearance(parts.robot, parts.objects) if parts.objects else None
        self._pose_vector = pose_vector
        self._last = -np.inf

    def update(self, time: float, q: Array) -> None:
        if clock.monotonic() - self._last < REFRESH:
            return
        parts = self._parts
        left = largest_ways(parts.robot, q - parts.goal)
        error = in_words(*left, radians=".3f", millimetres=".1f")
        if parts.pose is not None:
            error = f"{1e3 * parts.pose.errors(q)[0]:4.0f} mm"
        facts = f"{time:5.2f} s   error {error}"
        if self._clearance is not None:
            poses = np.array([self._pose_vector(item.pose_at(time)) for item in self._parts.objects])
            facts += f"   clearance {1000.0 * self._clearance.distance(q, poses).distance:5.0f} mm"
        self._bar.update(self._task, completed=time, facts=facts)  # type: ignore[arg-type]
        self._last = clock.monotonic()
