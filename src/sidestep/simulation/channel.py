"""A connection that is late and loses messages, in simulated time."""

from __future__ import annotations

import heapq
import itertools
import math
from typing import Generic, TypeVar

import numpy as np

from sidestep.simulation.link import Link

Message = TypeVar("Message")

DRAWN_EVERY = 1.0  # [s] after which the base delay is drawn anew: it changes slowly, beside the jitter


class Channel(Generic[Message]):
    """One direction of a `Link`: takes messages, and gives each when it arrives.

    Args:
        link: how late, how lossy. direction: number of the direction, so that two of one link differ.
    """

    def __init__(self, link: Link, direction: int) -> None:
        self._link = link
        self._rng = np.random.default_rng((link.seed, direction))
        self._waiting: list[tuple[float, int, Message]] = []
        self._number = itertools.count()
        self._newest = -1  # number of the newest that has arrived
        self._base, self._drawn = 0.0, -math.inf
        self.sent = self.lost = self.overtaken = 0

    def send(self, message: Message, time: float) -> None:
        """A message leaves at a time [s] that does not go back."""
        self.sent += 1
        if time - self._drawn >= DRAWN_EVERY:
            self._base, self._drawn = self._rng.uniform(*self._link.delay), time
        late = self._base + self._rng.exponential(self._link.jitter)
        if self._rng.random() < self._link.loss:
            self.lost += 1
            return
        heapq.heappush(self._waiting, (time + late, next(self._number), message))

    def arrived(self, time: float) -> Message | None:
        """The newest message that has arrived by a time [s] since the last call; None: no new one."""
        found = None
        while self._waiting and self._waiting[0][0] <= time + 1e-9:  # rounding of summed periods
            _, number, message = heapq.heappop(self._waiting)
            if number > self._newest:
                self.overtaken += found is not None
                self._newest, found = number, message
            else:
                self.overtaken += 1
        return found

    def clear(self) -> None:
        """What is on its way is forgotten."""
        self._waiting.clear()
