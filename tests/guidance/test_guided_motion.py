"""Guided motions: they arrive behind concave obstacles, wait for blocked goals, and say what is the matter."""

import time as clock

import numpy as np
import pytest

import sidestep as ss
from sidestep import _core

PERIOD = 0.005


def flat_system(robot: ss.Robot, body: _core.Body) -> ss.GeometricSystem:
    return ss.GeometricSystem([ss.ClearanceBarrier(robot, body, activation=0.06)], stiffness=4.0, damping=4.0)


def guided(robot: ss.Robot, body: _core.Body, **settings: object) -> ss.GuidedMotion:
    options = {"synchronous": True, **settings}
    return ss.GuidedMotion(robot, body, system=flat_system(robot, body), pairs=[], **options)


def run(
    motion: ss.GuidedMotion, q: np.ndarray, obstacles: ss.Obstacles, duration: float, start: float = 0.0
) -> tuple[np.ndarray, ss.GuideStatus, float]:
    """Integrates until arrival; returns where, the last status, and the time."""
    v = np.zeros_like(q)
    status, time = ss.GuideStatus.idle, start
    while time < start + duration:
        step = motion.step(q, v, obstacles, time=time)
        status = step.status
        if status == ss.GuideStatus.arrived:
            break
        v = v + PERIOD * step.acceleration
        q = q + PERIOD * v
        time += PERIOD
    return q, status, time


START, GOAL = np.array([0.8, 0.0, 0.0]), np.array([-0.8, 0.0, 0.0])
# A row of points in the way of the stretched arm: it has to fold.
WALL = ss.Obstacles(np.column_stack([np.linspace(1.0, 1.5, 12), np.zeros(12), np.zeros(12)]), 0.03)


def test_arrives_where_the_attractor_alone_is_stuck(robot: ss.Robot, body: _core.Body) -> None:
    system = flat_system(robot, body)
    alone = ss.rollout(system, START, np.zeros(3), GOAL, WALL, period=PERIOD, steps=4000)
    assert np.abs(alone.q[-1] - GOAL).max() > 0.3  # it hangs at the wall
    motion = guided(robot, body)
    motion.set_goal(GOAL)
    q, status, _ = run(motion, START, WALL, 20.0)
    assert status == ss.GuideStatus.arrived
    assert np.abs(q - GOAL).max() < 0.05  # the default tolerance
    assert motion.guide.plan.status == ss.PlanStatus.found


def test_the_same_seed_gives_the_same_motion(robot: ss.Robot, body: _core.Body) -> None:
    ends = []
    for _ in range(2):
        motion = guided(robot, body, seed=5)
        motion.set_goal(GOAL)
        ends.append(run(motion, START, WALL, 3.0)[0])
    np.testing.assert_array_equal(ends[0], ends[1])


def test_a_blocked_goal_is_named_and_reached_when_it_clears(robot: ss.Robot, body: _core.Body) -> None:
    motion = guided(robot, body)
    motion.set_goal(GOAL)
    on_goal = ss.Obstacles([[1.0 * np.cos(-0.8), 1.0 * np.sin(-0.8), 0.0]], 0.1)
    q, status, time = run(motion, START, on_goal, 4.0)
    assert status == ss.GuideStatus.goal_in_collision
    assert motion.guide.plan.obstruction.link in ("link2", "link3")  # at 1 m, where the two meet
    q, status, _ = run(motion, q, ss.Obstacles.none(), 10.0, start=time)
    assert status == ss.GuideStatus.arrived


def test_time_that_is_over_and_goals_that_cannot_be(robot: ss.Robot, body: _core.Body) -> None:
    motion = guided(robot, body, duration=0.1)
    assert motion.guide.step(START, 0.0).status == ss.GuideStatus.idle
    motion.set_goal(GOAL)
    assert run(motion, START, ss.Obstacles.none(), 0.3)[1] == ss.GuideStatus.timeout
    with pytest.raises(ValueError, match="goal has shape"):
        motion.set_goal([0.0, 0.0])
    with pytest.raises(ValueError, match=r"goal\[1\] is inf"):
        motion.set_goal([0.0, np.inf, 0.0])
    with pytest.raises(ValueError, match="duration is -1"):
        guided(robot, body, duration=-1.0)


def test_a_guide_in_its_thread_finds_the_way(robot: ss.Robot, body: _core.Body) -> None:
    motion = guided(robot, body, synchronous=False)
    motion.set_goal(GOAL)
    q, v = START, np.zeros(3)
    step = motion.step(q, v, WALL, time=0.0)
    assert step.status == ss.GuideStatus.moving  # at once, by the reactive layer alone
    while motion.guide.searches == 0:  # however slow the machine is
        clock.sleep(0.001)
        step = motion.step(q, v, WALL, time=0.0)
    assert motion.guide.plan.status == ss.PlanStatus.found
    status = run(motion, q, WALL, 60.0, start=0.001)[1]
    assert status == ss.GuideStatus.arrived


