"""The stand-in as a program: a UR on this machine, for trying programs without a robot.

    python -m sidestep.drivers.ur_stand_in [--robot ur10] [--frequency 500]

Clients find it at 127.0.0.1. What is typed happens to the robot: `help` lists it. It ends with `quit`, or with the end
of the input.
"""

from __future__ import annotations

import argparse
import json
import os
import stat
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from sidestep.arm import Arm
from sidestep.drivers.ur_stand_in.box import Box
from sidestep.drivers.ur_stand_in.server import Server

VERSIONS = {
    500: (5, 12, 0, 1101319),
    125: (3, 15, 8, 106339),
}  # of the software, by the rate of its RTDE [1/s]
START = (0.0, -1.6, 1.6, -1.6, -1.6, 0.0)  # [rad] of the joints
PRIORITY = 70  # of the thread, where real-time scheduling is asked for


class Typed:
    """Lines that are typed, and what they do to the robot."""

    def __init__(self, server: Server, moved: Moved) -> None:
        """For one server."""
        self._server, self._moved, self._rest = server, moved, b""
        box = server.box
        self._actions: dict[str, Callable[[], None]] = {
            "protective stop": lambda: box.protective_stop("typed"),
            "emergency stop": lambda: box.emergency_stop(True),
            "release": lambda: box.emergency_stop(False),
            "switch on": box.switch_on,
            "freedrive": lambda: box.set_freedrive(True),
            "freedrive end": lambda: box.set_freedrive(False),
            "stop program": box.stop_program,
            "deaf": lambda: self._be_deaf(True),
            "hear": lambda: self._be_deaf(False),
            "disconnect": server.disconnect,
            "fail": lambda: os._exit(1),
            "tell": self._tell,
            "help": self._help,
        }

    def __call__(self) -> bool:
        """Reads what was typed; false: the end."""
        data = os.read(sys.stdin.fileno(), 4096)
        *lines, self._rest = (self._rest + data).split(b"\n")
        for line in lines:
            words = line.decode("utf-8", "replace").strip()
            if words == "quit":
                return False
            if words.startswith("save "):
                self._moved.save(Path(words.removeprefix("save ")))
            elif words in self._actions:
                self._actions[words]()
            elif words:
                print(f"{words!r} is unknown; help lists what is known", flush=True)
        return bool(data)

    def _help(self) -> None:
        print(", ".join([*self._actions, "save FILE", "quit"]), flush=True)

    def _be_deaf(self, deaf: bool) -> None:
        self._server.deaf = deaf

    def _tell(self) -> None:
        box = self._server.box
        said = {"time": box.time, "safety": box.safety_words, "mode": box.mode_words, "playing": box.playing}
        joints = {"position": box.joints.position.tolist(), "velocity": box.joints.velocity.tolist()}
        print(json.dumps(said | joints | box.counts), flush=True)


class Moved:
    """Everything that the joints did since the last file."""

    def __init__(self, box: Box) -> None:
        """Nothing yet."""
        self._box = box
        self._rows: list[list[np.ndarray]] = []
        self._playing: list[bool] = []

    def note(self) -> None:
        """After each step."""
        joints = self._box.joints
        self._playing.append(self._box.playing)
        self._rows.append(
            [
                joints.position,
                joints.velocity,
                joints.target,
                joints.target_velocity,
                joints.target_acceleration,
                joints.torque,
            ]
        )

    def save(self, path: Path) -> None:
        """Writes position, velocity, target, target_velocity, target_acceleration, torque: (T, 6) each, and playing
        (T,): whether a program ran; begins anew."""
        names = ("position", "velocity", "target", "target_velocity", "target_acceleration", "torque")
        columns = np.array(self._rows).reshape(-1, len(names), len(self._box.joints.target))
        arrays: dict[str, Any] = {name: columns[:, index] for index, name in enumerate(names)}
        np.savez(path, playing=np.array(self._playing), **arrays)
        self._rows.clear()
        self._playing.clear()
        print(f"saved {path}", flush=True)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robot", choices=("ur5", "ur10"), default="ur10")
    parser.add_argument(
        "--frequency", type=int, choices=tuple(VERSIONS), default=500, help="500: as an e-Series"
    )
    parser.add_argument("--address", default="127.0.0.1", help="of this machine: 127.x.x.x")
    parser.add_argument("--start", type=float, nargs=6, default=START, metavar="RAD", help="of the joints")
    parser.add_argument(
        "--unlock-after", type=float, default=5.0, metavar="S", help="after a protective stop"
    )
    parser.add_argument("--real-time", action="store_true", help=f"SCHED_FIFO {PRIORITY}, where permitted")
    parser.add_argument("--record", action="store_true", help="keeps what the joints do for `save FILE`")
    return parser.parse_args()


def main() -> int:
    """Runs until it is told to end."""
    given = _arguments()
    period = 1.0 / given.frequency

    def log(words: str) -> None:
        print(f"{box.time:.3f} s: {words}", flush=True)

    box = Box(
        Arm.load(given.robot),
        np.array(given.start, dtype=float),
        period=period,
        unlock_after=given.unlock_after,
        log=log,
    )
    moved = Moved(box)
    if given.real_time:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
        except PermissionError:
            log("real-time scheduling is not permitted")
    with Server(
        box,
        address=given.address,
        model=given.robot.upper(),
        version=VERSIONS[given.frequency],
        on_tick=moved.note if given.record else lambda: None,
    ) as server:
        # A pipe or a terminal that ends is somebody who has left; /dev/null never said anything.
        mode = os.fstat(sys.stdin.fileno()).st_mode
        if stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode) or sys.stdin.isatty():
            server.watched[sys.stdin.fileno()] = Typed(server, moved)
        where = f"{given.robot.upper()} at {given.address}, {given.frequency} Hz"
        print(f"{where}; help lists what can be typed", flush=True)
        try:
            server.serve()
        except KeyboardInterrupt:
            return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
