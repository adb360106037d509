"""Finer bodies of an arm, made beside the loop."""

from __future__ import annotations

import atexit
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from sidestep import _core
from sidestep._core import Controller
from sidestep.arm.arm import Arm
from sidestep.arm.tight_places import tight_links

if TYPE_CHECKING:  # imported where they are needed
    from sidestep.arm.preparation import Progress

LOOK = 0.5  # [s] between two looks at what controllers plan


class Refinement:
    """Prepares the fine body of a draft in a process of its own, and hands it to controllers when it is done.

    Controllers go on: each takes the fine body over between two steps. It is in the user's cache from then on, if that
    can be written.

        arm = ss.Arm.load("arm.urdf", draft=True)
        controller = ss.Controller(arm)
        refinement = sidestep.arm.Refinement(arm, controller)

    Covering ellipsoids are larger than links. So a planner may find a goal blocked, or no path, where the meshes are
    free. With `watch` the links that may be why get finer covers, which controllers take over in the same way: 24
    ellipsoids, then 48. The cache keeps them.

    Args:
        arm: of `Arm.load`. One that is fine already is done at once.
        controllers: of this arm, that are to have the finer bodies.
        watch: goes on after the fine body, until `cancel`.
        progress: called, by a thread, as progress(stage, item, done, in_all), see `Arm.load`.

    Raises:
        ValueError: to watch an arm that was read from an `.arm` file, which has no meshes.
    """

    def __init__(
        self, arm: Arm, *controllers: Controller, watch: bool = False, progress: Progress | None = None
    ) -> None:
        self._controllers = controllers
        self._progress = progress
        self._arm = arm
        self._error: str | None = None
        self._done = threading.Event()
        self._cancelled = threading.Event()
        self._process: subprocess.Popen[bytes] | None = None
        self._thread: threading.Thread | None = None
        if watch and arm._request is None:
            raise ValueError(
                f"arm {arm.name!r} was read from an .arm file or made from a robot, so that there is nothing to make a "
                "finer body from; load its description to watch it"
            )
        if not arm.is_draft:
            self._done.set()
        if arm.is_draft or watch:
            self._thread = threading.Thread(target=self._work, args=(watch,), daemon=True)
            atexit.register(self.cancel)
            self._thread.start()

    @property
    def is_done(self) -> bool:
        """Whether the fine body is there, or failed with an error, or was cancelled."""
        return self._done.is_set()

    @property
    def arm(self) -> Arm:
        """The finest arm that is done: the draft at first."""
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
        """Ends the preparation and the watch; controllers keep the body that they have."""
        if not self._done.is_set():
            self._error = "it was cancelled"
        self._cancelled.set()
        process, thread = self._process, self._thread
        if process is not None:
            process.kill()
        if thread is not None and thread is not threading.current_thread():
            thread.join()

    def _work(self, watch: bool) -> None:
        """Of the thread."""
        try:
            if self._arm.is_draft:
                self._hand_over({})
        except Exception as error:  # told by `wait`: a thread has nobody else to tell
            self._error = self._error or str(error)
        finally:
            self._done.set()
        try:
            while watch and self._error is None and not self._cancelled.wait(LOOK):
                if wanted := self._tight():
                    self._hand_over(wanted)
        except Exception as error:
            if not self._cancelled.is_set():
                warnings.warn(f"arm {self._arm.name!r}: no finer body: {error}", RuntimeWarning, stacklevel=1)
        finally:
            atexit.unregister(self.cancel)

    def _tight(self) -> dict[str, int]:
        """How many ellipsoids links are to have for what controllers plan."""
        found: dict[str, int] = {}
        for controller in self._controllers:
            for link, number in tight_links(controller, self._arm).items():
                found[link] = max(number, found.get(link, 0))
        return found

    def _hand_over(self, components: Mapping[str, int]) -> None:
        """Prepares the arm with so many ellipsoids of these links, and tells controllers."""
        assert self._arm._request is not None
        source, options = self._arm._request
        options = {**options, "components": {**options.get("components", {}), **components}}
        finer = Arm(self._prepared(source, options), description=self._arm._description)
        finer._request = source, options
        for controller in self._controllers:
            controller.set_arm(finer)
        self._arm = finer

    def _prepared(self, source: str | Path, options: Mapping[str, Any]) -> _core.Arm:
        """The arm that a process of its own prepares: one that does not run the caller's program again."""
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(folder for folder in sys.path if folder)}
        command = [sys.executable, "-c", "from sidestep.arm.refinement import work; work()"]
        process = subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self._process = process
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            if self._cancelled.is_set():
                raise RuntimeError("it was cancelled")
            try:
                with process.stdin as request:
                    pickle.dump((source, dict(options)), request)
            except BrokenPipeError:  # it ended: said below
                pass
            return self._received(process.stdout)
        finally:
            process.kill()
            process.stdout.close()
            process.wait()

    def _received(self, messages: IO[bytes]) -> _core.Arm:
        """What the process sends, up to the arm."""
        while True:
            try:
                message = pickle.load(messages)
            except (EOFError, pickle.UnpicklingError, OSError):
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


def work() -> None:
    """Of the process: reads what to prepare, and sends how far it is, then the arm as a file has it, or what failed."""
    with os.fdopen(os.dup(1), "wb") as messages:
        os.dup2(2, 1)  # what anything prints goes elsewhere
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the caller, who ends this process

        def send(message: object) -> None:
            pickle.dump(message, messages)
            messages.flush()

        try:
            source, options = pickle.load(sys.stdin.buffer)
            with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder:
                warnings.simplefilter("ignore")  # the draft's reading said them
                file = Path(folder) / "fine.arm"
                Arm.load(source, **options, progress=lambda *told: send(told)).save(file)
                send(file.read_bytes())
        except Exception as error:
            send(f"{type(error).__name__}: {error}")
