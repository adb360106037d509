"""Balls that come and go: the same for a seed, in the way, and judged only while they are there."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from sidestep import ExactClearance, Robot, SceneObject
from sidestep.bench import (
    DynamicProblem,
    Judge,
    Kind,
    Method,
    Motion,
    MotionSettings,
    ProblemGenerator,
    ProblemSettings,
    SceneSettings,
    run_dynamic,
)
from sidestep.bench.arm import Arm
from sidestep.bench.dynamic import BLOCKED_WITHIN, FROM_GOAL, FROM_START, with_ball
from sidestep.bench.methods import build_body
from sidestep.bench.problem import poses_over
from sidestep.thesis import rollout


@cache
def arm() -> Arm:
    robot = Robot.named("planar3")
    return Arm.of(robot, Method.unswitched, build_body(Method.unswitched, robot))


@cache
def generator() -> ProblemGenerator:
    return ProblemGenerator(ProblemSettings(robot="planar3", obstacles=1, seed=3), robot=arm().robot)


def drawn(kind: Kind, index: int = 0) -> DynamicProblem:
    return with_ball(generator().problem(index), kind, arm(), generator().workspace, seed=3)


@pytest.mark.parametrize("kind", list(Kind))
def test_a_ball_is_where_its_kind_says(kind: Kind) -> None:
    problem, again = drawn(kind), drawn(kind)
    np.testing.assert_array_equal(problem.ball.pose, again.ball.pose)
    assert problem.ball.present == again.ball.present
    exact = ExactClearance(arm().robot, [problem.ball])
    assert exact.distance(problem.start).distance >= FROM_START
    at_goal = exact.distance(problem.goal).distance
    if kind.in_goal:
        assert at_goal < 0.0
        rng = np.random.default_rng(0)
        within = problem.goal + rng.uniform(-BLOCKED_WITHIN, BLOCKED_WITHIN, (50, len(problem.goal)))
        assert max(exact.distance(q).distance for q in within) < 0.0
    if kind is Kind.sudden:
        assert at_goal >= FROM_GOAL
        assert len(problem.obstacles_at(0.0)) == 1
        assert len(problem.obstacles_at(problem.changes[0])) == 2
    if kind is Kind.cleared:
        assert len(problem.obstacles_at(problem.changes[0])) == 1
    assert np.any(problem.ball.velocity) == (kind is Kind.drift)
    assert (problem.changes == ()) == (kind in (Kind.blocked, Kind.drift))


def test_an_absent_ball_touches_nothing_and_a_present_one_does() -> None:
    """The arm rests where the ball is from 0.1 s to 0.2 s, 50 mm or more inside it."""
    robot, base = arm().robot, generator().problem(0)
    at = robot.pose(base.start, "link2")[:3, 3]
    q = np.tile(base.start, (300, 1))
    for present, touched in (((0.1, 0.2), True), ((0.5, 0.6), False)):
        ball = SceneObject.ball("ball", at, radius=0.05, motion="moving", present=present)
        problem = DynamicProblem(base, Kind.sudden, ball)
        poses = poses_over(problem.objects, np.arange(300) * 1e-3)
        motion = Motion(q, 0.0 * q, 0.0 * q, poses, None, 0, False, np.full(300, 1e-6))
        outcome = Judge(robot).judge(problem, motion, MotionSettings())
        assert outcome.collision == touched
        if touched:
            assert 0.1 <= outcome.clearance_time_s < 0.2


def test_the_controller_sees_a_ball_from_the_moment_it_is_there() -> None:
    """Until then the motion is that among the balls at rest, and afterwards it is not."""
    problem = drawn(Kind.sudden)
    settings = MotionSettings(duration=problem.changes[0] + 0.5)
    motion = arm().runner.move(problem, settings)
    steps = round(settings.duration / settings.period)
    alone = rollout(
        arm().runner.system,
        problem.start,
        np.zeros(3),
        problem.goal,
        problem.base.obstacles_at(0.0),
        period=settings.period,
        steps=steps,
    )
    before = int(np.ceil(problem.changes[0] / settings.period))
    np.testing.assert_array_equal(motion.q[: before + 1], alone.q[: before + 1])
    assert not np.array_equal(motion.q[before + 2 :], alone.q[before + 2 : len(motion.q)])


def test_every_kind_is_reported_as_a_set() -> None:
    settings = SceneSettings(
        robot="planar3", method=Method.unswitched, motion=MotionSettings(duration=2.0), jobs=1
    )
    document = run_dynamic(settings, count=1, seed=3, obstacles=1).to_document(failures=True)
    assert set(document["sets"]) == {f"random {kind.value}" for kind in Kind}
    assert document["all"]["problems"] == 4
    with pytest.raises(ValueError, match="count is 0"):
        run_dynamic(settings, count=0)


@pytest.mark.slow
def test_an_arm_beside_a_ball_in_its_goal_has_not_arrived() -> None:
    settings = SceneSettings(
        robot="planar3",
        method=Method.controller,
        motion=MotionSettings(duration=6.0, tolerance=0.5),
        jobs=1,
    )
    result = run_dynamic(settings, count=2, seed=3, obstacles=0)
    ended = {(x.set, x.index): x for x in result.outcomes}
    for index in range(2):
        blocked = ended["random blocked", index]
        assert blocked.outcome is not None
        assert blocked.solved
        assert not blocked.outcome.arrived
        assert blocked.outcome.error_rad > BLOCKED_WITHIN
        assert blocked.tolerance == BLOCKED_WITHIN
        assert ended["random drift", index].tolerance == 0.5


def test_only_a_moving_object_comes_and_goes() -> None:
    with pytest.raises(ValueError, match="only a moving object"):
        SceneObject.ball("ball", [0.0, 0.0, 0.0], radius=0.1, present=(1.0, 2.0))
    with pytest.raises(ValueError, match="present must be"):
        SceneObject.ball("ball", [0.0, 0.0, 0.0], radius=0.1, motion="moving", present=(2.0, 1.0))
