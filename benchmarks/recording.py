"""What a recording costs: time and bytes a step, with and without it, in turns.

Run: python benchmarks/recording.py [--json FILE]
"""

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np

import sidestep as ss

ROBOTS = ("fr3", "ur10")
STEPS = 4000
TURNS = 5  # with and without, one after the other: the clock of a processor changes
PERCENTILES = (50, 99)


def one_run(arm: ss.Arm, path: Path | None) -> tuple[np.ndarray, int]:
    """Seconds of each step of a motion among balls, and bytes of the recording."""
    controller = ss.Controller(
        arm, ss.ControllerSettings(synchronous=True, planner=None, look_ahead=None, output="torque")
    )
    recording = None if path is None else controller.record(path)
    rng = np.random.default_rng(0)
    controller.set_obstacles(
        ss.Obstacles(rng.uniform(-0.8, 0.8, (50, 3)) + np.array([0, 0, 1.2]), radii=0.02)
    )
    controller.set_velocity(np.full(arm.num_coordinates, 0.05))
    record = ss.integrate(controller, arm.neutral, np.zeros(arm.num_coordinates), steps=STEPS)
    return record.step_seconds, 0 if recording is None else recording.stop().bytes


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in ROBOTS:
            arm = ss.Arm.load(name)
            without, recorded, size = [], [], 0
            for _ in range(TURNS):
                without.append(one_run(arm, None)[0])
                seconds, size = one_run(arm, Path(folder) / "run.step")
                recorded.append(seconds)
            row = {"robot": name, "steps": STEPS * TURNS, "bytes_a_step": size / STEPS}
            for what, times in (("without", without), ("recorded", recorded)):
                for p in PERCENTILES:
                    row[f"{what}_p{p}_us"] = 1e6 * float(np.percentile(np.concatenate(times), p))
            rows.append(row)
            print(
                f"{name}: {row['without_p50_us']:.2f} us a step, recorded {row['recorded_p50_us']:.2f} us; "
                f"p99 {row['without_p99_us']:.1f} and {row['recorded_p99_us']:.1f} us; "
                f"{row['bytes_a_step']:.0f} bytes a step"
            )
    if asked.json is not None:
        asked.json.write_text(json.dumps(rows, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
