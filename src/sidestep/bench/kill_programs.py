"""The programs around the arm of a kill test, and what reads the robot's states beside them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sidestep._core import SimulatorDriver
from sidestep.link import Client, connect
from sidestep.loop.child_process import end_process, hearing_ctrl_c

Array = npt.NDArray[np.float64]

ROBOT = "fr3"
START = np.array([0.7, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
OBSTACLE = "sphere:0.08@0.45,0,0.5"  # in the way of the straight line
READY = 90.0  # [s] until a program answers, on a busy machine
LONGEST_END = 10.0  # [s] until a program has ended


class Watcher:
    """Reads the states of the simulator from a connection of its own, and keeps them."""

    def __init__(self, address: str) -> None:
        self._driver = SimulatorDriver(address)
        self.rows: list[tuple[float, Array, Array]] = []  # machine's time [s], q, v
        self.robot_time = 0.0  # [s] of the last state, on the robot's clock

    def look(self, seconds: float, until: Callable[[Array, Array], bool] | None = None) -> bool:
        """Reads for so long [s], or until a condition of q, v holds; whether it did."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            try:
                state = self._driver.read(len(START), 0.1)
            except RuntimeError:  # the simulator has ended
                return False
            if state is None:
                continue
            self.robot_time = state.time
            self.rows.append((time.monotonic(), state.q, state.v))
            if until is not None and until(state.q, state.v):
                return True
        return False

    def close(self) -> None:
        """Ends the connection."""
        self._driver.close()


class Programs:
    """Simulator and server of one case, and what they write."""

    def __init__(
        self,
        folder: Path,
        *,
        tcp: bool = False,
        camera: Path | None = None,
        clock_jump: float = 0.0,
        prefix: tuple[str, ...] = (),
    ) -> None:
        self.folder, self.prefix, self._camera, self._clock_jump = folder, prefix, camera, clock_jump
        self.motion = folder / "motion.npz"
        self.robot = "tcp:47111" if tcp else f"unix:{folder / 'robot'}"
        self.address = f"unix:{folder / 'arm'}"
        self.record = folder / "run.mcap"
        self.processes: dict[str, subprocess.Popen[bytes]] = {}

    def start_simulator(self) -> None:
        """Starts `sidestep simulate`, and waits until it listens."""
        words = ["simulate", ROBOT, "--object", OBSTACLE, "--start", ",".join(str(q) for q in START)]
        words += [
            "--address",
            self.robot,
            "--motion",
            str(self.motion),
            "--clock-jump",
            str(self._clock_jump),
        ]
        self._start("simulator", words, "listening")

    def start_server(self) -> None:
        """Starts `sidestep serve`, and waits until it listens."""
        words = ["serve", ROBOT, "--driver", "mujoco", "--robot", self.robot, "--address", self.address]
        words += ["--output", "position", "--record", str(self.record), "--supervise"]
        words += ["--free"] if self._camera is None else ["--camera", str(self._camera)]
        self._start("server", words, "serving")

    def _start(self, name: str, words: list[str], ready: str) -> None:
        process = self._open(name, [*self.prefix, sys.executable, "-u", "-m", "sidestep", *words])
        end = time.monotonic() + READY
        while ready not in self.said(name):
            if process.poll() is not None or time.monotonic() > end:
                raise RuntimeError(f"{name} did not start: {self.said(name)[-500:]}")
            time.sleep(0.05)

    def _open(self, name: str, words: list[str]) -> subprocess.Popen[bytes]:
        with (self.folder / f"{name}.log").open("wb") as log:
            process = subprocess.Popen(
                hearing_ctrl_c(words), stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT
            )
        self.processes[name] = process
        return process

    def said(self, name: str) -> str:
        """What a program has printed so far."""
        return (self.folder / f"{name}.log").read_text(encoding="utf-8", errors="replace")

    def run(self, name: str, code: str, *arguments: str) -> subprocess.Popen[bytes]:
        """Starts a small program beside them."""
        return self._open(name, [sys.executable, "-u", "-c", code, self.address, *arguments])

    def set_network(self, state: str) -> None:
        """Their network is "down" from now on, or "up"."""
        subprocess.run([*self.prefix, "ip", "link", "set", "lo", state], check=True)

    def connect(self, name: str) -> Client:
        """A client of the server."""
        return connect(self.address, name=name, rate=100.0, timeout=10.0)

    def kill(self, name: str, number: int = signal.SIGKILL) -> None:
        """Ends a program."""
        self.processes[name].send_signal(number)

    def supervisor(self) -> int:
        """Number of the supervisor's process."""
        server = self.processes["server"].pid
        for entry in Path("/proc").iterdir():
            if not entry.name.isdigit():
                continue
            try:
                parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
                words = (entry / "cmdline").read_bytes()
            except (OSError, ValueError, IndexError):
                continue
            if parent == server and b"supervise" in words:
                return int(entry.name)
        raise RuntimeError("the server has no supervisor")

    def end(self) -> None:
        """Ends all programs."""
        for process in self.processes.values():
            end_process(process, LONGEST_END)


@contextmanager
def own_network(wanted: bool) -> Iterator[tuple[str, ...]]:
    """The words before a command that give it a network of its own; none where that is not wanted.

    Raises:
        RuntimeError: the machine does not permit it.
    """
    if not wanted:
        yield ()
        return
    name = f"sidestep-{os.getpid()}"
    made = subprocess.run(["ip", "netns", "add", name], capture_output=True, text=True)
    if made.returncode:
        raise RuntimeError(f"no network of its own: {made.stderr.strip()}")
    prefix = ("ip", "netns", "exec", name)
    try:
        subprocess.run([*prefix, "ip", "link", "set", "lo", "up"], check=True)
        yield prefix
    finally:
        subprocess.run(["ip", "netns", "delete", name], check=False)


def write_front_camera(folder: Path) -> Path:
    """A file of the camera whose images the camera's program sends."""
    from sidestep.perception import CameraRecord, look_at
    from sidestep.perception.camera_file import write_camera

    path = folder / "camera.json"
    camera = CameraRecord(
        name="front",
        width=160,
        height=120,
        fx=80.0,
        fy=80.0,
        cx=79.5,
        cy=59.5,
        pose=look_at([2.5, 0.0, 0.6], [0.0, 0.0, 0.4]),
    )
    write_camera(path, camera)
    return path
