"""What viewers cost the studio's loop: its step times with three viewers connected and with none, in one run.

    python benchmarks/studio.py --json benchmarks/results/studio.json

The two are measured in turn, `--rounds` times, for each of `--methods`. A viewer here is a process that takes in
everything a browser is sent; it does not draw. A browser on the same machine also takes processor time, as any program
does: that is not counted. On a machine with other work, `chrt -r 1` in front of the command keeps that work out of loop
and viewers alike.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import time
from pathlib import Path

import numpy as np

from sidestep import __version__
from sidestep.bench.reach import cpu_name
from sidestep.studio import messages as m
from sidestep.studio.start import starting_scenario
from sidestep.studio.studio import Studio

VIEWERS = 3
WINDOW = (
    4.0  # [s] of each measurement; the first half is left out, the times kept are of the last two seconds
)


def view(address: str, stop: object) -> None:
    """Takes in what a browser is sent, until `stop` is set."""
    import asyncio

    import viser
    from websockets.asyncio.client import connect

    async def listen() -> None:
        protocol = [f"viser-v{viser.__version__}"]
        async with connect(address, subprotocols=protocol, max_size=None) as connection:  # type: ignore[arg-type]
            while not stop.is_set():  # type: ignore[attr-defined]
                try:
                    await asyncio.wait_for(connection.recv(), 0.2)
                except TimeoutError:
                    continue

    asyncio.run(listen())


def window(studio: Studio) -> m.Timing:
    """The times of the steps of the last two seconds, after a window of motion."""
    studio.send(m.Restart())
    time.sleep(WINDOW)
    assert studio.snapshot is not None
    return studio.snapshot.timing


def with_viewers(studio: Studio) -> m.Timing:
    """The same with viewers connected."""
    context = multiprocessing.get_context("spawn")
    stop = context.Event()
    address = studio.address.replace("http://", "ws://", 1)
    viewers = [context.Process(target=view, args=(address, stop)) for _ in range(VIEWERS)]
    for viewer in viewers:
        viewer.start()
    end = time.monotonic() + 60.0
    while len(studio.server._websock_server._client_state_from_id) < VIEWERS:  # they never report a camera
        if time.monotonic() > end:
            raise RuntimeError("the viewers did not connect")
        time.sleep(0.05)
    time.sleep(1.0)  # the scene is sent to them
    timing = window(studio)
    stop.set()
    for viewer in viewers:
        viewer.join()
    return timing


def measure(robot: str, method: str, ellipsoids: int | None, rounds: int) -> dict[str, object]:
    """Step times of a method, alone and with viewers in turn."""
    pairs = []
    with Studio(starting_scenario(robot=robot), method=method, port=0, ellipsoids=ellipsoids) as studio:
        studio.wait_ready(3600.0)
        for k in range(rounds):
            order = (window, with_viewers) if k % 2 == 0 else (with_viewers, window)
            first, second = (timed(studio) for timed in order)
            alone, seen = (first, second) if order[0] is window else (second, first)
            pairs.append((alone, seen))
            print(
                f"{method}, round {k}: p99 {alone.p99:.0f} us alone, {seen.p99:.0f} us with {VIEWERS} viewers",
                flush=True,
            )
    found: dict[str, object] = {
        "rounds": [
            {
                name: {"median_us": t.median, "p99_us": t.p99}
                for name, t in zip(("alone", "viewed"), pair, strict=True)
            }
            for pair in pairs
        ],
        "median_ratio": float(np.median([seen.median / alone.median for alone, seen in pairs])),
        "p99_ratio": float(np.median([seen.p99 / alone.p99 for alone, seen in pairs])),
    }
    print(f"{method}: median ratio of medians {found['median_ratio']:.3f}, of p99 {found['p99_ratio']:.3f}")
    return found


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robot", default="fr3_arm")
    parser.add_argument("--methods", nargs="+", default=["barrier", "unswitched"])
    parser.add_argument("--ellipsoids", type=int)
    parser.add_argument("--rounds", type=int, default=6)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    methods = {
        method: measure(options.robot, method, options.ellipsoids, options.rounds)
        for method in options.methods
    }
    document = {
        "robot": options.robot,
        "viewers": VIEWERS,
        "real_time_scheduling": os.sched_getscheduler(0) in (os.SCHED_FIFO, os.SCHED_RR),
        "methods": methods,
        "cpu": cpu_name(),
        "version": __version__,
    }
    if options.json is not None:
        options.json.write_text(json.dumps(document, indent=2) + "\n")


if __name__ == "__main__":
    main()
