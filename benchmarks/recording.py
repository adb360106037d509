"""What recordings and black boxes cost: time of a step, bytes a minute, and how fast a recording is replayed.

Run: python benchmarks/recording.py [--json FILE]
"""

import argparse
import json
import tempfile
import time
from contextlib import nullcontext
from pathlib import Path

import numpy as np

import sidestep as ss

ROBOTS = ("fr3", "ur10")
STEPS = 4000
TURNS = 5  # each way one after the other: the clock of a processor changes
PERCENTILES = (50, 99)
CLOUD = 3000  # points of a camera's source, 30 times a second
NOISE = 0.002  # of each point, each time [m]
WAYS = ("without", "recorded", "black box", "both")


def controller_of(arm: ss.Arm) -> ss.Controller:
    made = ss.Controller(
        arm, ss.ControllerSettings(synchronous=True, planner=None, look_ahead=None, output="torque")
    )
    rng = np.random.default_rng(0)
    made.set_obstacles(ss.Obstacles(rng.uniform(-0.8, 0.8, (50, 3)) + np.array([0, 0, 1.2]), radii=0.02))
    made.set_velocity(np.full(arm.num_coordinates, 0.05))
    return made


def one_run(arm: ss.Arm, folder: Path, way: str) -> tuple[np.ndarray, int]:
    """Seconds of each step of a motion among balls, and bytes of the recording."""
    controller = controller_of(arm)
    path = folder / "run.mcap"
    record = controller.record(path) if way in ("recorded", "both") else nullcontext()
    box = controller.black_box(folder / "boxes") if way in ("black box", "both") else nullcontext()
    with record, box:
        motion = ss.integrate(controller, arm.neutral, np.zeros(arm.num_coordinates), steps=STEPS)
    return motion.step_seconds, path.stat().st_size if way == "recorded" else 0


def with_a_camera(arm: ss.Arm, folder: Path) -> dict[str, float]:
    """A minute at 1 kHz with the set of a camera at 30 Hz: bytes, and how fast it is replayed."""
    controller = controller_of(arm)
    rng = np.random.default_rng(1)
    cloud = rng.uniform(-0.5, 0.5, (CLOUD, 3)) + np.array([1.5, 0.0, 0.5])
    path, seconds = folder / "camera.mcap", 60
    q, v = arm.neutral, np.zeros(arm.num_coordinates)
    with controller.record(path):
        for k in range(1000 * seconds):
            if k % 33 == 0:
                seen = (cloud + rng.normal(0.0, NOISE, cloud.shape)).astype(np.float32)
                controller.set_obstacles(ss.Obstacles(seen, radii=0.01), source="camera", time=0.001 * k)
            command = controller.step(q, v, time=0.001 * k)
            v = v + 0.001 * command.acceleration
            q = q + 0.001 * v
    begin = time.perf_counter()
    result = ss.replay(path)
    replay = time.perf_counter() - begin
    begin = time.perf_counter()
    ss.load_recording(path)
    assert result.equal
    return {
        "megabytes_a_minute": path.stat().st_size / 1e6,
        "replay_times_real_time": seconds / replay,
        "load_times_real_time": seconds / (time.perf_counter() - begin),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in ROBOTS:
            arm = ss.Arm.load(name)
            times: dict[str, list[np.ndarray]] = {way: [] for way in WAYS}
            size = 0
            for _ in range(TURNS):
                for way in WAYS:
                    seconds, bytes_ = one_run(arm, Path(folder), way)
                    times[way].append(seconds)
                    size = max(size, bytes_)
            row = {"robot": name, "steps": STEPS * TURNS, "bytes_a_step": size / STEPS}
            for way, found in times.items():
                for p in PERCENTILES:
                    row[f"{way}_p{p}_us"] = 1e6 * float(np.percentile(np.concatenate(found), p))
            if name == ROBOTS[0]:
                row |= with_a_camera(arm, Path(folder))
            rows.append(row)
            print(
                f"{name}: " + ", ".join(f"{key} {value:.4g}" for key, value in row.items() if key != "robot")
            )
    if asked.json is not None:
        asked.json.write_text(json.dumps(rows, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
