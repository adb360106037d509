"""The judge finds what was planted, and only that."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from sidestep.bench import ControllerRunner, Judge, Motion, MotionSettings, ProblemGenerator, ReachProblem

SETTINGS = MotionSettings()


@pytest.fixture(scope="module")
def judge(generator: ProblemGenerator) -> Judge:
    return Judge(generator.robot, self_collision=generator.self_collision)


def planted(center: tuple[float, float, float], radius: float, generator: ProblemGenerator) -> ReachProblem:
    """The stretched planar arm (1.5 m along x) turns by a quarter."""
    return ReachProblem(
        robot="planar3",
        seed=0,
        index=0,
        start=np.zeros(3),
        goal=np.array([1.5, 0.0, 0.0]),
        centers=np.array([center]),
        velocities=np.zeros((1, 3)),
        radii=np.array([radius]),
        straight_line_blocked=True,
    )


def swept(problem: ReachProblem, *, samples: int) -> Motion:
    """Straight to the goal, whatever is in the way."""
    q = problem.start + np.linspace(0.0, 1.0, samples)[:, None] * (problem.goal - problem.start)
    poses = np.zeros((samples, 1, 7))
    poses[:, :, :3], poses[:, :, 3] = problem.centers, 1.0
    still = np.zeros_like(q)
    return Motion(q, still, still, poses, None, 0, True, np.zeros(samples))


def test_a_planted_collision_between_samples_is_reported(generator: ProblemGenerator, judge: Judge) -> None:
    problem = planted((1.4 * np.cos(0.75), 1.4 * np.sin(0.75), 0.0), 0.01, generator)
    outcome = judge.judge(problem, swept(problem, samples=2), SETTINGS)
    assert outcome.collision
    assert not outcome.success
    assert not outcome.stuck
    assert outcome.clearance_pair == "link3 - obstacle_0"
    assert "collision" in outcome.reasons()[0]


def test_a_miss_is_no_collision(generator: ProblemGenerator, judge: Judge) -> None:
    problem = planted((1.8 * np.cos(0.75), 1.8 * np.sin(0.75), 0.0), 0.05, generator)
    outcome = judge.judge(problem, swept(problem, samples=50), SETTINGS)
    assert outcome.success
    assert outcome.reasons() == []
    assert outcome.min_clearance_m is not None
    assert (
        0.2 < outcome.min_clearance_m < 0.26
    )  # 1.8 - 1.5 - 0.05 less half the width of the link, about 4 cm


def test_a_fold_is_a_self_collision(generator: ProblemGenerator, judge: Judge) -> None:
    problem = dataclasses.replace(planted((3.0, 0.0, 0.0), 0.05, generator), goal=np.array([0.0, 2.6, 2.6]))
    outcome = judge.judge(problem, swept(problem, samples=2), SETTINGS)
    assert outcome.self_collision
    assert not outcome.collision
    assert not outcome.success
    assert outcome.self_pair == "link1 - link3"


def test_limits_are_named(generator: ProblemGenerator, judge: Judge) -> None:
    problem = planted((3.0, 0.0, 0.0), 0.05, generator)
    motion = swept(problem, samples=50)
    fast = np.zeros_like(motion.q)
    fast[7, 1] = generator.robot.limits.velocity[1] + 0.25
    outcome = judge.judge(problem, dataclasses.replace(motion, v=fast), SETTINGS)
    assert outcome.limits == {"velocity": pytest.approx(0.25)}


@pytest.mark.parametrize(
    ("outside", "excess"),
    [
        ([5e-4, 3e-4, 1e-4, 0.0, -0.1], None),  # a rounding error at the start, and in
        ([5e-4, 3e-4, 4e-4, 0.0, -0.1], 1e-4),  # out again
        ([5e-4, 0.0, -0.1, 2e-4, 0.0], 2e-4),
        ([2e-3, 1e-3, 0.0, -0.1, -0.1], 2e-3),  # more than rounding
    ],
)
def test_a_start_a_rounding_error_outside_its_limits_is_no_violation_while_it_comes_in(
    outside: list[float], excess: float | None, generator: ProblemGenerator, judge: Judge
) -> None:
    problem = planted((3.0, 0.0, 0.0), 0.05, generator)
    motion = swept(problem, samples=len(outside))
    motion.q[:, 0] = generator.robot.limits.upper[0] + np.array(outside)
    limits = judge.judge(problem, motion, SETTINGS).limits
    assert limits == ({} if excess is None else {"position": pytest.approx(excess)})


@pytest.mark.parametrize(
    ("speed", "under_way"),
    [(0.3, True), (0.02, True), (0.0004, False), (-0.2, False)],  # [rad/s] at the end, towards the goal
)
def test_a_motion_that_comes_nearer_is_not_stuck(
    speed: float, under_way: bool, generator: ProblemGenerator, judge: Judge
) -> None:
    problem = planted((3.0, 0.0, 0.0), 0.05, generator)
    left = 0.1 + speed * np.linspace(2.0, 0.0, 2001)  # [rad]
    motion = dataclasses.replace(swept(problem, samples=2001), arrived=False)
    motion.q[:] = problem.goal
    motion.q[:, 0] -= left
    outcome = judge.judge(problem, motion, SETTINGS)
    assert (outcome.under_way, outcome.stuck) == (under_way, not under_way)
    assert outcome.reasons() == [
        f"{'under way' if under_way else 'stuck'}: 0.10 rad from the goal after 2.0 s"
    ]


def test_a_state_that_is_not_finite_ends_the_motion(generator: ProblemGenerator, judge: Judge) -> None:
    problem = planted((3.0, 0.0, 0.0), 0.05, generator)
    motion = dataclasses.replace(swept(problem, samples=50), arrived=False)
    motion.q[20:] = np.nan
    outcome = judge.judge(problem, motion, SETTINGS)
    assert outcome.diverged
    assert outcome.stuck
    assert outcome.time_s == pytest.approx(0.019)


@pytest.mark.slow
def test_a_motion_ends_where_it_arrives(generator: ProblemGenerator, runner: ControllerRunner) -> None:
    problem = planted((3.0, 0.0, 0.0), 0.05, generator)
    motion = runner.move(problem, SETTINGS)
    assert motion.arrived
    error = np.abs(motion.q - problem.goal).max(axis=1)
    assert error[-1] < 0.05 <= error[-2]
    assert len(motion.q) == len(motion.v) == len(motion.object_poses) == len(motion.step_seconds)
    assert np.all(motion.step_seconds > 0.0)
    # 1e-12: rounding of one addition; semi-implicit Euler across the chunks too
    np.testing.assert_allclose(motion.q[1:], motion.q[:-1] + 1e-3 * motion.v[1:], atol=1e-12)


def test_a_motion_that_does_not_arrive_has_a_row_for_every_step(
    generator: ProblemGenerator, runner: ControllerRunner
) -> None:
    problem = planted((3.0, 0.0, 0.0), 0.05, generator)
    motion = runner.move(problem, MotionSettings(duration=0.6))
    assert not motion.arrived
    assert len(motion.q) == 600


def test_a_safe_motion_keeps_every_limit(
    generator: ProblemGenerator, runner: ControllerRunner, judge: Judge
) -> None:
    settings = MotionSettings(duration=2.0)
    for index in range(2):
        problem = generator.problem(index)
        outcome = judge.judge(problem, runner.move(problem, settings), settings)
        assert outcome.limits == {}
        assert not outcome.collision