def test_barriers_leave_a_goal_free_once_it_is_free(robot: ss.Robot, body: _core.Body) -> None:
    motion = guided(robot, body)
    motion.set_goal(GOAL)

    def ball(height: float) -> ss.Obstacles:
        return ss.Obstacles([[np.cos(-0.8), np.sin(-0.8), height]], 0.1)

    def pull(system: ss.GeometricSystem) -> float:
        at = GOAL + np.array([0.02, 0.0, 0.0])
        return float(
            np.linalg.norm(system.acceleration(at, np.zeros(3), ss.JointGoal(GOAL), ball(0.15)).acceleration)
        )

    assert motion.step(START, np.zeros(3), ball(0.0), time=0.0).status == ss.GuideStatus.goal_in_collision
    # 2.5 cm from the ellipsoids, within the activation of 6 cm: barriers made for the blocked goal hold the arm back
    motion.step(START, np.zeros(3), ball(0.15), time=0.021)  # after the guide's period
    free = 4.0 * 0.02  # stiffness times distance
    assert pull(motion.system) < 0.6 * free
    assert pull(motion.moving) == pytest.approx(free, rel=1e-9)  # rounding


def test_barriers_leave_room_at_the_narrow_places_of_the_path(robot: ss.Robot, body: _core.Body) -> None:
    motion = guided(robot, body, planner=ss.PlannerSettings(margin=0.01, floor=0.01), seed=2)
    motion.set_goal(GOAL)
    q, v, rest, values = START, np.zeros(3), np.zeros(3), []
    for k in range(4000):
        step = motion.step(q, v, WALL, time=PERIOD * k)
        if step.status == ss.GuideStatus.arrived:
            break
        for place in motion.lead(q, WALL, PERIOD * k).places:
            if not np.array_equal(place, GOAL):
                systems = (motion.moving, motion.system)
                values.append([s.acceleration(place, rest, GOAL, WALL).values.max() for s in systems])
        v = v + PERIOD * step.acceleration
        q = q + PERIOD * v
    assert step.status == ss.GuideStatus.arrived
    assert len(values) > 10
    relaxed, full = np.array(values).T
    assert np.all(full > 0.0)
    # Activation distances are shorter than the clearances there, but for the steps until the next look at the scene.
    assert np.percentile(relaxed, 90) == 0.0
    assert np.all(relaxed <= full)


def test_at_the_end_barriers_leave_room_at_the_goal_as_well(robot: ss.Robot, body: _core.Body) -> None:
    along, across = np.array([np.cos(0.8), -np.sin(0.8), 0.0]), np.array([-np.sin(0.8), -np.cos(0.8), 0.0])
    beside = ss.Obstacles(np.vstack([WALL.points, 0.9 * along + 0.1 * across]), 0.03)
    motion = guided(robot, body, planner=ss.PlannerSettings(margin=0.01, floor=0.01))
    motion.set_goal(GOAL)
    _, status, _ = run(motion, START, beside, 20.0)
    assert status == ss.GuideStatus.arrived
    rest = np.zeros(3)
    assert motion.system.acceleration(GOAL, rest, GOAL, beside).values.max() > 0.0
    assert motion.moving.acceleration(GOAL, rest, GOAL, beside).values.max() == 0.0


def test_what_moves_far_away_leaves_the_goal_free(robot: ss.Robot, body: _core.Body) -> None:
    """Near it, barriers are whole: what room they leave is for what rests."""
    motion = guided(robot, body)
    motion.set_goal(GOAL)
    # 2.5 cm from the ellipsoids at the goal, within the activation of 6 cm, rests a ball; another moves.
    resting = [np.cos(-0.8), np.sin(-0.8), 0.15]
    at, rest = GOAL + np.array([0.02, 0.0, 0.0]), np.zeros(3)

    def value(away: float, speed: float, time: float) -> float:
        seen = ss.Obstacles([resting, [away, 0.0, 2.0]], 0.1, velocities=[[0.0] * 3, [0.0, 0.0, -speed]])
        motion.step(at, rest, seen, time=time)
        return float(motion.moving.acceleration(at, rest, ss.JointGoal(GOAL), seen).values.max())

    full = motion.system.acceleration(at, rest, GOAL, ss.Obstacles([resting], 0.1)).values.max()
    assert full > 0.0
    assert value(5.0, 0.2, 0.0) == 0.0
    assert value(5.1, 0.2, 0.03) == 0.0  # it has moved, what rests has not
    assert value(0.5, 0.2, 0.06) == 0.0  # at most 1.7 m away after a second
    assert value(0.5, 2.0, 0.09) == pytest.approx(full, rel=1e-12)
    assert value(5.0, 0.2, 0.12) == 0.0
