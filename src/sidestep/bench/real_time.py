"""The loop at 1 kHz by the machine's clock, alone and with a camera and a guide beside it."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

import sidestep
from sidestep._core import Loop, Obstacles, RealTimeRecord, RealTimeRun, TorqueController
from sidestep.bench.step import clear_place, cpu_model
from sidestep.bench.step_scenes import table_cloud
from sidestep.bench.step_times import StepTimes
from sidestep.body import Body
from sidestep.guidance import GuidedMotion
from sidestep.presets import barrier_system
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]

PERIOD = 0.001  # [s]
BESIDE = ("nothing", "clouds", "clouds and guide")
GOALS = 20  # places that are gone to in turn
TOWARDS = 3.0  # [s] to each
CLOUDS = 8  # camera pictures that come in turn, each with its own noise
EDGES = (5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)  # [us] of the histogram of lateness


@dataclass(frozen=True)
class RealTimeBenchSettings:
    """What runs, and how long.

    Attributes:
        robot: a name. points: of the cloud of a table with objects. seconds: of each row.
        refresh: clouds per second, each made anew, index and all. seed: of goals, points and guide.

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
    """Runs the whole loop, state in and torque out, once for each of `BESIDE`, and returns a document for JSON.

    A step is due every millisecond. It is late by the time until it begins, and misses its deadline if it ends after
    the next one is due. Beside it, in this process: the clouds of a camera, and a guide that leads the goal.
    """
    arm = _Arm(settings)
    rows = []
    for k, beside in enumerate(BESIDE):
        if progress is not None:
            progress(k, len(BESIDE), f"beside {beside}")
        rows.append(arm.run(beside))
    return {
        "benchmark": "realtime",
        "version": sidestep.__version__,
        "cpu": cpu_model(),
        "robot": settings.robot,
        "ellipsoids": len(arm.body.links),
        "points": settings.points,
        "period_us": 1e6 * PERIOD,
        "refresh_hz": settings.refresh,
        "results": rows,
    }


class _Arm:
    def __init__(self, settings: RealTimeBenchSettings) -> None:
        self._settings = settings
        self._robot = Robot.named(settings.robot)
        self.body = Body.cover(self._robot)
        self._system = barrier_system(self._robot, self.body)
        rng = np.random.default_rng(settings.seed)
        first = table_cloud(settings.points, rng)
        self._pictures = [table_cloud(settings.points, rng).points for _ in range(CLOUDS)]
        self._places = [clear_place(self._robot, self._system, first, rng) for _ in range(GOALS)]
        self._first = first

    def run(self, beside: str) -> dict[str, Any]:
        robot, settings, start = self._robot, self._settings, self._places[0]
        loop = Loop(
            self._system, TorqueController(robot, period=PERIOD), goal=self._places[1], obstacles=self._first
        )
        guided = None
        if "guide" in beside:
            guided = GuidedMotion(robot, self.body, system=self._system, seed=settings.seed)
        steps = max(1, round(settings.seconds / PERIOD))
        at_rest = np.zeros_like(start)
        run = RealTimeRun(
            loop,
            start,
            at_rest,
            robot.mass_matrix(start),
            robot.bias(start, at_rest),
            period=PERIOD,
            steps=steps,
        )
        clouds = self._accompany(run, loop, guided, "clouds" in beside)
        return _row(beside, run.finish(), clouds)

    def _accompany(self, run: RealTimeRun, loop: Loop, guided: GuidedMotion | None, clouds: bool) -> int:
        """Goals, clouds and guide until the run ends; how many clouds there were."""
        begin = time.monotonic()
        seen, pictures, goal = self._first, 0, -1
        while run.running:
            now = time.monotonic() - begin
            if clouds and now * self._settings.refresh >= pictures:
                seen = Obstacles(self._pictures[pictures % CLOUDS])
                loop.set_obstacles(seen)
                pictures += 1
            number = 1 + int(now / TOWARDS)
            if number != goal:
                goal = number
                place = self._places[number % GOALS]
                loop.set_goal(place)
                if guided is not None:
                    guided.set_goal(place)
            if guided is not None:
                loop.set_goal(guided.lead(run.state()[0], seen, now).goal)
            time.sleep(0.002)
        return pictures


def _row(beside: str, record: RealTimeRecord, clouds: int) -> dict[str, Any]:
    late, taken = StepTimes(), StepTimes()
    late.add(record.late)
    taken.add(record.taken)
    edges = 1e-6 * np.array((-np.inf, *EDGES, np.inf))
    return {
        "beside": beside,
        "steps": len(record.late),
        "missed": record.missed,
        "real_time_scheduling": record.prioritised,
        "clouds": clouds,
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
