"""A depth camera beside the loop: images of the simulated scene, and what perception makes of them."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sidestep._core import Controller, Perception, PerceptionReport, PixelLabel
from sidestep.perception.seen_stages import SeenStages
from sidestep.studio.camera_choice import NAME, CameraChoice
from sidestep.studio.camera_process import CameraProcess, Picture, Pose, Setup
from sidestep.studio.sight import Sight

Array = npt.NDArray[np.float64]

ENDING = 0.2  # [s] for which the end of the thread is waited for: it may just start its process
ROUNDING = 1e-9  # [s] by which sums of periods are off
LABELS = {int(label.value): str(label.name) for label in PixelLabel}


@dataclass(frozen=True, eq=False)
class Shot:
    """An image to be taken: where the arm and the things are at the time of a step [s] of a controller."""

    controller: Controller
    time: float
    pose: Pose


class CameraWatch:
    """Renders in a process of its own, and perceives in a thread of its own; the loop never waits for either.

    An image that is due while the one before is still rendered is lost.

    Args:
        setup: what is rendered, and from where.
        synchronous: `shoot` and `is_due` return when all that is due by then is perceived: motions repeat.

    Attributes:
        error: why it has ended; empty: it goes on. lost: number of images that were lost.
    """

    def __init__(self, setup: Setup, *, synchronous: bool = False) -> None:
        self.error, self.lost = "", 0
        self._synchronous = synchronous
        self._choice = setup.choice
        self._setup: Setup | None = setup  # to be done, as the next two
        self._shot: Shot | None = None
        self._on_the_way: deque[tuple[Shot, Picture]] = deque()
        self._rendering = self._busy = self._stopping = False
        self._controller: Controller | None = None
        self._now, self._next = 0.0, -np.inf
        self._eyes: tuple[Controller, CameraChoice, Perception] | None = None
        self._sight: Sight | None = None
        self._count = 0
        self._wake = threading.Condition()
        self._perceiving = threading.Lock()
        self._process: CameraProcess | None = None
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    @property
    def sight(self) -> Sight | None:
        """Of the last image; None before the first."""
        return self._sight

    def set_up(self, setup: Setup) -> None:
        """Another scene, or another choice, with which what was seen is forgotten; images on their way are lost."""
        with self._perceiving, self._wake:
            if setup.choice is not self._choice:
                self._choice, self._sight = setup.choice, None
            self._setup, self._shot = setup, None
            self._on_the_way.clear()
            self._next = -np.inf
            self._wake.notify_all()

    def is_due(self, controller: Controller, time: float) -> bool:
        """Tells of a step of a controller at a time [s]; whether an image is to be taken now."""
        with self._wake:
            if controller is not self._controller:
                self._controller, self._next, self._sight = controller, -np.inf, None
                self._shot = None
                self._on_the_way.clear()
            self._now = time
            due = time >= self._next and self._setup is None
            if due:
                self._next = max(self._next + 1.0 / self._choice.rate, time)
                if self._shot is not None or self._rendering:
                    self.lost += 1
                    due = False
            if self._arrived():
                self._wake.notify_all()
        if self._synchronous:
            self._settle()
        return due

    def shoot(self, shot: Shot) -> None:
        """Has an image taken."""
        with self._wake:
            self._shot = shot
            self._wake.notify_all()
        if self._synchronous:
            self._settle()

    def stop(self) -> None:
        """Ends process and thread; an image that is just perceived is told to its controller still."""
        with self._wake:
            self._stopping = True
            self._wake.notify_all()
            if self._process is not None:
                self._process.stop()
        self._thread.join(timeout=ENDING)

    def _settle(self) -> None:
        """Waits until all is done that is due."""
        with self._wake:
            self._wake.wait_for(lambda: self.error or not (self._busy or self._has_work()))

    def _arrived(self) -> bool:
        waiting = self._on_the_way
        return bool(waiting) and waiting[0][0].time + self._choice.latency <= self._now + ROUNDING

    def _has_work(self) -> bool:
        return self._setup is not None or self._shot is not None or self._arrived()

    def _run(self) -> None:
        try:
            process = CameraProcess()  # which takes a second
            with self._wake:
                self._process = process
            while self._take_turn(process):
                pass
        except Exception as error:
            with self._wake:
                if not self._stopping:
                    self.error = str(error) or type(error).__name__
                self._wake.notify_all()
        finally:
            if self._process is not None:
                self._process.stop()

    def _take_turn(self, process: CameraProcess) -> bool:
        """Does what is to be done next; False at the end."""
        with self._wake:
            self._wake.wait_for(lambda: self._stopping or self._has_work())
            if self._stopping:
                return False
            setup, shot, image = self._setup, None, None
            if setup is None and self._arrived():
                image = self._on_the_way.popleft()
            elif setup is None:
                shot, self._shot = self._shot, None
            self._rendering, self._busy = shot is not None, True
        if setup is not None:
            process.set_up(setup)
        elif image is not None:
            self._perceive(*image)
        elif shot is not None:
            picture = process.take(shot.pose)
        with self._wake:
            if setup is not None and self._setup is setup:
                self._setup = None
            if shot is not None and self._setup is None and shot.controller is self._controller:
                self._on_the_way.append((shot, picture))
            self._rendering = self._busy = False
            self._wake.notify_all()
        return True

    def _perceive(self, shot: Shot, picture: Picture) -> None:
        with self._perceiving:
            if self._setup is not None:  # the image is of another camera
                return
            choice, eyes = self._choice, self._eyes
            if eyes is None or eyes[0] is not shot.controller or eyes[1] is not choice:
                perception = Perception(shot.controller, [choice.camera], choice.settings)
                self._eyes = shot.controller, choice, perception
            else:
                perception = eyes[2]
            report = perception.update(NAME, picture.depth, time=shot.time)
            self._count += 1
            self._sight = sight_of(perception, report, self._count, shot.time, picture.duration)


def sight_of(
    perception: Perception, report: PerceptionReport, number: int, time: float, rendering: float
) -> Sight:
    """What the page shows of an image that perception has taken."""
    stages = SeenStages.of(perception, NAME)
    shares = np.bincount(stages.labels.ravel(), minlength=len(LABELS)) / stages.labels.size
    return Sight(
        number=number,
        time=time,
        pose=stages.pose,
        depth=stages.depth.astype(np.float16),
        labels=stages.labels,
        centres=stages.centres.astype(np.float32),
        radii=stages.radii.astype(np.float32),
        kinds=stages.kinds.astype(np.uint8),
        ages=stages.ages.astype(np.float32),
        unseen=stages.unseen.astype(np.float32),
        pixels={name: float(shares[value]) for value, name in LABELS.items()},
        explained=report.explained,
        times=(
            report.depth_time,
            report.mask_time,
            report.map_time,
            report.unseen_time,
            report.obstacles_time,
        ),
        rendering=rendering,
        question=report.question,
    )
