"""The fine body of an arm that was prepared in seconds, made beside the loop."""

from __future__ import annotations

import multiprocessing
import tempfile
import threading
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sidestep import _core
from sidestep._core import Controller
from sidestep.arm.arm import Arm

if TYPE_CHECKING:  # imported where they are needed
    from multiprocessing.connection import Connection

    from sidestep.arm.preparation import Progress


class Refinement:
    """Prepares the fine body of a draft in a process of its own, and hands it to controllers when it is done.

    Controllers go on: each takes the fine body over between two steps. It is in the user's cache from then on, if that
    can be written.

        arm = ss.Arm.load("arm.urdf", draft=True)
        controller = ss.Controller(arm)
        refinement = sidestep.arm.Refinement(arm, controller)

    Args:
        arm: of `Arm.load(..., draft=True)`; one that is fine already is done at once.
        controllers: of this arm, that are to have the fine body.
        progress: called, by a thread, as progress(stage, item, done, in_all), see `Arm.load`.
    """

    def __init__(self, arm: Arm, *controllers: Controller, progress: Progress | None = None) -> None:
        self._controllers = controllers
        self._progress = progress
        self._arm = arm
        self._error: str | None = None
        self._done = threading.Event()
        self._process: multiprocessing.process.BaseProcess | None = None
        if arm._request is None:
            self._done.set()
            return
        source, options = arm._request
        context = multiprocessing.get_context("spawn")
        messages, sending = context.Pipe(duplex=False)
        self._process = context.Process(target=_prepare, args=(source, options, sending), daemon=True)
        self._process.start()
        sending.close()  # so that the pipe ends with the process
        self._thread = threading.Thread(target=self._hand_over, args=(messages,), daemon=True)
        self._thread.start()

    @property
    def is_done(self) -> bool:
        """Whether it ended: with the fine arm, or an error, or because it was cancelled."""
        return self._done.is_set()

    @property
    def arm(self) -> Arm:
        """The fine arm when it is done, the draft until then."""
        return self._arm

    def wait(self, timeout: float | None = None) -> Arm:
        """The fine arm.

        Args:
            timeout: [s]; None waits for as long as it takes.

        Raises:
            TimeoutError: it is not done by then. RuntimeError: the preparation failed; says why.
        """
        if not self._done.wait(timeout):
            raise TimeoutError(f"the fine body of arm {self._arm.name!r} is not done after {timeout} s")
        if self._error is not None:
            raise RuntimeError(f"the fine body of arm {self._arm.name!r} could not be made: {self._error}")
        return self._arm

    def cancel(self) -> None:
        """Ends the preparation; controllers keep the draft."""
        if self._process is not None and self._process.is_alive():
            self._error = "it was cancelled"
            self._process.terminate()
        self._done.wait()

    def _hand_over(self, messages: Connection[Any, Any]) -> None:
        assert self._process is not None
        try:
            fine = Arm(self._received(messages), description=self._arm._description)
            for controller in self._controllers:
                controller.set_arm(fine)
            self._arm = fine
        except Exception as error:  # told by `wait`: a thread has nobody else to tell
            self._error = self._error or str(error)
        finally:
            self._done.set()
            self._process.join()

    def _received(self, messages: Connection[Any, Any]) -> _core.Arm:
        """The arm that the process prepares."""
        while True:
            try:
                message = messages.recv()
            except (EOFError, OSError):
                raise RuntimeError("its process ended") from None
            if isinstance(message, str):
                raise RuntimeError(message)
            if isinstance(message, bytes):
                with tempfile.TemporaryDirectory() as folder:
                    file = Path(folder) / "fine.arm"
                    file.write_bytes(message)
                    return _core.Arm.read(file)
            if self._progress is not None:
                self._progress(*message)


def _prepare(source: str | Path, options: Mapping[str, Any], messages: Connection[Any, Any]) -> None:
    """Of the process: sends how far it is, then the arm as a file has it, or what failed."""

    def progress(*told: object) -> None:
        messages.send(told)

    try:
        with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder:
            warnings.simplefilter("ignore")  # the draft's reading said them
            file = Path(folder) / "fine.arm"
            Arm.load(source, **options, progress=progress).save(file)
            messages.send(file.read_bytes())
    except Exception as error:
        messages.send(f"{type(error).__name__}: {error}")
