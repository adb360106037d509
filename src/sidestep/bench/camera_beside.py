"""A loop of 1 kHz beside a thread that takes images of depth cameras: frames that are lost, and the loop's tail."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import monotonic, sleep, thread_time
from typing import Any

import numpy as np

from sidestep._core import Controller, ControllerSettings, Loop
from sidestep.arm import Arm
from sidestep.bench.camera_room import IMAGE_PERIOD, CameraImages, swing
from sidestep.bench.camera_stages import CameraCase, spread_ms
from sidestep.bench.step_times import StepTimes
from sidestep.drivers import Ideal
from sidestep.loop import LoopSettings
from sidestep.perception import Perception

STEPS_PER_SECOND = 1000
TOWARDS = 1.0  # [s] to each goal
GOALS = 20
ROUNDING = 1e-9  # periods by which sums are off


@dataclass(frozen=True)
class Load:
    """What runs beside the loop: so many cameras, each at a rate [Hz]; none: nothing."""

    cameras: int
    rate: float = 30.0

    @property
    def name(self) -> str:
        if self.cameras == 0:
            return "nothing"
        return f"{self.cameras} camera{'s' if self.cameras > 1 else ''} at {self.rate:g} Hz"


LOADS = (Load(0), Load(1, 30.0), Load(1, 60.0), Load(1, 90.0), Load(3, 30.0))


@dataclass
class LostFrames:
    """What became of the images.

    Attributes:
        taken: number of images that the thread took. replaced: of those that a newer one replaced before they were
            taken. late: of those taken that were done later than a period after they came. ages: from the image's
            coming to its obstacles' being set [s]. thread: processor time of an image [s]. busy: that of all, with what
            lies between [s]. seconds: on the wall.
    """

    taken: int = 0
    replaced: int = 0
    late: int = 0
    ages: StepTimes = field(default_factory=StepTimes)
    thread: list[float] = field(default_factory=list)
    busy: float = 0.0
    seconds: float = 0.0

    def count(self, *, due: float, done: float, thread: float, skipped: int, period: float) -> None:
        """One image that came at `due`, was done at `done` [s], and before which others were skipped."""
        self.thread.append(thread)
        self.taken += 1
        self.replaced += skipped
        self.late += done - due > period
        self.ages.add(np.array([done - due]))

    def to_dict(self) -> dict[str, Any]:
        came = self.taken + self.replaced
        return {
            "images": came,
            "lost": self.replaced + self.late,
            "replaced": self.replaced,
            "late": self.late,
            "lost_share": (self.replaced + self.late) / came if came else None,
            "age_us": self.ages.microseconds(),
            "thread_ms": spread_ms(np.array(self.thread)) if self.thread else None,
            "core_share": self.busy / self.seconds if self.seconds > 0.0 else None,
        }


def lost_on_a_free_core(thread: Sequence[float], *, cameras: int, rate: float) -> LostFrames:
    """What would become of images that take these times [s], in turn, on a core that nothing else uses.

    All cameras send their images at once, at a rate [Hz]; the newest of each is taken in turn, as often as there are
    times.
    """
    found, now, period = LostFrames(), 0.0, 1.0 / rate
    next_of = [0] * cameras
    for k, seconds in enumerate(thread):
        camera = k % cameras
        now = max(now, next_of[camera] * period)
        newest = max(int(now / period + ROUNDING), next_of[camera])
        now += seconds
        found.count(
            due=newest * period,
            done=now - ROUNDING * period,
            thread=seconds,
            skipped=newest - next_of[camera],
            period=period,
        )
        next_of[camera] = newest + 1
    found.busy, found.seconds = sum(thread), now
    return found


@contextmanager
def on_cores(cores: set[int] | None) -> Iterator[None]:
    """Keeps this thread, and those that it starts, on these cores; None: as they are."""
    if cores is None:
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, cores)
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def divided_cores() -> tuple[set[int], set[int]] | tuple[None, None]:
    """Those of the loop, and the one of perception; None where there is one only or the system does not tell."""
    if not hasattr(os, "sched_getaffinity"):
        return None, None
    cores = sorted(os.sched_getaffinity(0))
    return (set(cores[:-1]), {cores[-1]}) if len(cores) > 1 else (None, None)


class BesideRow:
    """One load: the steps of its runs, and its images. All runs are of one controller, which knows the room before."""

    def __init__(
        self, load: Load, arm: Arm, case: CameraCase, images: Sequence[CameraImages], seed: int
    ) -> None:
        if load.cameras > len(images):
            raise ValueError(f"load is {load.name}, allowed: up to {len(images)} cameras")
        self.load, self._arm, self._case = load, arm, case
        self._seen = images[: max(1, load.cameras)]
        self._taken, self._late, self._lost = StepTimes(), StepTimes(), LostFrames()
        self._missed, self._prioritised = 0, False
        divided: tuple[set[int] | None, set[int] | None] = divided_cores()
        self._loop_cores, self._own_core = divided
        with on_cores(self._loop_cores):
            self._controller = Controller(arm, ControllerSettings(seed=seed))
        cameras = [each.camera for each in self._seen]
        self._perception = Perception(self._controller, cameras, case.settings())
        self._q = swing(arm, 0, GOALS)
        self._number = 0  # of images before
        self._voxels: dict[str, int] = {}  # that each camera shows
        self._remembered = 0

    def run(self, seconds: float) -> None:
        """One run of the loop, from where the last one ended."""
        if self._number == 0:
            self._look_around()
        q = self._q
        with on_cores(self._loop_cores):
            self._controller.set_goal(q)
            steps = max(1, round(STEPS_PER_SECOND * seconds))
            # A machine that is too busy is what is measured, wherever the arm comes to by that: it ends no run.
            kept = LoopSettings(kept_times=steps, longest_gap=10.0, duration=seconds, start_in_contact=True)
            run = Loop(self._controller, Ideal(self._arm, q), kept)
            run.start()
        begin = monotonic()
        thread = threading.Thread(target=self._look, args=(run, self._number))
        if self.load.cameras:
            thread.start()
        self._send_about(run)
        if self.load.cameras:
            thread.join()
        record = run.finish()
        self._q = run.state().q
        self._number += 1 + int(np.ceil(self.load.rate * (monotonic() - begin)))
        self._taken.add(record.taken)
        self._late.add(record.late)
        self._missed += record.missed
        self._prioritised = record.prioritised

    def _look_around(self) -> None:
        begin = monotonic()
        for number in range(len(self._seen[0].frames)):
            for each in self._seen:
                self._update(each, number, begin + (number - len(each.frames)) * IMAGE_PERIOD)
        self._number = len(self._seen[0].frames)

    def _send_about(self, run: Loop) -> None:
        goal, begin = 0, monotonic()
        while not run.is_stopping:
            number = 1 + int((monotonic() - begin) / TOWARDS)
            if number != goal:
                goal = number
                self._controller.set_goal(swing(self._arm, 7 * goal % GOALS, GOALS))
            sleep(0.01)

    def _look(self, run: Loop, first: int) -> None:
        """Takes the newest image of each camera in turn; all come at the same times, the worst there is."""
        with on_cores(self._own_core):
            begin, period, busy = monotonic(), 1.0 / self.load.rate, thread_time()
            next_of = [0] * len(self._seen)
            while not run.is_stopping:
                idle = True
                for k, each in enumerate(self._seen):
                    newest = int((monotonic() - begin) / period)
                    if newest < next_of[k]:
                        continue
                    idle = False
                    start = thread_time()
                    number = first + newest
                    self._update(each, number, begin + newest * period)
                    self._lost.count(
                        due=newest * period,
                        done=monotonic() - begin,
                        thread=thread_time() - start,
                        skipped=newest - next_of[k],
                        period=period,
                    )
                    next_of[k] = newest + 1
                if idle:
                    sleep(max(0.0, min(next_of) * period - (monotonic() - begin)))
            self._lost.busy += thread_time() - busy
            self._lost.seconds += monotonic() - begin

    def _update(self, images: CameraImages, number: int, time: float) -> None:
        """Takes image `number` as if it was captured at a time [s]."""
        frame = images.at(number)
        report = self._perception.update(frame.camera, frame.depth, time=time, unit=frame.unit, q=frame.q)
        assert report.used, report.question
        self._voxels[frame.camera] = report.seen
        self._remembered = report.remembered

    def to_dict(self) -> dict[str, Any]:
        """A row of the document; frames as they were lost, and as processor times alone would have it."""
        cameras, rate = max(1, self.load.cameras), self.load.rate
        free = lost_on_a_free_core(self._lost.thread, cameras=cameras, rate=rate)
        return {
            "beside": self.load.name,
            "case": self._case.name,
            "voxels": sum(self._voxels.values()) + self._remembered,
            "steps": self._taken.total,
            "missed": self._missed,
            "real_time_scheduling": self._prioritised,
            "step_us": self._taken.microseconds(),
            "late_us": self._late.microseconds(),
            "frames": self._lost.to_dict() if self.load.cameras else None,
            "frames_on_a_free_core": free.to_dict() if self.load.cameras else None,
        }
