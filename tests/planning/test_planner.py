"""Plans: free between samples, the same every time, honest, and found wherever OMPL finds one."""

import importlib.util
import json
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sidestep as ss
from sidestep import _core
from sidestep._core import PlanStatus
from sidestep.arm.clearance_tables import clearance_tables
from sidestep.planning import PathPlanner, PlannerSettings
from sidestep.system import ClearanceTable
from support.planar_problems import BODY, balls, free_ends

FLOOR = 0.005  # [m], the default
SLACK = 0.002  # [m], the default


@pytest.fixture(scope="module")
def planner(robot: ss.Robot, body: _core.Body) -> PathPlanner:
    return PathPlanner(robot, body)


@pytest.mark.parametrize("seed", [0, 1, 3, 4, 6, 8, 9, 10])  # of the others OMPL finds no path in 5 s either
def test_a_path_is_free_everywhere_and_the_same_again(
    robot: ss.Robot, planner: PathPlanner, seed: int
) -> None:
    obstacles = balls(seed, count=4)
    start, goal = free_ends(robot, planner, obstacles, seed)
    plan = planner.plan(start, goal, obstacles, seed=seed)
    assert plan.status == PlanStatus.found
    np.testing.assert_array_equal(plan.path[[0, -1]], [start, goal])
    share = np.linspace(0.0, 1.0, 300)[:, None]
    for a, b in zip(plan.path[:-1], plan.path[1:], strict=True):
        least = min(planner.clearance(q, obstacles, cap=0.1).clearance for q in a + share * (b - a))
        assert least >= plan.margin - SLACK
    again = planner.plan(start, goal, obstacles, seed=seed)
    np.testing.assert_array_equal(again.path, plan.path)
    assert plan.length >= np.linalg.norm(goal - start) - 1e-12  # rounding


def test_ends_a_rounding_error_outside_the_limits_are_taken_in(robot: ss.Robot, planner: PathPlanner) -> None:
    within = np.array([robot.limits.upper[0], -1.0, 0.0])
    wall = ss.Obstacles([[0.0, y, 0.0] for y in np.linspace(0.7, 1.4, 8)], 0.02)
    for excess, status in ((9e-4, PlanStatus.found), (1.1e-3, PlanStatus.invalid)):
        outside = within + np.array([excess, 0.0, 0.0])
        plan = planner.plan(outside, [0.2, 0.5, 0.0], wall)
        assert plan.status == status
        back = planner.plan([0.2, 0.5, 0.0], outside, wall)
        assert back.status == status
        if status == PlanStatus.found:
            np.testing.assert_array_equal(plan.path[0], within)
            np.testing.assert_array_equal(back.path[-1], within)


def test_ends_in_collision_are_named(robot: ss.Robot, planner: PathPlanner) -> None:
    goal, start = np.zeros(3), np.array([1.5, 0.0, 0.0])
    point = ss.Obstacles([[1.25, 0.0, 0.0]], 0.05)  # in the middle of link3 at the goal
    plan = planner.plan(start, goal, point)
    assert plan.status == PlanStatus.goal_in_collision
    assert (plan.obstruction.link, plan.obstruction.point) == ("link3", 0)
    # The centre of the ellipsoid: the shortest semi-axis and the radius of the point away from free, in single
    # precision.
    assert 0.1 - 1e-5 <= plan.obstruction.depth <= 0.27 + 0.05
    assert "link 'link3'" in str(plan.obstruction)
    assert planner.plan(goal, start, point).status == PlanStatus.start_in_collision
    with pytest.raises(ValueError, match=r"goal\[1\] is nan"):
        planner.plan(start, [0.0, np.nan, 0.0], point)
    with pytest.raises(ValueError, match="margin"):
        PlannerSettings(margin=0.001, floor=0.002)


