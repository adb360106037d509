"""When cycles are due by the machine's clock."""

from __future__ import annotations

import time as clock

LATEST = 0.05  # [s] late: what falls farther behind goes on from now, and does not hurry after the clock


class Pace:
    """Deadlines a period [s] apart.

    Attributes:
        late: cycles that ended more than a period after they were due. slips: times that it fell behind by `LATEST`.
    """

    def __init__(self, period: float) -> None:
        self._period = period
        self._due = clock.monotonic() + period
        self.late = self.slips = 0

    def begin(self) -> None:
        """The next cycle is due a period from now."""
        self._due = clock.monotonic() + self._period

    def left(self) -> float:
        """Time [s] until this cycle is due; negative: late."""
        return self._due - clock.monotonic()

    def next(self) -> None:
        """This cycle has ended."""
        behind = -self.left()
        self.late += behind > self._period
        if behind > LATEST:
            self.slips += 1
            self.begin()
        else:
            self._due += self._period
