"""One step from Python at the settings of the thesis's Table 6.1: 2, 3 and 7 joints, one Gaussian per link.

python benchmarks/step.py --json -
"""

import argparse
import json
import platform
import time
from pathlib import Path

import numpy as np

import sidestep as ss

ROBOTS = ("planar2", "planar3", "fr3_arm")
NUM_STATES = 1000
NUM_STEPS = 50_000


def cpu_model() -> str:
    """Model name of the processor, from the kernel."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "unknown")


def one_gaussian_per_joint(robot: ss.Robot) -> ss.Body:
    """By hand: a ball of 8 cm on the first link of every joint."""
    links = [next(f.name for f in robot.frames if f.joint == j) for j in range(len(robot.joints))]
    num = len(links)
    return ss.Body(
        links=links,
        weights=np.ones(num),
        means=np.zeros((num, 3)),
        covariances=np.tile(0.08**2 * np.eye(3), (num, 1, 1)),
    )


def measure(name: str) -> dict[str, object]:
    """Times `GeometricSystem.acceleration` and reading its result, call by call."""
    robot = ss.Robot.named(name)
    system = ss.GeometricSystem([ss.CollisionDensity(robot, one_gaussian_per_joint(robot))])
    obstacles = ss.Obstacles([[0.4, 0.1, 0.3]])
    rng = np.random.default_rng(0)
    nv = robot.num_coordinates
    states = [(robot.random_configuration(rng), rng.normal(size=nv)) for _ in range(NUM_STATES)]
    goal = robot.neutral
    samples = np.empty(NUM_STEPS)
    for k in range(-NUM_STEPS // 10, NUM_STEPS):  # the first tenth warms up, and is overwritten
        q, v = states[k % NUM_STATES]
        start = time.perf_counter_ns()
        step = system.acceleration(q, v, goal, obstacles)
        _ = step.acceleration
        samples[max(k, 0)] = time.perf_counter_ns() - start
        if step.status != ss.StepStatus.ok:
            raise RuntimeError(f"{name}: status {step.status}")
    median, p95, p99, p999 = np.quantile(samples, [0.5, 0.95, 0.99, 0.999])
    return {
        "joints": nv,
        "robot": name,
        "median_ns": float(median),
        "p95_ns": float(p95),
        "p99_ns": float(p99),
        "p999_ns": float(p999),
        "max_ns": float(samples.max()),
        "steps_per_s": float(1e9 / samples.mean()),
    }


def main() -> None:
    """Prints the figures as JSON, or writes them to a file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--json", metavar="PATH", default="-", help="where to; - is the standard output")
    path = parser.parse_args().json
    report = {
        "benchmark": "step",
        "command": "python benchmarks/step.py --json " + path,
        "language": f"Python {platform.python_version()}",
        "version": ss.__version__,
        "cpu": cpu_model(),
        "results": [measure(name) for name in ROBOTS],
    }
    text = json.dumps(report, indent=2)
    if path == "-":
        print(text)
    else:
        Path(path).write_text(text + "\n")


if __name__ == "__main__":
    main()
