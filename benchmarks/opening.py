"""How long it takes to open an arm that was never seen: until it moves, and until its fine body is in use.

    python benchmarks/opening.py FILE [FILE ...] [--json FILE]

Each file is opened in a process of its own with an empty cache, one after the other. Times are from the start of that
process, Python and its imports included, on whatever else the machine does:

- moves: the first step of a `Controller` on the draft that asks for motion, towards a joint goal;
- fine: the step before which the controller has taken the fine body over. It steps at 100 Hz meanwhile.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

Row = dict[str, Any]
LIMIT = 1800.0  # [s] of one arm
PERIOD = 0.01  # [s] between steps while the fine body is made
GOAL = 0.1  # [rad | m] of the goal from the start, in every joint


def open_arm(path: str, started: float) -> Row:
    """Opens an arm, moves it and waits for its fine body.

    Args:
        path: of the description.
        started: [s] of the system's clock, when the process was started.
    """
    import numpy as np

    import sidestep as ss
    from sidestep.arm import Refinement

    def since() -> float:
        return round(time.time() - started, 2)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        arm = ss.Arm.load(path, draft=True)
        row: Row = {"file": path, "arm": arm.name, "joints": arm.num_coordinates, "drafted": since()}
        controller = ss.Controller(arm)
        q, v = arm.neutral, 0.0 * arm.neutral
        controller.set_goal(q + GOAL * np.where(arm.limits.upper - q > q - arm.limits.lower, 1.0, -1.0))
        refinement = Refinement(arm, controller)
        while not refinement.is_done:
            command = controller.step(q, v)
            q, v = command.position, command.velocity
            if "moves" not in row and np.abs(v).max() > 0.0:
                row["moves"] = since()
            time.sleep(PERIOD)
        refinement.wait()
        controller.step(q, v)
        row["fine"] = since()
    return row


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", nargs="+", metavar="FILE", help="a URDF, xacro or MJCF file")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures")
    parser.add_argument("--one", type=float, metavar="STARTED", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one is not None:
        print(json.dumps(open_arm(given.files[0], given.one)))
        return
    rows = [opened(file) for file in given.files]
    print("| arm | joints | moves [s] | fine body in use [s] |\n|---|---|---|---|")
    for row in rows:
        print(f"| {row['arm']} | {row['joints']} | {row['moves']:.1f} | {row['fine']:.0f} |")
    if given.json:
        given.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


def opened(file: str) -> Row:
    """What `open_arm` says, in a process with an empty cache."""
    with tempfile.TemporaryDirectory() as cache:
        command = [sys.executable, __file__, file, "--one", str(time.time())]
        environment = {**os.environ, "SIDESTEP_CACHE_DIR": cache}
        done = subprocess.run(
            command, env=environment, stdout=subprocess.PIPE, timeout=LIMIT, check=True, text=True
        )
    row: Row = json.loads(done.stdout.splitlines()[-1])
    print(row, file=sys.stderr)
    return row


if __name__ == "__main__":
    main()
