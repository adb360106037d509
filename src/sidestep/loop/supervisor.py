"""A small separate process without whose approval nothing is written to a robot."""

from __future__ import annotations

import subprocess
import sys
import time
from types import TracebackType

from sidestep._core import Controller, SupervisorLink, SupervisorSettings
from sidestep.loop.child_process import end_process

LONGEST_START = 20.0  # [s] for the process to answer first, on a busy machine
LOOK_PERIOD = 0.1  # [s] between two looks whether it still lives, while it starts
LONGEST_END = 2.0  # [s] for it to end


class Supervisor:
    """Watches a loop from a process of its own: `with Supervisor(controller) as s: run(..., supervisor=s)`.

    The process shares memory with the loop. It knows the arm's limits and how old state, command and obstacles may be,
    and nothing of the controller. The loop writes a command only while the process approves: it denies by default, and
    its own end denies too. What was denied once stays denied until `reset`.
    """

    def __init__(self, controller: Controller, settings: SupervisorSettings | None = None) -> None:
        """Prepares it; the `with` block starts the process.

        Args:
            controller: whose arm's limits count, and whose output says what is written.
            settings: how far things may go.

        Raises:
            OSError: the machine has no memory that two processes share.
        """
        self.link = SupervisorLink(controller, settings)
        self._controller = controller
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Supervisor:
        """Starts the process, and waits until it answers.

        Raises:
            RuntimeError: it does not.
        """
        self._start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._process is not None:
            end_process(self._process, LONGEST_END)
        self._process = None

    def link_of(self, controller: Controller) -> SupervisorLink:
        """The loop's side of it, for a run of this controller.

        Raises:
            ValueError: it was made for another controller, and knows that one's limits and output.
        """
        if controller is not self._controller:
            raise ValueError(
                "supervisor is another controller's, must be Supervisor(controller) of the one that runs"
            )
        return self.link

    @property
    def process(self) -> int | None:
        """Number of the process; None: it does not run."""
        return None if self._process is None else self._process.pid

    @property
    def approves(self) -> bool:
        """Whether its last verdict approves."""
        return self.link.approves

    def reset(self) -> None:
        """What was denied may be tried again; a process that has died is started anew.

        Raises:
            RuntimeError: it does not answer.
        """
        self.link.reset()
        if self._process is not None and self._process.poll() is not None:
            self._start()

    def _start(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "sidestep.loop.supervise", self.link.path],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
        )
        give_up = time.monotonic() + LONGEST_START
        while not self.link.wait_for_supervisor(LOOK_PERIOD):
            ended = self._process.poll()
            if ended is not None or time.monotonic() > give_up:
                self.__exit__(None, None, None)
                raise RuntimeError(
                    f"supervisor: its process did not answer for {LONGEST_START:g} s"
                    if ended is None
                    else f"supervisor: its process ended at once, with exit status {ended}"
                )
