"""Solves problems by OMPL's RRTConnect with the validity checker of Sidestep, in a process of its own.

Reads a pickle of (robot name, body arrays, problems, margin, seconds) from stdin and writes a JSON list of whether each
was solved. A process of its own, as OMPL's module reports leaks when it ends.
"""

import json
import pickle
import sys

import numpy as np
from ompl import base, geometric, util

import sidestep as ss
from sidestep import _core
from sidestep.planning import PathPlanner


def solved(planner: PathPlanner, robot: ss.Robot, problem: dict, margin: float, seconds: float) -> bool:
    nv = robot.num_coordinates
    obstacles = ss.Obstacles(problem["points"], problem["radii"])
    space = base.RealVectorStateSpace(nv)
    bounds = base.RealVectorBounds(nv)
    for i in range(nv):
        bounds.setLow(i, float(robot.limits.lower[i]))
        bounds.setHigh(i, float(robot.limits.upper[i]))
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)
    q = np.empty(nv)

    def valid(state: base.State) -> bool:
        for i in range(nv):
            q[i] = state[i]
        return planner.is_free(q, obstacles, margin=margin)

    setup.setStateValidityChecker(valid)
    information = setup.getSpaceInformation()
    information.setStateValidityCheckingResolution(0.005)
    ends = []
    for end in (problem["start"], problem["goal"]):
        state = space.allocState()
        for i in range(nv):
            state[i] = float(end[i])
        ends.append(state)
    setup.setStartAndGoalStates(*ends)
    setup.setPlanner(geometric.RRTConnect(information))
    setup.solve(seconds)
    return bool(setup.haveExactSolutionPath())


def main() -> None:
    name, body, problems, margin, seconds = pickle.load(sys.stdin.buffer)
    util.setLogLevel(util.LOG_NONE)
    robot = ss.Robot.named(name)
    planner = PathPlanner(robot, _core.Body(**body))
    print(json.dumps([solved(planner, robot, problem, margin, seconds) for problem in problems]))


if __name__ == "__main__":
    main()
