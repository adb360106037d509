"""Whether OMPL finds paths in the problems of `sidestep bench reach` in which the arm did not arrive.

    sidestep bench reach --robot NAME|FILE --failures --json FILE
    python benchmarks/against_ompl.py FILE [...]

OMPL's RRTConnect has `--seconds` for each. It looks at states every 0.5 % of the space, not between them, once by the
covering body without margin, which is less than what the controller keeps, and once by exact meshes.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt
from ompl import util

import sidestep as ss
from sidestep.bench.arm import load_robot
from sidestep.bench.problems import ProblemGenerator, ProblemSettings
from sidestep.distance import ExactClearance, SelfCollision
from sidestep.planning import PathPlanner

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "planning"))
from ompl_reference import covered_free, solved

Array = npt.NDArray[np.float64]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE")
    parser.add_argument("--seconds", type=float, default=10.0)
    given = parser.parse_args()

    util.setLogLevel(util.LOG_NONE)
    print(
        "| robot | problems | arrived | of the others, OMPL finds a path in: by the body | by meshes |\n"
        "|---|---|---|---|---|"
    )
    for file in given.files:
        result = json.loads(file.read_text(encoding="utf-8"))
        settings = result["settings"]
        arm = ss.Arm.load(result["robot"])
        robot = load_robot(result["robot"])
        planner = PathPlanner(arm.robot, arm.body, pairs=arm.pairs, tables=arm.tables)
        asked = ProblemSettings(robot=result["robot"], obstacles=settings["obstacles"], seed=settings["seed"])
        generator = ProblemGenerator(asked, robot=robot)
        found: dict[str, list[str]] = {"body": [], "meshes": []}
        missed = [
            failure for failure in result["failures"] if any("from the goal" in r for r in failure["reasons"])
        ]
        for failure in missed:
            problem = generator.problem(failure["index"])
            seen = problem.obstacles_at(0.0)
            points = {"points": seen.points, "radii": seen.radii}
            ends = {"start": problem.start, "goal": problem.goal}
            exact = ExactClearance(robot, problem.objects)
            own = generator.self_collision

            def free_by_meshes(q: Array, exact: ExactClearance = exact, own: SelfCollision = own) -> bool:
                return exact.distance(q).distance > 0.0 and not own.touching(q)

            for name, free in (("body", covered_free(planner, points, 0.0)), ("meshes", free_by_meshes)):
                if solved(robot, ends, free, given.seconds):
                    found[name].append(str(failure["index"]))
        cells = (", ".join(indices) or "none" for indices in found.values())
        arrived = result["problems"] - len(missed)
        print(f"| {result['robot']} | {result['problems']} | {arrived} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
