"""What the page tells the loop: sent by a thread of its own, and of a stream of places only the latest."""

from __future__ import annotations

import contextlib
import threading
from multiprocessing.connection import Connection
from typing import Any

from sidestep.studio import messages as m


class CommandQueue:
    """Commands on their way through a connection; `put` never waits, however long the other end does.

    Args:
        connection: to the process of the loop. A connection that is closed or broken ends the thread.
    """

    def __init__(self, connection: Connection[Any, Any]) -> None:
        self._connection = connection
        self._waiting: list[m.Command] = []
        self._wake = threading.Condition()
        self._stopping = False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def put(self, command: m.Command) -> None:
        """Adds a command, see `add`."""
        with self._wake:
            if not self._stopping:
                add(self._waiting, command)
                self._wake.notify()

    def stop(self) -> None:
        """What waits is not sent."""
        with self._wake:
            self._stopping = True
            self._waiting.clear()
            self._wake.notify()

    def join(self, timeout: float) -> None:
        """Waits for the end of the thread, at most `timeout` [s]."""
        self._thread.join(timeout)

    def _run(self) -> None:
        with contextlib.suppress(OSError, ValueError):
            while True:
                with self._wake:
                    while not self._waiting and not self._stopping:
                        self._wake.wait()
                    if self._stopping:
                        return
                    command = self._waiting.pop(0)
                self._connection.send(command)
        with self._wake:
            self._stopping = True  # of a loop that has ended nothing is heard


def add(waiting: list[m.Command], command: m.Command) -> None:
    """Appends a command to those that wait. One that says the same thing later takes the place of the earlier: a place
    of the same obstacle, or a goal; unless something else happens between the two.
    """
    stream = stream_of(command)
    if stream is not None:
        for index in range(len(waiting) - 1, -1, -1):
            other = stream_of(waiting[index])
            if other == stream:
                del waiting[index]
                break
            if other is None and not isinstance(waiting[index], m.Seen | m.Drawn):
                break
    waiting.append(command)


def stream_of(command: m.Command) -> tuple[str, str] | None:
    """What a command is a new value of; None of one that has to be done in any case."""
    match command:
        case m.DragObstacle(name, pose) if pose is not None:
            return "place", name
        case m.SetJointGoal() | m.SetPoseGoal():
            return "goal", ""
    return None