def test_an_edge_does_not_skip_a_thin_obstacle(planner: PathPlanner) -> None:
    a, b = np.array([1.5, 0.0, 0.0]), np.array([-1.5, 0.0, 0.0])
    needle = ss.Obstacles([[1.5, 0.0, 0.0]])  # a point at the end of the last link, halfway
    assert planner.is_free(a, needle, margin=0.0)
    assert planner.is_free(b, needle, margin=0.0)
    assert not planner.is_edge_free(a, b, needle, margin=0.0)
    assert planner.is_edge_free(a, b, ss.Obstacles([[1.6, 0.0, 0.0]]), margin=0.0)


@pytest.mark.slow
@pytest.mark.skipif(
    importlib.util.find_spec("ompl") is None, reason="OMPL is not installed (pip install ompl)"
)
def test_finds_a_path_wherever_ompl_does(robot: ss.Robot, body: _core.Body) -> None:
    planner = PathPlanner(robot, body)
    problems = []
    for seed in range(25):
        obstacles = balls(seed, count=8)
        start, goal = free_ends(robot, planner, obstacles, seed)
        problems.append({"points": obstacles.points, "radii": obstacles.radii, "start": start, "goal": goal})
    done = subprocess.run(
        [sys.executable, str(Path(__file__).parent / "ompl_reference.py")],
        input=pickle.dumps(("planar3", BODY, problems, FLOOR, 1.0)),
        capture_output=True,
        check=True,
    )
    by_ompl = json.loads(done.stdout.decode().strip().splitlines()[-1])
    ours = [
        planner.plan(item["start"], item["goal"], ss.Obstacles(item["points"], item["radii"])).status
        == PlanStatus.found
        for item in problems
    ]
    assert sum(by_ompl) >= 15  # so that the comparison says something
    missed = [i for i, (theirs, own) in enumerate(zip(by_ompl, ours, strict=True)) if theirs and not own]
    assert missed == []


def test_links_that_are_always_near_do_not_block_every_way(robot: ss.Robot, body: _core.Body) -> None:
    """As of a wrist whose parts pass 4 mm apart all the way round: less than the margin of other links."""

    def planned(control: np.ndarray) -> PlanStatus:
        square: dict[str, Any] = {"begin": (-4.0, -4.0), "spacing": (1.0, 1.0), "periodic": (False, False)}
        table = ClearanceTable("link1", "link3", coordinates=(1, 2), control=control, **square)
        planner = PathPlanner(robot, body, tables=[table], settings=PlannerSettings(fade=0.01))
        return planner.plan(np.array([0.3, 0.5, 0.5]), np.array([0.9, 1.6, -1.2]), ss.Obstacles.none()).status

    assert planned(np.full((9, 9), 0.004)) == PlanStatus.found
    assert planned(np.full((9, 9), -0.02)) == PlanStatus.goal_in_collision
    folds = np.full((9, 9), 0.004)
    folds[:, 3:5] = -0.02  # wherever the way has to pass
    assert planned(folds) == PlanStatus.no_path


def test_tables_tell_how_far_links_are_apart(robot: ss.Robot, body: _core.Body) -> None:
    tables = clearance_tables(robot).tables
    planner = PathPlanner(robot, body, tables=tables)
    nothing = ss.Obstacles.none()
    folded = np.array([0.3, 2.4, 2.4])
    found = planner.clearance(folded, nothing)
    assert (found.link, found.other) == ("link1", "link3")
    assert found.clearance == min(table.at(2.4, 2.4)[0] for table in tables)
    assert not planner.is_free(folded, nothing, margin=found.clearance + 0.001)
    assert planner.is_free(folded, nothing, margin=found.clearance)
    square: dict[str, Any] = {"begin": (0.0, 0.0), "spacing": (1.0, 1.0), "periodic": (False, False)}
    wrong = ClearanceTable("link1", "no link", coordinates=(1, 2), control=np.zeros((4, 4)), **square)
    with pytest.raises(ValueError, match="no link"):
        PathPlanner(robot, body, tables=[wrong])
