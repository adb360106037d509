"""The stand-in as a process of its own, for programs that need one for a while."""

from __future__ import annotations

import json
import queue
import subprocess
import sys
import threading
from pathlib import Path
from types import TracebackType
from typing import Any

ANSWER = 10.0  # [s] in which it must answer
START = 60.0  # [s] in which it must listen: Python starts, the arm is loaded


class StandInProcess:
    """Runs `python -m sidestep.drivers.ur_stand_in`; a context manager. It ends with this process.

    Attributes:
        log: what it said so far, a line each.
    """

    def __init__(self, *arguments: str) -> None:
        """Starts it, and waits until it listens.

        Args:
            arguments: of its command line.

        Raises:
            RuntimeError: it did not start, and what it said.
        """
        self.log: list[str] = []
        self._answers: queue.Queue[str] = queue.Queue()
        self._process = subprocess.Popen(
            [sys.executable, "-m", "sidestep.drivers.ur_stand_in", *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        try:
            self._answer("UR", START)
        except RuntimeError:
            self.kill()
            raise

    def __enter__(self) -> StandInProcess:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.kill()

    def say(self, line: str) -> None:
        """Types a line, for example "protective stop"; see `help`."""
        assert self._process.stdin is not None
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()

    def tell(self) -> dict[str, Any]:
        """Time, safety, mode, playing, position and velocity of the robot, and how often what happened."""
        self.say("tell")
        told: dict[str, Any] = json.loads(self._answer("{", ANSWER))
        return told

    def save(self, path: Path) -> None:
        """Has it write what the joints did since the last call; it must have been started with --record."""
        self.say(f"save {path}")
        self._answer("saved", ANSWER)

    def kill(self) -> None:
        """Ends it at once, as a box whose power fails."""
        self._process.kill()
        self._process.wait()
        self._listener.join(ANSWER)
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()

    def _listen(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.log.append(line.rstrip("\n"))
            self._answers.put(self.log[-1])
        self._answers.put("")

    def _answer(self, begin: str, seconds: float) -> str:
        while True:
            try:
                line = self._answers.get(timeout=seconds)
            except queue.Empty:
                raise RuntimeError(
                    f"the stand-in says nothing for {seconds:g} s; before: {self.log[-5:]}"
                ) from None
            if line.startswith(begin):
                return line
            if not line:
                raise RuntimeError("the stand-in has ended: " + "\n".join(self.log[-20:]))
