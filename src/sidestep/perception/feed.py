"""Images of a camera, taken by `Perception` in a thread of their own."""

from __future__ import annotations

import re
import threading
import warnings
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, ExitStack
from types import TracebackType
from typing import Protocol

import numpy as np

from sidestep._core import Perception, PerceptionReport
from sidestep.perception.frame import Frame

PATIENCE = (
    1.0  # [s] for which a question must stand before it is told: before the first step there is always one
)
LONGEST_WAIT = 5.0  # [s] for a source to give its last image at the end


class FrameSource(Protocol):
    """What gives images one by one: a `RealSense`, a recording, your own driver."""

    def frames(self) -> Iterator[Frame]:
        """The images as they come; waits for each."""


def take(perception: Perception, frame: Frame) -> PerceptionReport:
    """Gives `Perception` an image with all that its source says of it.

    Raises:
        ValueError: there is no such camera, or the image has another size; names it.
    """
    unit = frame.unit if frame.depth.dtype == np.uint16 else None
    return perception.update(
        frame.camera, frame.depth, time=frame.time, unit=unit, q=frame.q, pose=frame.pose
    )


def watch(perception: Perception, source: FrameSource | Iterable[Frame]) -> Feed:
    """Takes the images of a source while a `with` block lasts: `with watch(perception, camera) as feed: ...`.

    See `Feed`.
    """
    return Feed(perception, source)


class Feed:
    """A thread that reads images from a source and gives each to `Perception.update`.

    Use it in a `with` block around the control loop, one for each source. A source that can be opened (a context
    manager, such as `RealSense`) is opened at its begin and closed at its end. The core computes outside of Python's
    lock, so the loop goes on meanwhile. What the loop asks of the controller does not change: without images the
    cameras' obstacles grow too old, and the arm stops.

    What `Perception` asks, such as whether the camera is where it should be, is told once as a `RuntimeWarning` when it
    has stood for a second. An error ends the thread, is told as a `RuntimeWarning` at once, and is raised at the end of
    the block.

    Attributes:
        images: number of images that were used so far.
        unused: number of those that were not: nobody knew where the arm was then, or they showed nothing.
        report: what became of the last image; None before the first.
        error: what ended the thread; None: nothing did.
    """

    def __init__(self, perception: Perception, source: FrameSource | Iterable[Frame]) -> None:
        """Prepares the thread; the `with` block starts it.

        Args:
            perception: with the cameras that the images name.
            source: has `frames()`, or is an iterable of `Frame`, such as a generator. Times of capture are on the clock
                of `step`; `q` and `pose` of a frame may be None.

        Raises:
            TypeError: the source has no frames.
        """
        if not (hasattr(source, "frames") or isinstance(source, Iterable)):
            raise TypeError(
                f"source is {source!r}, must have frames(), as RealSense and recordings do, or be an iterable of Frame"
            )
        self.images, self.unused = 0, 0
        self.report: PerceptionReport | None = None
        self.error: BaseException | None = None
        self._perception, self._source = perception, source
        self._stop, self._opened = threading.Event(), ExitStack()
        self._thread = threading.Thread(target=self._run, name="sidestep camera", daemon=True)
        self._since: dict[str, float] = {}  # when a camera's question was asked first [s]
        self._told: set[str] = set()

    @property
    def is_running(self) -> bool:
        """Whether the thread still waits for images: the source has not ended, and nothing went wrong."""
        return self._thread.is_alive()

    def wait(self, timeout: float | None = None) -> None:
        """Waits until the source has no more images, at most `timeout` [s]."""
        self._thread.join(timeout)

    def __enter__(self) -> Feed:
        if isinstance(self._source, AbstractContextManager):
            self._opened.enter_context(self._source)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop.set()
        self._thread.join(LONGEST_WAIT)
        if self._thread.is_alive():
            _warn(f"the source of images gave none for {LONGEST_WAIT:g} s and is left as it is")
            return
        self._opened.close()
        if self.error is not None and error is None:
            raise self.error

    def _run(self) -> None:
        frames = self._source.frames() if hasattr(self._source, "frames") else iter(self._source)
        try:
            for frame in frames:
                if self._stop.is_set():
                    break
                self._take(frame)
        except Exception as error:
            if not self._stop.is_set():
                self.error = error
                _warn(f"no more images: {error}")

    def _take(self, frame: Frame) -> None:
        report = take(self._perception, frame)
        self.report = report
        self.images += int(report.used)
        self.unused += int(not report.used)
        if not report.question:
            self._since.pop(frame.camera, None)
            return
        kind = re.sub(r"[-\d.]+", "", report.question)  # the same question with other figures
        if (
            frame.time - self._since.setdefault(frame.camera, frame.time) >= PATIENCE
            and kind not in self._told
        ):
            self._told.add(kind)
            _warn(report.question)


def _warn(words: str) -> None:
    """A warning that no caller is to blame for: it comes from the thread."""
    warnings.warn(words, RuntimeWarning, stacklevel=2)
