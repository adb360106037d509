"""The time stamps of a device's own clock, on the clock of the machine."""

from __future__ import annotations

import math

WINDOW = 10.0  # [s] after which an offset is forgotten: clocks that differ by 50 ppm differ by 0.5 ms in it


class LeastDelayClock:
    """Turns a robot's or a camera's stamps into times of `time.monotonic()`: stamp + offset.

    The offset is the least of (arrival - stamp) in the last 10 to 20 s: what came soonest was the least delayed, and
    clocks may drift apart. The shortest transport is not known, so that times are too late by it.

    Attributes:
        offset: added to the last stamp [s]; inf before the first.
    """

    def __init__(self) -> None:
        """Begins without an offset."""
        self.offset = self._least = self._least_before = math.inf
        self._begin = self._last = -math.inf

    def measured(self, stamp: float, arrival: float) -> float:
        """When a sample was measured, on the clock of `time.monotonic()` [s]; at most its arrival.

        Args:
            stamp: of the device [s]. One that goes back by more than 10 s is a device that began anew.
            arrival: on the machine's clock [s].
        """
        is_new = stamp < self._last - WINDOW
        if is_new:
            self._least = self._least_before = math.inf
        if is_new or stamp - self._begin > WINDOW:
            self._begin, self._least_before, self._least = stamp, self._least, math.inf
        self._last = stamp
        self._least = min(self._least, arrival - stamp)
        self.offset = min(self._least, self._least_before)
        return stamp + self.offset
