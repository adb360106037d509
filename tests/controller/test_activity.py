"""What the controller says that it is about, settled from the first step on."""

from __future__ import annotations

import time as clock
from itertools import groupby

import numpy as np
import pytest

import sidestep as ss
from sidestep._core import PlanStatus
from sidestep.obstacles import pose_at

PERIOD = 0.001  # [s] the default
SETTLED = 0.5  # [s] after which even a search that finds nothing counts
START, BEYOND = np.array([0.0, 0.3, 0.3]), np.array([1.9, 0.3, 0.3])


def wall(degrees: float) -> np.ndarray:
    """Points (120, 3) of a wall from near the base to where the arm of three metres does not reach."""
    direction = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees)), 0.0])
    return np.linspace(0.12, 3.3, 120)[:, None] * direction


CAGE = ss.Obstacles(np.concatenate([wall(60.0), wall(-60.0)]), 0.02)


def settings(**options: object) -> ss.ControllerSettings:
    """With a planner that gives up soon."""
    made = ss.ControllerSettings(**({"output": "acceleration"} | options))
    if made.planner is not None:
        made.planner.search.max_nodes = 500  # some 10 ms; there is nothing to find
    return made


def activities(
    arm: ss.Arm,
    start: np.ndarray,
    goal: object,
    obstacles: object,
    *,
    seconds: float,
    every: int = 0,
    **options: object,
) -> list[tuple[str, int]]:
    """Each activity with the step it begins in, of an ideal arm; in real time unless synchronous.

    `every`: steps after which the goal is set again; 0: never.
    """
    controller = ss.Controller(arm, settings(**options))
    controller.set_obstacles(obstacles)
    controller.set_goal(goal)
    q, v, names, begin = start.copy(), np.zeros(len(start)), [], clock.perf_counter()
    for k in range(round(seconds / PERIOD)):
        if every and k % every == 0:
            controller.set_goal(goal)
        command = controller.step(q, v)
        v = v + PERIOD * command.acceleration
        q = q + PERIOD * v
        names.append(command.activity.name)
        if not options.get("synchronous"):
            clock.sleep(max(0.0, begin + (k + 1) * PERIOD - clock.perf_counter()))
    begins = [0, *np.cumsum([len(list(run)) for _, run in groupby(names)])[:-1].tolist()]
    return [(names[k], k) for k in begins]


@pytest.fixture(scope="module")
def planar() -> ss.Arm:
    return ss.Arm.load("planar3")


@pytest.mark.parametrize("by_pose", [False, True])
def test_a_closed_cage_is_said_once_and_for_good(planar: ss.Arm, *, by_pose: bool) -> None:
    goal = ss.PoseGoal(planar.robot, "tip", planar.robot.pose(BEYOND, "tip")) if by_pose else BEYOND
    told = activities(planar, START, goal, CAGE, seconds=3.0, synchronous=True)
    assert [name for name, _ in told] == ["moving", "blocked"]
    # the first search, in the first step, found nothing; a step of rounding
    assert told[1][1] == pytest.approx(SETTLED / PERIOD, abs=1)


def test_a_closed_cage_is_said_once_with_the_planner_in_its_thread(planar: ss.Arm) -> None:
    """While a way to the next posture is searched nothing is known."""
    goal = ss.PoseGoal(planar.robot, "tip", planar.robot.pose(BEYOND, "tip"))
    told = [name for name, _ in activities(planar, START, goal, CAGE, seconds=3.0)]
    assert told in (["waiting", "moving", "blocked"], ["moving", "blocked"])


@pytest.mark.parametrize("planner", [True, False])
def test_a_goal_inside_something_is_blocked_while_the_arm_comes_near(
    planar: ss.Arm, *, planner: bool
) -> None:
    goal = np.array([0.8, 0.3, 0.3])
    ball = ss.Sphere(0.2, pose_at(planar.robot.pose(goal, "tip")[:3, 3]))
    options = {} if planner else {"planner": None}
    told = activities(planar, START, goal, ball, seconds=3.0, synchronous=True, **options)
    assert [name for name, _ in told] == ["moving", "blocked"]
    assert 100 <= told[1][1] <= 300  # 0.2 s: ten looks of the planner


@pytest.mark.parametrize("planner", [True, False])
def test_postures_that_are_tried_one_after_the_other_do_not_flicker(*, planner: bool) -> None:
    arm = ss.Arm.load("fr3")
    pose = arm.robot.pose(arm.neutral, "fr3_hand_tcp")
    pose[:3, 3] = 0.55, 0.0, 0.25
    table = ss.Box((1.0, 1.6, 0.04), pose_at([0.7, 0.0, 0.25]), name="table")
    goal = ss.PoseGoal(arm.robot, "fr3_hand_tcp", pose)
    options = {"synchronous": False} if planner else {"synchronous": True, "planner": None}
    told = activities(arm, arm.neutral, goal, table, seconds=1.5, **options)
    assert [name for name, _ in told if name != "waiting"] == ["moving", "blocked"]
    assert len(told) <= 3  # waiting for the first posture alone


def test_a_start_in_contact_is_not_blocked_before_the_arm_is_out() -> None:
    arm = ss.Arm.load("fr3")
    ball = ss.Sphere(0.05, pose_at(arm.robot.pose(arm.neutral, "fr3_hand_tcp")[:3, 3]))
    goal = arm.neutral + np.array([1.2, 0, 0, 0, 0, 0, 0])
    told = activities(arm, arm.neutral, goal, ball, seconds=1.5, synchronous=True)
    assert [name for name, _ in told] == ["moving", "arrived"]


def test_the_same_goal_set_again_does_not_hide_that_it_is_blocked(planar: ss.Arm) -> None:
    goal = np.array([0.8, 0.3, 0.3])
    ball = ss.Sphere(0.2, pose_at(planar.robot.pose(goal, "tip")[:3, 3]))
    told = activities(planar, START, goal, ball, seconds=1.5, synchronous=True, every=20)
    assert [name for name, _ in told] == ["moving", "blocked"]


def test_another_goal_begins_anew_and_a_way_that_opens_is_said(planar: ss.Arm) -> None:
    controller = ss.Controller(planar, settings(synchronous=True))
    controller.set_obstacles(CAGE)
    controller.set_goal(BEYOND)
    motion = ss.integrate(controller, START, np.zeros(3), steps=800)
    assert motion.activities[-1] == ss.Activity.blocked
    assert controller.plan.status == PlanStatus.no_path
    controller.set_goal(motion.last_q)
    assert controller.step(motion.last_q, motion.last_v).activity != ss.Activity.blocked
    controller.set_goal(BEYOND)
    motion = ss.integrate(controller, motion.last_q, motion.last_v, steps=800)
    assert ss.Activity.blocked not in motion.activities[:400]
    assert motion.activities[-1] == ss.Activity.blocked
    controller.remove_obstacles()
    motion = ss.integrate(controller, motion.last_q, motion.last_v, steps=4000)
    # a look of the planner, 0.02 s, and 0.1 s in which it stays open
    assert motion.activities.index(ss.Activity.moving) <= 125
    assert motion.activities[-1] == ss.Activity.arrived
