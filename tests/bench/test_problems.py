"""Problems: the same everywhere, and what their generator promises, by value."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from sidestep import ExactClearance, Robot
from sidestep.bench import ProblemGenerator, ProblemSettings, Workspace
from sidestep.bench.problems import balls

FIRST_START = [1.57542325, -0.92977345, 2.18413562, -2.87282081, -0.91987494, 1.14147015, -0.29954301]
FIRST_CENTER = [-0.16886332, 0.81862161, 0.4740888]
FIRST_RADIUS = 0.09066351


@pytest.fixture(scope="module")
def fr3(arm: Robot) -> ProblemGenerator:
    return ProblemGenerator(ProblemSettings(robot="fr3", seed=0, moving=0.5), robot=arm)


@pytest.mark.slow
def test_a_problem_depends_on_seed_and_index_alone(fr3: ProblemGenerator) -> None:
    first = fr3.problem(3)
    fr3.problem(1)
    again = ProblemGenerator(fr3.settings, robot=fr3.robot, self_collision=fr3.self_collision).problem(3)
    for name in ("start", "goal", "centers", "velocities", "radii"):
        np.testing.assert_array_equal(getattr(first, name), getattr(again, name))
    assert first.straight_line_blocked == again.straight_line_blocked
    assert not np.array_equal(first.start, fr3.problem(4).start)


def test_the_first_problem_has_not_changed(fr3: ProblemGenerator) -> None:
    """Published results stand on these problems: a change of them needs new results."""
    problem = fr3.problem(0)
    # 1e-6: kinematics and the rounded workspace may differ in the last digits between machines
    np.testing.assert_allclose(problem.start, FIRST_START, atol=1e-6)
    np.testing.assert_allclose(problem.centers[0], FIRST_CENTER, atol=1e-6)
    np.testing.assert_allclose(problem.radii[0], FIRST_RADIUS, atol=1e-6)


def test_what_is_promised_holds(fr3: ProblemGenerator) -> None:
    robot, shell = fr3.robot, fr3.workspace
    for index in range(5):
        problem = fr3.problem(index)
        assert problem.centers.shape == problem.velocities.shape == (10, 3)
        away = np.linalg.norm(problem.centers - shell.shoulder, axis=1) / shell.reach
        assert np.all((away >= 0.35) & (away <= 1.0))
        assert np.all((problem.radii >= 0.05) & (problem.radii <= 0.10))
        assert np.all(np.linalg.norm(problem.velocities, axis=1) <= 0.5)
        exact = ExactClearance(robot, balls(problem.centers, problem.radii), include_immobile=True)
        for q in (problem.start, problem.goal):
            robot.check_configuration(q)
            assert fr3.self_collision.touching(q) == ()
            closest = exact.distance(q)
            assert closest.distance >= (0.02 if closest.link == "fr3_link0" else 0.03)


@pytest.mark.slow
def test_the_straight_line_is_judged_between_its_ends(fr3: ProblemGenerator) -> None:
    for index in range(4):
        problem = fr3.problem(index)
        exact = ExactClearance(fr3.robot, balls(problem.centers, problem.radii))
        line = problem.start + np.linspace(0.0, 1.0, 200)[:, None] * (problem.goal - problem.start)
        touches = min(exact.distance(q).distance for q in line) <= 0.0
        assert (
            touches == problem.straight_line_blocked or not touches
        )  # samples may miss a touch, not add one


def test_balls_stand_where_they_drift_from(fr3: ProblemGenerator) -> None:
    still = ProblemGenerator(
        dataclasses.replace(fr3.settings, moving=0.0), robot=fr3.robot, self_collision=fr3.self_collision
    ).problem(2)
    moving = fr3.problem(2)
    np.testing.assert_array_equal(still.centers, moving.centers)
    np.testing.assert_array_equal(still.start, moving.start)
    assert np.all(still.velocities == 0.0)
    assert np.all(np.linalg.norm(moving.velocities, axis=1) > 0.0)


def test_a_planar_arm_gets_its_balls_in_its_plane(generator: ProblemGenerator) -> None:
    shell = Workspace.of(generator.robot)
    # three links of 0.5 m; 5 mm: the farthest of 2000 random configurations is not quite stretched
    assert shell.reach == pytest.approx(1.5, abs=5e-3)
    assert len(shell.directions) == 2
    heights = generator.problem(0).centers[:, 2]
    # 1e-9: rounding
    np.testing.assert_allclose(heights, shell.shoulder[2], atol=1e-9)


def test_the_shoulder_of_the_fr3_is_on_its_first_axis(fr3: ProblemGenerator) -> None:
    # link 2's joints meet 0.333 m above the base; 5 cm: the workspace is not quite symmetric about it
    np.testing.assert_allclose(fr3.workspace.shoulder, [0.0, 0.0, 0.333], atol=0.05)


@pytest.mark.parametrize("change", [{"obstacles": -1}, {"seed": -1}, {"moving": float("nan")}])
def test_bad_settings_are_refused_by_name(change: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(change))):
        ProblemSettings(**change)  # type: ignore[arg-type]
