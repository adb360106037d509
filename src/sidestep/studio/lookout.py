"""Looks ahead beside a loop, and says what to fly."""

from __future__ import annotations

import copy
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np
import numpy.typing as npt

from sidestep._core import Evasion, Flight, JointGoal, Obstacles, PoseGoal

Array = npt.NDArray[np.float64]


class Lookout:
    """Looks of an `Evasion` in a thread of their own, one after the other, while a loop goes on.

    Args:
        evasion: that nothing else uses. delay: of it, and period: of the loop [s].
    """

    def __init__(self, evasion: Evasion, *, delay: float, period: float) -> None:
        self._evasion, self._period = evasion, period
        self._periods = max(1, round(delay / period))
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="sidestep-lookout")
        self._look: Future[Flight | None] | None = None
        self._since = 0  # periods since the look began
        self.flight: Flight | None = None

    def follow(self, goal: JointGoal | PoseGoal, q: Array, v: Array, obstacles: Obstacles) -> Flight | None:
        """What to fly in this period, None where the way to the goal is free: never waits for a look.

        Raises what a look raised, once.
        """
        self._since += 1
        if self.flight is not None:
            self.flight.advance(self._period)
        if self._look is not None and self._since >= self._periods and self._look.done():
            look, self._look = self._look, None
            self.flight = look.result()
            if self.flight is not None:
                for _ in range(self._since - self._periods):  # it came late
                    self.flight.advance(self._period)
        if self._look is None:
            now = goal, q.copy(), v.copy(), obstacles, copy.copy(self.flight)
            self._look = self._thread.submit(self._evasion.look, *now)
            self._since = 0
        return self.flight
