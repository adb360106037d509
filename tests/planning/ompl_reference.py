"""Solves problems by OMPL's RRTConnect with the validity checker of Sidestep, in a process of its own.

Reads a pickle of (robot name, body arrays, problems, margin, seconds) from stdin and writes a JSON list of whether each
was solved. A process of its own, as OMPL's module reports leaks when it ends.
"""

import json
import pickle
import sys
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from ompl import base, geometric, util

import sidestep as ss
from sidestep import _core
from sidestep.planning import PathPlanner


def covered_free(
    planner: PathPlanner, problem: dict, margin: float
) -> Callable[[npt.NDArray[np.float64]], bool]:
    obstacles = ss.Obstacles(problem["points"], problem["radii"])
    return lambda q: planner.is_free(q, obstacles, margin=margin)


def solved(
    robot: ss.Robot, problem: dict, free: Callable[[npt.NDArray[np.float64]], bool], seconds: float
) -> bool:
    nv = robot.num_coordinates
    space = base.RealVectorStateSpace(nv)
    bounds = base.RealVectorBounds(nv)
    for i in range(nv):
        low, high = float(robot.limits.lower[i]), float(robot.limits.upper[i])
        ends = problem["start"][i], problem["goal"][i]  # of a joint without limits: a turn beyond both
        bounds.setLow(i, low if np.isfinite(low) else float(min(ends) - 2.0 * np.pi))
        bounds.setHigh(i, high if np.isfinite(high) else float(max(ends) + 2.0 * np.pi))
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)
    q = np.empty(nv)

    def valid(state: base.State) -> bool:
        for i in range(nv):
            q[i] = state[i]
        return free(q)

    setup.setStateValidityChecker(valid)
    information = setup.getSpaceInformation()
    information.setStateValidityCheckingResolution(0.005)
    states = []
    for end in (problem["start"], problem["goal"]):
        state = space.allocState()
        for i in range(nv):
            state[i] = float(end[i])
        states.append(state)
    setup.setStartAndGoalStates(*states)
    setup.setPlanner(geometric.RRTConnect(information))
    setup.solve(seconds)
    return bool(setup.haveExactSolutionPath())


def main() -> None:
    name, body, problems, margin, seconds = pickle.load(sys.stdin.buffer)
    util.setLogLevel(util.LOG_NONE)
    robot = ss.Robot.named(name)
    planner = PathPlanner(robot, _core.Body(**body))
    found = [solved(robot, problem, covered_free(planner, problem, margin), seconds) for problem in problems]
    print(json.dumps(found))


if __name__ == "__main__":
    main()
