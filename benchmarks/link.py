"""Times of a link to a served arm: round trip of a request, and age of the state when every cycle is sent.

    python benchmarks/link.py [--duration 10] [--zenoh] [--cpp build/benchmarks/benchmarks/cpp/link_benchmark]

Starts `sidestep serve planar3` with an ideal robot at 1 kHz in a process of its own, and prints JSON: times of a
client in Python, of one in C++ where its program is given, and with --zenoh of one in Python over Zenoh.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import sidestep as ss
from sidestep.link import Client

ENDPOINT = "tcp/127.0.0.1:17447"


def percentiles(seconds: list[float]) -> dict[str, float]:
    p50, p99, p999 = 1e6 * np.percentile(seconds, [50, 99, 99.9])
    return {
        "count": len(seconds),
        "p50_us": round(p50, 1),
        "p99_us": round(p99, 1),
        "p99.9_us": round(p999, 1),
        "worst_us": round(1e6 * max(seconds), 1),
    }


def measure(client: Client, duration: float) -> dict[str, object]:
    trips, ages, first, last = [], [], 0, 0
    end = time.monotonic() + duration
    while time.monotonic() < end:
        trips.append(client.ping())
    client.subscribe(np.inf)
    end = time.monotonic() + duration
    while time.monotonic() < end:
        if (cycle := client.next_cycle(after=last)) is not None:
            ages.append(time.monotonic() - cycle.time)
            last = cycle.number
            first = first or last
    missed = last - first + 1 - len(ages)
    return {"round_trip": percentiles(trips), "state_age": percentiles(ages), "cycles_missed": missed}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--duration", type=float, default=10.0, help="of each measurement [s]")
    parser.add_argument("--zenoh", action="store_true")
    parser.add_argument("--cpp", type=Path, help="link_benchmark, see benchmarks/cpp")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        address = f"{folder}/arm.sock"
        command = [sys.executable, "-m", "sidestep", "serve", "planar3", "--address", address, "--free"]
        command += ["--zenoh", "bench", "--zenoh-endpoint", ENDPOINT] if given.zenoh else []
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
            assert server.stdout is not None
            server.stdout.readline()
            found = {}
            with ss.connect(address, rate=0.0) as client:
                found["python"] = measure(client, given.duration)
            if given.cpp is not None:
                done = subprocess.run(
                    [given.cpp, address, str(given.duration)], check=True, capture_output=True, text=True
                )
                found["cpp"] = json.loads(done.stdout)
            if given.zenoh:
                token = Path(address).with_suffix(".token").read_text().strip()
                with ss.connect("zenoh/bench", token, rate=0.0, endpoint=ENDPOINT) as client:
                    found["zenoh"] = measure(client, given.duration)
            server.terminate()
    print(json.dumps(found, indent=2))


if __name__ == "__main__":
    main()
