"""Processor time of plans on reach problems: until a first path, and with it shortened.

    python benchmarks/plan.py --robot panda --obstacles 10 --problems 100 [--json FILE]

Processor time of the one core that plans, so that other programs disturb little. The balls are points with radii.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter

import numpy as np

import sidestep as ss
from sidestep.bench.parallel import cpu_name
from sidestep.bench.problems import ProblemGenerator, ProblemSettings
from sidestep.link_pairs import barrier_pairs


def summary(seconds: list[float]) -> dict[str, float]:
    """Median, p95 and largest [ms]."""
    median, p95, worst = 1e3 * np.quantile(seconds, [0.5, 0.95, 1.0])
    return {"median_ms": round(median, 3), "p95_ms": round(p95, 3), "max_ms": round(worst, 3)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robot", default="panda")
    parser.add_argument("--obstacles", type=int, default=10)
    parser.add_argument("--problems", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json")
    given = parser.parse_args()

    robot = ss.Robot.named(given.robot)
    body = ss.Body.cover(robot)
    pairs = list(barrier_pairs(robot, body))
    planners = {
        "first_path": ss.PathPlanner(robot, body, pairs=pairs, settings=ss.PlannerSettings(shortcuts=0)),
        "shortened": ss.PathPlanner(robot, body, pairs=pairs),
    }
    generator = ProblemGenerator(
        ProblemSettings(robot=given.robot, obstacles=given.obstacles, seed=given.seed), robot=robot
    )
    seconds: dict[str, list[float]] = {name: [] for name in planners}
    statuses: Counter[str] = Counter()
    straight = 0
    for index in range(given.problems):
        problem = generator.problem(index)
        for name, planner in planners.items():
            begin = time.process_time()
            plan = planner.plan(problem.start, problem.goal, problem.obstacles, seed=index)
            seconds[name].append(time.process_time() - begin)
        statuses[plan.status.name] += 1
        straight += plan.path.shape[0] == 2
    document = {
        "robot": given.robot,
        "obstacles": given.obstacles,
        "seed": given.seed,
        "problems": given.problems,
        "statuses": dict(statuses),
        "straight": straight,
        "plan": {name: summary(values) for name, values in seconds.items()},
        "cpu": cpu_name(),
    }
    text = json.dumps(document, indent=2)
    print(text)
    if given.json:
        with open(given.json, "w", encoding="utf-8") as file:
            file.write(text + "\n")


if __name__ == "__main__":
    main()
