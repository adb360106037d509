"""Tells a person at a terminal or in a notebook how far the preparation of an arm is."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

EVERY = 1.0  # [s] between two lines
SHARES = {
    "cover": (0.0, 0.6),
    "tables": (0.6, 0.8),
    "pairs": (0.8, 1.0),
}  # of the time, as seen of arms of 6-8 joints


class Telling:
    """A progress of `Arm.load` that writes one line, over and over: how far, and for how long it will go on.

    Args:
        name: of what is prepared. write: takes the lines; stderr by default.
    """

    def __init__(self, name: str, write: Callable[[str], object] | None = None) -> None:
        self._name = name
        self._write = write or sys.stderr.write
        self._begin = time.monotonic()
        self._told = float("-inf")
        self._wrote = False

    def __call__(self, stage: str, item: str, done: int, in_all: int) -> None:
        """See `Arm.load`."""
        now = time.monotonic()
        if now - self._told < EVERY:
            return
        self._told, self._wrote = now, True
        first, last = SHARES[stage]
        share = first + (last - first) * done / max(1, in_all)
        left = (now - self._begin) * (1.0 - share) / share if share > 0.02 else None
        remaining = "" if left is None else f", about {_duration(left)} left"
        self._write(f"\rpreparing {self._name}: {100.0 * share:3.0f} % ({stage} of {item}){remaining}\033[K")

    def end(self, words: str) -> None:
        """Writes the last words in place of the line, if there was one."""
        self._write(("\r\033[K" if self._wrote else "") + words + "\n")


def somebody_watches() -> bool:
    """Whether stderr is a terminal, or this is a notebook."""
    return sys.stderr.isatty() or "ipykernel" in sys.modules


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 90.0 else f"{seconds / 60.0:.0f} min"
