"""Whether a UR comes to rest within its limits when the program that drives it is killed.

    python benchmarks/ur_killed.py [--kills 10] [--json FILE]

The robot is Sidestep's stand-in (see ur_stand_in.py), a UR10 at 500 Hz. A program of its own drives the arm by
`sidestep.run`, with positions or velocities, and is killed (SIGKILL) on the way, at a random time. Told are how fast
the arm was, how far its joints still moved, the largest acceleration of the robot's target from then on, and whether it
rests.

Exit code 1 where the arm was slower than `MOVES` when the program was killed, did not rest within `REST_TIME`, or the
robot had to stop it by a protective stop.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from sidestep.drivers.ur_stand_in.process import StandInProcess

REST_TIME = 0.6  # [s] from the kill until the arm must rest
RESTS, MOVES = 1e-3, 0.1  # [rad/s]
WAY = (0.45, 0.8)  # [s] from the begin of the motion until the kill
PERIOD = 0.002  # [s]
PROGRAM = """
import sys
import sidestep as ss

with ss.drivers.UR("127.0.0.1") as robot:
    state = robot.read(1.0)
    settings = ss.ControllerSettings(output=sys.argv[1], period=robot.description.period, limit_margin=0.05)
    controller = ss.Controller(ss.Arm.load("ur10"), settings)
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal([1.5 if state.q[0] < 0.5 else -0.5, -1.6, 1.6, -1.6, -1.6, 0.0])
    print("moves", flush=True)
    ss.run(controller, robot, duration=20.0)
"""


def killed(robot: StandInProcess, output: str, after: float) -> dict[str, Any]:
    """Drives the arm, kills the driving program after some time [s], and tells what the arm did.

    Raises:
        RuntimeError: the program did not begin.
    """
    robot.say("switch on")
    before = robot.tell()
    with subprocess.Popen([sys.executable, "-c", PROGRAM, output], stdout=subprocess.PIPE) as program:
        assert program.stdout is not None
        try:
            if (said := program.stdout.readline()) != b"moves\n":
                raise RuntimeError(f"the program that drives the arm did not begin; it said {said!r}")
            time.sleep(after)
        finally:
            program.kill()
        at_kill = robot.tell()
    time.sleep(REST_TIME)
    now = robot.tell()
    with tempfile.TemporaryDirectory() as folder:
        robot.save(Path(folder) / "moved.npz")
        moved = np.load(Path(folder) / "moved.npz")
    since = -round((now["time"] - at_kill["time"]) / PERIOD)
    return {
        "output": output,
        "speed": float(np.abs(at_kill["velocity"]).max()),
        "moved_on_rad": float(np.abs(np.array(now["position"]) - at_kill["position"]).max()),
        "acceleration": float(np.abs(moved["target_acceleration"][since:]).max()),
        "rests": bool(np.abs(now["velocity"]).max() < RESTS),
        "protective_stops": now["protective stops"] - before["protective stops"],
    }


def line(run: dict[str, Any]) -> str:
    """One kill in words."""
    rests = "rests" if run["rests"] else "DOES NOT REST"
    return (
        f"{run['output']}: killed at {run['speed']:.2f} rad/s, moved on by {run['moved_on_rad']:.3f} rad with at most "
        f"{run['acceleration']:.1f} rad/s²; {rests}; {run['protective_stops']} protective stops"
    )


def is_good(run: dict[str, Any]) -> bool:
    """Whether the arm moved, came to rest, and needed no protective stop for it."""
    return bool(run["speed"] > MOVES and run["rests"] and not run["protective_stops"])


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kills", type=int, default=10, help="with positions, and with velocities")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", metavar="FILE")
    given = parser.parse_args()
    rng, runs = np.random.default_rng((52, given.seed)), []
    with StandInProcess("--real-time", "--record") as robot:
        for output in ("position", "velocity"):
            for _ in range(given.kills):
                runs.append(killed(robot, output, rng.uniform(*WAY)))
                print(line(runs[-1]), flush=True)
    if given.json:
        Path(given.json).write_text(json.dumps(runs, indent=1), encoding="utf-8")
    return 0 if all(is_good(run) for run in runs) else 1


if __name__ == "__main__":
    sys.exit(main())
