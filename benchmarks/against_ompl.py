"""Whether OMPL finds paths in the problems of `sidestep bench reach` that did not succeed.

    sidestep bench reach --robot fr3 --method guided --problems 1000 --failures --json FILE
    python benchmarks/against_ompl.py FILE [...]

OMPL's RRTConnect has `--seconds` for each, with Sidestep's clearance function as its checker and no margin, which is
less than what guides ask for.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from ompl import util

import sidestep as ss
from sidestep.arm.link_pairs import tables_and_pairs
from sidestep.bench.problems import ProblemGenerator, ProblemSettings
from sidestep.planning import PathPlanner

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "guidance"))
from ompl_reference import solved


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE")
    parser.add_argument("--seconds", type=float, default=10.0)
    given = parser.parse_args()

    util.setLogLevel(util.LOG_NONE)
    print(
        "| robot | balls | problems | success | OMPL finds a path in of the others |\n|---|---|---|---|---|"
    )
    for file in given.files:
        result = json.loads(file.read_text(encoding="utf-8"))
        settings = result["settings"]
        robot = ss.Robot.named(result["robot"])
        body = ss.Body.cover(robot)
        tables, pairs = tables_and_pairs(robot, body)
        planner = PathPlanner(robot, body, pairs=pairs, tables=tables)
        asked = ProblemSettings(robot=result["robot"], obstacles=settings["obstacles"], seed=settings["seed"])
        generator = ProblemGenerator(asked, robot=robot)
        found = []
        for failure in result["failures"]:
            problem = generator.problem(failure["index"])
            ends = {"start": problem.start, "goal": problem.goal}
            points = {"points": problem.obstacles.points, "radii": problem.obstacles.radii}
            if solved(planner, robot, {**ends, **points}, 0.0, given.seconds):
                found.append(str(failure["index"]))
        print(
            f"| {result['robot']} | {settings['obstacles']} | {result['problems']} | {result['success']} | "
            f"{', '.join(found) or 'none'} of {len(result['failures'])} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
