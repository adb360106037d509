"""The controller at 1 kHz by the machine's clock, while another thread sets goals, and clouds of a camera."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import sidestep
from sidestep._core import Controller, ControllerSettings, Obstacles, RealTimeRecord, RealTimeRun
from sidestep.arm import Arm
from sidestep.bench.methods import barrier_system
from sidestep.bench.step import clear_place, cpu_model
from sidestep.bench.step_scenes import table_cloud
from sidestep.bench.step_times import StepTimes
from sidestep.robot import Robot

BESIDE = ("goals", "clouds and goals")
GOALS = 20  # places that are gone to in turn
TOWARDS = 3.0  # [s] to each
CLOUDS = 8  # camera pictures that come in turn, each with its own noise
EDGES = (5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)  # [us] of the histogram of lateness


@dataclass(frozen=True)
class RealTimeBenchSettings:
    """What runs, and how long.

    Attributes:
        robot: a name. points: of the cloud of a table with objects. seconds: of each row.
        refresh: clouds per second, each made anew, index and all. seed: of goals, points and planner.

    Raises:
        ValueError: a number that is not positive.
    """

    robot: str = "fr3"
    points: int = 10_000
    seconds: float = 60.0
    refresh: float = 60.0
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("points", "seconds", "refresh"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise ValueError(f"{name} is {value}, must be positive and finite")


def run_real_time_bench(
    settings: RealTimeBenchSettings, *, progress: Callable[[int, int, str], None] | None = None
) -> dict[str, Any]:
    """Runs a `Controller` with default settings once for each of `BESIDE`, and returns a document for JSON.

    A step is due every millisecond. It is late by the time until it begins, and misses its deadline if it ends after
    the next one is due. Planner and look-ahead run beside it in the controller's own threads; what is in `BESIDE` comes
    from another thread of this process.
    """
    scene = _Scene(settings)
    rows = []
    for k, beside in enumerate(BESIDE):
        if progress is not None:
            progress(k, len(BESIDE), f"beside {beside}")
        rows.append(scene.run(beside))
    return {
        "benchmark": "realtime",
        "version": sidestep.__version__,
        "cpu": cpu_model(),
        "robot": settings.robot,
        "ellipsoids": len(scene.arm.body.links),
        "points": settings.points,
        "period_us": 1e6 * ControllerSettings().period,
        "refresh_hz": settings.refresh,
        "results": rows,
    }


class _Scene:
    def __init__(self, settings: RealTimeBenchSettings) -> None:
        self._settings = settings
        robot = Robot.named(settings.robot)
        self.arm = Arm.from_robot(robot)
        rng = np.random.default_rng(settings.seed)
        first, system = table_cloud(settings.points, rng), barrier_system(robot, self.arm.body)
        self._pictures = [table_cloud(settings.points, rng).points for _ in range(CLOUDS)]
        self._places = [clear_place(robot, system, first, rng) for _ in range(GOALS)]
        self._first = first

    def run(self, beside: str) -> dict[str, Any]:
        start = self._places[0]
        controller = Controller(self.arm, ControllerSettings(seed=self._settings.seed))
        controller.set_obstacles(self._first)
        steps = max(1, round(self._settings.seconds / controller.settings.period))
        run = RealTimeRun(controller, start, np.zeros_like(start), steps=steps)
        clouds = self._accompany(run, controller, "clouds" in beside)
        return {"beside": beside, "clouds": clouds, "searches": controller.searches, **_figures(run.finish())}

    def _accompany(self, run: RealTimeRun, controller: Controller, clouds: bool) -> int:
        """Sets goals and clouds until the run ends; how many clouds there were."""
        begin = time.monotonic()
        pictures, goal = 0, -1
        while run.running:
            now = time.monotonic() - begin
            if clouds and now * self._settings.refresh >= pictures:
                controller.set_obstacles(Obstacles(self._pictures[pictures % CLOUDS]))
                pictures += 1
            number = 1 + int(now / TOWARDS)
            if number != goal:
                goal = number
                controller.set_goal(self._places[number % GOALS])
            time.sleep(0.002)
        return pictures


def _figures(record: RealTimeRecord) -> dict[str, Any]:
    late, taken = StepTimes(), StepTimes()
    late.add(record.late)
    taken.add(record.taken)
    edges = 1e-6 * np.array((-np.inf, *EDGES, np.inf))
    return {
        "steps": len(record.late),
        "missed": record.missed,
        "real_time_scheduling": record.prioritised,
        "late_us": late.microseconds(),
        "step_us": taken.microseconds(),
        "late_histogram": {
            "edges_us": list(EDGES),
            "counts": [
                int(np.sum((low < record.late) & (record.late <= high)))
                for low, high in itertools.pairwise(edges)
            ],
        },
    }
