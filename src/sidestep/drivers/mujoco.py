"""The simulator of `sidestep simulate` in a process of its own, and the driver that talks to it."""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
import tempfile
from os import PathLike
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from sidestep._core import SimulatorDriver
from sidestep.loop.child_process import end_process

Array = npt.NDArray[np.float64]

READY = 300.0  # [s] until the simulator listens: meshes of an arm that was never loaded take long
ENDING = 10.0  # [s] until it has written what came of it


class Scene(Protocol):
    """A `Scenario`, or what else can be written as the file of one."""

    def save(self, path: str | Path) -> None:
        """Writes it."""


class MuJoCo(SimulatorDriver):
    """A robot in MuJoCo, at 1 kHz in a process of its own, which ends with the `with` block, or with this program.

        with ss.drivers.MuJoCo("thesis-6.2.3") as driver:
            ss.run(controller, driver)
        print(driver.report["contacts"])

    Args:
        scene: a scenario file, a name of a shipped scenario or of a robot, or a `Scenario`.
        delay: (least, most) [s] of messages, in each direction; drawn once a second.
        jitter: mean of what each message takes longer [s]. loss: share of the messages that are lost.
        seed: of delays and losses.
        speed: simulated time per time of the machine; 0: as fast as the loop answers.
        hold: cycles without a command for which the last one holds; then the robot brakes. None: as many as
            `sidestep simulate` has by default.
        leap: torques leap as they are told; else its drives approach larger steps, as after lost messages, at the
            limits of the torque's rate.
        motion: file for the true motion (.npz): time, q, v, torque, object_poses.

    Attributes:
        report: what came of it, after the end: contacts, limits exceeded, messages lost, as `sidestep simulate --json`.

    Raises:
        RuntimeError: the simulator did not start; says why.
    """

    def __init__(
        self,
        scene: str | PathLike[str] | Scene,
        *,
        delay: tuple[float, float] = (0.0, 0.0),
        jitter: float = 0.0,
        loss: float = 0.0,
        seed: int = 0,
        speed: float = 1.0,
        hold: int | None = None,
        leap: bool = False,
        motion: str | PathLike[str] | None = None,
    ) -> None:
        self.report: dict[str, Any] = {}
        self._folder = tempfile.TemporaryDirectory(prefix="sidestep-", ignore_cleanup_errors=True)
        folder = Path(self._folder.name)
        if not isinstance(scene, str | PathLike):
            scene.save(folder / "scene.yaml")
            scene = folder / "scene.yaml"
        command = [
            sys.executable,
            "-m",
            "sidestep",
            "simulate",
            str(scene),
            "--parent",
            str(os.getpid()),
            "--quiet",
        ]
        command += ["--address", f"unix:{folder / 'robot'}", "--json", str(folder / "report.json")]
        command += ["--delay", f"{1e3 * delay[0]}:{1e3 * delay[1]}", "--jitter", str(1e3 * jitter)]
        command += ["--loss", str(loss), "--seed", str(seed), "--speed", str(speed)]
        command += [] if hold is None else ["--hold", str(hold)]
        command += ["--leap"] if leap else []
        command += [] if motion is None else ["--motion", str(Path(motion).absolute())]
        self._errors = (folder / "errors").open("w+", encoding="utf-8")
        self._process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=self._errors
        )
        try:
            super().__init__(self._address())
        except BaseException:
            self._end_process()
            raise

    def __enter__(self) -> MuJoCo:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()
        self.close()

    def close(self) -> None:
        """Ends the connection and the simulator, and reads its report; again does nothing."""
        super().close()
        self._end_process()

    @property
    def pid(self) -> int:
        """Number of the simulator's process."""
        return self._process.pid

    def _address(self) -> str:
        """Where the simulator listens, once it does."""
        output = self._process.stdout
        assert output is not None
        ready, _, _ = select.select([output], [], [], READY)
        line = output.readline().decode() if ready else ""
        words = line.split()
        if words[:2] != ["listening", "at"]:
            self._errors.seek(0)
            said = self._errors.read().strip() or (
                f"it said {line!r}" if ready else f"silent for {READY:g} s"
            )
            raise RuntimeError(f"the simulator did not start: {said}")
        return words[2]

    def _end_process(self) -> None:
        end_process(self._process, ENDING)
        if self._process.stdout is not None:
            self._process.stdout.close()
        self._errors.close()
        found = Path(self._folder.name) / "report.json"
        if found.is_file():
            self.report = json.loads(found.read_text(encoding="utf-8"))
        self._folder.cleanup()
