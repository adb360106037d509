"""Calls in a process of their own, which may crash or hang without ending the run."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import tempfile
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any


class CrashedError(Exception):
    """The process ended within a call, or the function raised."""


class GuardedProcess:
    """A process that calls one function after another; a new one takes its place after a crash or time-out.

    Args:
        seconds: that a call may take, with the start of the process.
    """

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self._process: Any = None
        self._pipe: Any = None
        self._folder: Any = None

    def call(self, function: Callable[..., Any], *arguments: object) -> Any:
        """What a function of a module returns.

        Raises:
            CrashedError: the process ended, or the function raised.
            TimeoutError: the call took too long, and was ended.
        """
        if self._process is None:
            self._start()
        try:
            self._pipe.send((function, arguments))
            if not self._pipe.poll(self.seconds):
                self.close()
                raise TimeoutError(f"longer than {self.seconds:g} s")
            returned, value = self._pipe.recv()
        except (EOFError, ConnectionError):
            self._process.join()
            code = self._process.exitcode
            self.close()
            raise CrashedError(f"the process ended with code {code}") from None
        if not returned:
            raise CrashedError(value)
        return value

    def close(self) -> None:
        """Ends the process."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._pipe.close()
            self._folder.cleanup()
            self._process = self._pipe = self._folder = None

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._folder = tempfile.TemporaryDirectory()
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, self._folder.name))
        self._process.start()
        theirs.close()


def _serve(pipe: Connection, folder: str) -> None:
    """Answers calls until the pipe closes; what libraries print is dropped, what they write where they run goes."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    os.chdir(folder)
    with contextlib.suppress(EOFError):
        while True:
            function, arguments = pipe.recv()
            try:
                answer = True, function(*arguments)
            except Exception as error:  # to be told where the call was made
                answer = False, f"{type(error).__name__}: {error}"
            pipe.send(answer)
