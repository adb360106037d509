"""Processor time of plans, until a first path and until it is improved: random reach problems, or MotionBenchMaker's.

    python benchmarks/plan.py --robot panda --obstacles 10 --problems 100 [--json FILE]
    python benchmarks/plan.py --robot panda --motion-bench-maker DIR --every 5 [--json FILE]

Processor time of the one core that plans, so that other programs disturb little. Obstacles are points with radii.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import sidestep as ss
from sidestep._core import PlanStatus
from sidestep.arm.link_pairs import tables_and_pairs
from sidestep.bench.arm import load_robot
from sidestep.bench.motion_bench_maker import read_motion_bench_maker
from sidestep.bench.parallel import cpu_name
from sidestep.bench.points import POINT_RADIUS, SPACING
from sidestep.bench.problems import ProblemGenerator, ProblemSettings
from sidestep.obstacles import obstacles_from_shapes
from sidestep.planning import PathPlanner, PlannerSettings


@dataclass(frozen=True)
class Task:
    """What is planned, and what it is counted under."""

    set: str
    index: int
    planners: dict[str, PathPlanner]
    start: np.ndarray
    goal: np.ndarray
    obstacles: ss.Obstacles


@dataclass
class Figures:
    """Of one set."""

    statuses: Counter[str] = field(default_factory=Counter)
    straight: int = 0
    seconds: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    lengths: list[float] = field(default_factory=list)
    margins: list[float] = field(default_factory=list)

    def document(self) -> dict[str, Any]:
        found = {"length_median": round(float(np.median(self.lengths)), 3)} if self.lengths else {}
        if self.margins:
            found["margin_mean_mm"] = round(1e3 * float(np.mean(self.margins)), 2)
        return {
            "statuses": dict(self.statuses),
            "straight": self.straight,
            **found,
            **{name: summary(values) for name, values in self.seconds.items()},
        }


def summary(seconds: list[float]) -> dict[str, float]:
    """Median, p95, largest and mean [ms]."""
    median, p95, worst = 1e3 * np.quantile(seconds, [0.5, 0.95, 1.0])
    mean = 1e3 * float(np.mean(seconds))
    return {
        f"{name}_ms": round(float(value), 3)
        for name, value in (("median", median), ("p95", p95), ("max", worst), ("mean", mean))
    }


def planners(robot: ss.Robot, body: ss.Body, names: list[str]) -> dict[str, PathPlanner]:
    """One that is content with the first path, and one that improves it."""
    tables, pairs = tables_and_pairs(robot, body)
    floor = PlannerSettings().floor
    settings = {"first_path": PlannerSettings(margin=floor, shortcuts=0), "improved": PlannerSettings()}
    return {
        name: PathPlanner(robot, body, pairs=pairs, tables=tables, settings=settings[name]) for name in names
    }


def reach_tasks(given: argparse.Namespace, names: list[str]) -> Iterator[Task]:
    """Random reach problems."""
    robot = ss.Robot.named(given.robot)
    made = planners(robot, ss.Body.cover(robot), names)
    settings = ProblemSettings(robot=given.robot, obstacles=given.obstacles, seed=given.seed)
    generator = ProblemGenerator(settings, robot=robot)
    for index in range(given.problems):
        problem = generator.problem(index)
        yield Task("reach", index, made, problem.start, problem.goal, problem.obstacles)


def published_tasks(given: argparse.Namespace, names: list[str]) -> Iterator[Task]:
    """Problems of MotionBenchMaker, with the points that `sidestep bench motionbenchmaker` gives the controller."""
    plain = load_robot(given.robot)
    cover = ss.Body.cover(plain)
    made: dict[tuple[tuple[str, float], ...], tuple[ss.Robot, dict[str, PathPlanner]]] = {}
    own = (*plain.coordinate_names, *plain.held)
    for problem in read_motion_bench_maker(given.motion_bench_maker)[:: given.every]:
        locked = {name: value for name, value in problem.held.items() if name in own}
        key = tuple(sorted(locked.items()))
        if key not in made:
            robot = load_robot(given.robot, locked=locked)
            made[key] = robot, planners(robot, cover.for_robot(robot, source=plain), names)
        robot, ours = made[key]
        start, goal = (
            np.clip([state[name] for name in robot.coordinate_names], robot.limits.lower, robot.limits.upper)
            for state in (problem.start, problem.goal)
        )
        obstacles = obstacles_from_shapes(
            list(problem.shapes.values()), spacing=SPACING, radius=POINT_RADIUS, gaps_allowed=True
        )
        yield Task(problem.set, problem.index, ours, start, goal, obstacles)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robot", default="panda")
    parser.add_argument("--obstacles", type=int, default=10)
    parser.add_argument("--problems", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--motion-bench-maker", metavar="DIR", help="its problem folders, in place of random ones"
    )
    parser.add_argument("--every", type=int, default=1, help="of how many published problems one is planned")
    parser.add_argument("--first", action="store_true", help="the first path alone")
    parser.add_argument("--json")
    given = parser.parse_args()

    names = ["first_path"] if given.first else ["first_path", "improved"]
    figures: dict[str, Figures] = defaultdict(Figures)
    for task in (published_tasks if given.motion_bench_maker else reach_tasks)(given, names):
        for group in (figures[task.set], figures["all"]):
            group.statuses["problems"] += 1
        for name, planner in task.planners.items():
            begin = time.process_time()
            plan = planner.plan(task.start, task.goal, task.obstacles, seed=task.index + given.seed)
            spent = time.process_time() - begin
            for group in (figures[task.set], figures["all"]):
                group.seconds[name].append(spent)
        for group in (figures[task.set], figures["all"]):
            group.statuses[plan.status.name] += 1
            if plan.status is PlanStatus.found:
                group.straight += plan.path.shape[0] == 2
                group.lengths.append(plan.length)
                group.margins.append(plan.margin)
    if len(figures) == 2:  # one set
        del figures["all"]
    document = {
        "robot": given.robot,
        **({"every": given.every} if given.motion_bench_maker else {"obstacles": given.obstacles}),
        "seed": given.seed,
        "sets": {name: group.document() for name, group in figures.items()},
        "cpu": cpu_name(),
    }
    text = json.dumps(document, indent=2)
    print(text)
    if given.json:
        with open(given.json, "w", encoding="utf-8") as file:
            file.write(text + "\n")


if __name__ == "__main__":
    main()
