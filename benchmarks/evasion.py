"""Processor time of a look of `LookAhead`, in problems of `sidestep bench reach --moving 0.5`."""

import argparse
import time

import numpy as np

from sidestep import Arm, Robot
from sidestep.bench import ProblemSettings
from sidestep.bench.methods import barrier_system
from sidestep.bench.problems import ProblemGenerator
from sidestep.distance import SelfCollision
from sidestep.system import LookAhead

PROBLEMS = 40
TIMES = (0.0, 0.5, 1.0, 1.5)  # [s] at which an arm that has not moved from its start looks


def looks(name: str) -> tuple[list[float], list[float]]:
    """Milliseconds of looks that find no trajectory, most of them as the way is free, and of those that find one."""
    robot = Robot.named(name)
    system = barrier_system(robot, Arm.load(name).body)
    settings = ProblemSettings(robot=name, obstacles=10, moving=0.5)
    generator = ProblemGenerator(settings, robot=robot, self_collision=SelfCollision(robot))
    free: list[float] = []
    evading: list[float] = []
    for index in range(PROBLEMS):
        problem = generator.problem(index)
        evasion = LookAhead(system, seed=index)
        for at in TIMES:
            begin = time.process_time()
            found = evasion.look(
                problem.goal, problem.start, np.zeros_like(problem.start), problem.obstacles_at(at)
            )
            (free if found is None else evading).append(1e3 * (time.process_time() - begin))
    return free, evading


def main() -> None:
    print("| robot | looks | number | median [ms] | p95 [ms] | most [ms] |\n|---|---|---|---|---|---|")
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "robots", nargs="*", metavar="ROBOT", default=["fr3", "panda", "ur10", "xarm7", "iiwa"]
    )
    for name in parser.parse_args().robots:
        for label, times in zip(("no trajectory", "trajectory"), looks(name), strict=True):
            median, p95, most = np.quantile(times, (0.5, 0.95, 1.0))
            print(f"| {name} | {label} | {len(times)} | {median:.1f} | {p95:.1f} | {most:.1f} |")


if __name__ == "__main__":
    main()
