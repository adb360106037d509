"""The fine body of an arm that was prepared in seconds, made beside the loop."""

from __future__ import annotations

import multiprocessing
import threading
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sidestep._core import Controller
from sidestep.arm.arm import Arm


class Refinement:
    """Prepares the fine body of a draft in a process of its own, and hands it to controllers when it is done.

    Controllers go on: each takes the fine body over between two steps. It is in the user's cache from then on.

        arm = ss.Arm.load("arm.urdf", draft=True)
        controller = ss.Controller(arm)
        refinement = sidestep.arm.Refinement(arm, controller)

    Args:
        arm: of `Arm.load(..., draft=True)`; one that is fine already is done at once.
        controllers: of this arm, that are to have the fine body.
    """

    def __init__(self, arm: Arm, *controllers: Controller) -> None:
        self._controllers = controllers
        self._arm = arm
        self._error: str | None = None
        self._done = threading.Event()
        self._process: multiprocessing.process.BaseProcess | None = None
        if arm._request is None:
            self._done.set()
            return
        source, options = arm._request
        context = multiprocessing.get_context("spawn")
        messages = context.SimpleQueue()
        self._process = context.Process(target=_prepare, args=(source, options, messages), daemon=True)
        self._process.start()
        self._thread = threading.Thread(target=self._hand_over, args=(source, options, messages), daemon=True)
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

    def _hand_over(self, source: str | Path, options: Mapping[str, Any], messages: Any) -> None:
        assert self._process is not None
        try:
            self._process.join()
            failure = messages.get() if not messages.empty() else "its process ended"
            if failure:
                raise RuntimeError(self._error or failure)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # the draft's reading said them
                fine = Arm.load(source, **options)
            for controller in self._controllers:
                controller.set_arm(fine)
            self._arm = fine
        except Exception as error:  # told by `wait`: a thread has nobody else to tell
            self._error = str(error)
        finally:
            self._done.set()


def _prepare(source: str | Path, options: Mapping[str, Any], messages: Any) -> None:
    """Of the process: puts the arm into the user's cache; tells what failed, or nothing."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            Arm.load(source, **options)
        messages.put("")
    except Exception as error:
        messages.put(f"{type(error).__name__}: {error}")
