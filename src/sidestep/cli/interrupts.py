"""Ctrl-C and SIGTERM as something that a program looks at."""

from __future__ import annotations

import signal
import time
from types import FrameType, TracebackType
from typing import Any

LOOK_PERIOD = 0.02  # [s] between two looks while it waits


class Interrupts:
    """Takes Ctrl-C and SIGTERM while its `with` block lasts: they raise nothing, so they break into no call half done.

    For the main thread. A signal that this program was started deaf to stays unheard.

    Attributes:
        came: whether there was one.
    """

    def __init__(self) -> None:
        self.came = False
        self._before: dict[signal.Signals, Any] = {}

    def wait(self, seconds: float) -> bool:
        """Waits for one, so long at most; whether there was one."""
        end = time.monotonic() + seconds
        while not self.came and (left := end - time.monotonic()) > 0.0:
            time.sleep(min(left, LOOK_PERIOD))
        return self.came

    def __enter__(self) -> Interrupts:
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) not in (signal.SIG_IGN, None):
                self._before[number] = signal.signal(number, self._take)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _take(self, number: int, frame: FrameType | None) -> None:
        self.came = True
