"""The controller at 1 kHz by the machine's clock, beside what sets goals, clouds and images, and a recorder."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import numpy.typing as npt

import sidestep
from sidestep._core import Controller, ControllerSettings, Loop, Obstacles, Perception, clock_lateness, replay
from sidestep.arm import Arm
from sidestep.bench.camera_rig import SIZES
from sidestep.bench.camera_room import render_images, swing
from sidestep.bench.methods import barrier_system
from sidestep.bench.step import clear_place, cpu_model
from sidestep.bench.step_scenes import table_cloud
from sidestep.bench.step_times import StepTimes
from sidestep.drivers import Ideal
from sidestep.loop import LoopSettings
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]

CLOCK = "only the clock"  # no controller: what the machine can do
RECORDER, CAMERA = "goals and recorder", "camera, goals and recorder"
BESIDE = (CLOCK, "goals", "clouds and goals")  # and one of the two with a recorder
ROWS = ("clock", "goals", "clouds", "recorder")  # short names of these four
IMAGE_RATE = 30.0  # [Hz]
IMAGES = 30  # of the camera, which come in turn
PERIOD = ControllerSettings().period  # [s]
GOALS = 20  # places that are gone to in turn
TOWARDS = 3.0  # [s] to each
CLOUDS = 8  # camera pictures that come in turn, each with its own noise
EDGES = (5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)  # [us] of the histogram of lateness


@dataclass(frozen=True)
class RealTimeBenchSettings:
    """What runs, and how long.

    Attributes:
        robot: a name. points: of the cloud of a table with objects. seconds: of each row.
        refresh: clouds per second, each made anew, index and all. camera: a depth camera beside the recorder, which
            needs the meshes of the arm. size: of its images, one of `SIZES`. seed: of goals, points and planner.
        rows: which of `ROWS`.

    Raises:
        ValueError: a number that is not positive, or a row or a size that there is not.
    """

    robot: str = "fr3"
    points: int = 10_000
    seconds: float = 60.0
    refresh: float = 60.0
    camera: bool = True
    size: str = "848x480"
    seed: int = 0
    rows: tuple[str, ...] = ROWS

    def __post_init__(self) -> None:
        unknown = [row for row in self.rows if row not in ROWS]
        if unknown or not self.rows:
            raise ValueError(f"row is {unknown[0] if unknown else None!r}; there are {', '.join(ROWS)}")
        if self.size not in SIZES:
            raise ValueError(f"size is {self.size!r}; there are {', '.join(SIZES)}")
        for name in ("points", "seconds", "refresh"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise ValueError(f"{name} is {value}, must be positive and finite")


def run_real_time_bench(
    settings: RealTimeBenchSettings, *, progress: Callable[[int, int, str], None] | None = None
) -> dict[str, Any]:
    """Runs a `Controller` with default settings once for each of `BESIDE`, and returns a document for JSON.

    A step is due every millisecond. It is late by the time until it begins, and misses its deadline if it ends after
    the next one is due. The steps are made in the thread of a `Loop`, planner and look-ahead run in threads of the
    controller, and what is in `BESIDE` comes from the calling thread. The first row has no controller: only the clock
    is waited for. The row with a recorder takes images of a depth camera at 30 Hz, and records every step; the
    recording is replayed.
    """
    scene = _Scene(settings)
    rows = []
    names = dict(zip(ROWS, (*BESIDE, CAMERA if settings.camera else RECORDER), strict=True))
    every = [names[row] for row in ROWS if row in settings.rows]
    for k, beside in enumerate(every):
        if progress is not None:
            progress(k, len(every), f"beside {beside}")
        rows.append(scene.run(beside))
    return {
        "benchmark": "realtime",
        "version": sidestep.__version__,
        "cpu": cpu_model(),
        "robot": settings.robot,
        "ellipsoids": len(scene.arm.body.links),
        "points": settings.points,
        "period_us": 1e6 * PERIOD,
        "refresh_hz": settings.refresh,
        "image_size": settings.size,
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
        self._steps = max(1, round(settings.seconds / PERIOD))

    def run(self, beside: str) -> dict[str, Any]:
        """The row of that name."""
        if beside == CLOCK:
            late = clock_lateness(self._settings.seconds)
            return {"beside": beside, **_figures(late, np.zeros_like(late), prioritised=None)}
        if beside in (CAMERA, RECORDER):
            return {"beside": beside, **self._run_recorded(with_camera=beside == CAMERA)}
        controller = self._controller()
        controller.set_obstacles(self._first)
        run = self._begin(controller, self._places[0])

        def go(number: int) -> None:
            controller.set_goal(self._places[number % GOALS])

        def show(number: int, _: float) -> None:
            controller.set_obstacles(Obstacles(self._pictures[number % CLOUDS]))

        clouds = self._accompany(run, go, show if "clouds" in beside else None, rate=self._settings.refresh)
        return {"beside": beside, "clouds": clouds, "searches": controller.searches, **self._end(run)}

    def _run_recorded(self, *, with_camera: bool) -> dict[str, Any]:
        controller = self._controller()
        camera = _Camera(self.arm, controller, self._settings) if with_camera else None

        def go(number: int) -> None:
            controller.set_goal(swing(self.arm, 7 * number % GOALS, GOALS))

        with TemporaryDirectory() as folder:
            path = Path(folder) / "run.mcap"
            with controller.record(path) as recording:
                if camera is None:
                    controller.set_obstacles(Obstacles.none())
                else:
                    camera.look_around()
                run = self._begin(controller, swing(self.arm, 0, GOALS))
                seen = self._accompany(run, go, camera.show if camera else None, rate=IMAGE_RATE)
                figures = self._end(run)
                summary = recording.stop()
            begin = time.perf_counter()
            result = replay(path)
            figures["record"] = {
                "steps": summary.steps,
                "lost": summary.lost,
                "bytes_a_minute": summary.bytes / (result.seconds / 60.0),
                "replay_equal": result.equal,
                "replay_speed": result.seconds / (time.perf_counter() - begin),
            }
        return {"images": seen, "searches": controller.searches, **figures}

    def _controller(self) -> Controller:
        return Controller(self.arm, ControllerSettings(seed=self._settings.seed))

    def _begin(self, controller: Controller, start: Array) -> Loop:
        # A machine that is too busy is what is measured: it ends no run.
        kept = LoopSettings(
            kept_times=2 * self._steps + 1000,
            longest_gap=10.0,
            start_in_contact=True,
            duration=self._steps * PERIOD,
        )
        run = Loop(controller, Ideal(self.arm, start), kept)
        run.start()
        return run

    def _end(self, run: Loop) -> dict[str, Any]:
        """Figures of the steps that were asked for: those after them brought the arm to rest."""
        report = run.finish()
        return _figures(
            report.late[: self._steps], report.taken[: self._steps], prioritised=report.prioritised
        )

    def _accompany(
        self, run: Loop, go: Callable[[int], None], show: Callable[[int, float], None] | None, *, rate: float
    ) -> int:
        """Sets goals, and shows what is seen at its rate [Hz], until the run ends; how often it was shown.

        Args:
            go: sets the goal of a number, from 1. show: what has a number, from 0, at a time [s]; None: nothing.
        """
        begin, shown, goal = time.monotonic(), 0, 0
        while not run.is_stopping:
            now = time.monotonic() - begin
            if show is not None and now * rate >= shown:
                show(shown, begin + shown / rate)
                shown += 1
            number = 1 + int(now / TOWARDS)
            if number != goal:
                goal = number
                go(goal)
            time.sleep(0.002)
        return shown


class _Camera:
    """A depth camera that shows a room with a moving arm, rendered once."""

    def __init__(self, arm: Arm, controller: Controller, settings: RealTimeBenchSettings) -> None:
        width, height = SIZES[settings.size]
        (self._images, *_) = render_images(arm, images=IMAGES, width=width, height=height, seed=settings.seed)
        self._perception = Perception(controller, [self._images.camera])

    def look_around(self) -> None:
        """Shows each image once, now."""
        for number in range(IMAGES):
            self.show(number - IMAGES, time.monotonic())

    def show(self, number: int, captured: float) -> None:
        """Shows an image as if captured at a time [s]; numbers below 0 are of `look_around`, from 0 of the run."""
        frame = self._images.at(IMAGES + number)
        self._perception.update(frame.camera, frame.depth, time=captured, unit=frame.unit, q=frame.q)


def _figures(late: Array, taken: Array, *, prioritised: bool | None) -> dict[str, Any]:
    late_times, step_times = StepTimes(), StepTimes()
    late_times.add(late)
    step_times.add(taken)
    edges = 1e-6 * np.array((-np.inf, *EDGES, np.inf))
    return {
        "steps": len(late),
        "missed": int(np.sum(late + taken > PERIOD)),
        "real_time_scheduling": prioritised,
        "late_us": late_times.microseconds(),
        "step_us": step_times.microseconds(),
        "late_histogram": {
            "edges_us": list(EDGES),
            "counts": [int(np.sum((low < late) & (late <= high))) for low, high in itertools.pairwise(edges)],
        },
    }
