"""Problems: the same everywhere, and what their generator promises, by value."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from sidestep import ExactClearance, Robot
from sidestep.bench import ProblemGenerator, ProblemSettings, SweptSpace, Workspace
from sidestep.bench.problems import balls
from sidestep.cli import app

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


RAIL = """<robot name="cart"><link name="floor"/>
<link name="cart"><collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
<link name="upper"><collision><origin xyz="0 0 0.25"/>
  <geometry><box size="0.05 0.05 0.4"/></geometry></collision></link>
<link name="fore"><collision><origin xyz="0 0 0.15"/><geometry><box size="0.05 0.05 0.3"/></geometry></collision></link>
<joint name="rail" type="prismatic"><parent link="floor"/><child link="cart"/><axis xyz="1 0 0"/>
  <limit lower="-2" upper="2" velocity="0.5" effort="100"/></joint>
<joint name="turn" type="continuous"><parent link="cart"/><child link="upper"/><axis xyz="0 1 0"/>
  <limit velocity="2" effort="50"/></joint>
<joint name="bend" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0 0 0.5"/><axis xyz="1 0 0"/>
  <limit lower="-2" upper="2" velocity="2" effort="50"/></joint></robot>"""


@pytest.fixture
def rail(tmp_path: Path) -> str:
    file = tmp_path / "rail.urdf"
    file.write_text(RAIL)
    return str(file)


def test_balls_of_an_arm_on_a_rail_are_where_its_links_get_to(rail: str) -> None:
    generator = ProblemGenerator(ProblemSettings(robot=rail, obstacles=4, seed=2))
    space = generator.workspace
    assert isinstance(space, SweptSpace)
    # 0.5 m to the second joint, 0.3 m of link beyond it; 1 cm: the farthest of 2000 configurations
    assert space.reach == pytest.approx(np.hypot(0.8, 0.025), abs=0.01)
    # All along the rail, and beyond its ends by less than the arm is long and a cell.
    low, high = space.cells.min(axis=0), space.cells.max(axis=0) + space.edge
    assert -2.0 - space.reach - space.edge < low[0] < -2.5
    assert 2.5 < high[0] < 2.0 + space.reach + space.edge
    assert len(space.directions) == 3
    points = np.array([space.sample(np.random.default_rng(k)) for k in range(200)])
    assert np.ptp(points[:, 0]) > 4.0
    assert np.all(
        np.linalg.norm(points - np.clip(points, [-2, 0, 0], [2, 0, 0]), axis=1) < space.reach + 2 * space.edge
    )
    for index in range(4):
        problem = generator.problem(index)
        assert np.all((problem.radii >= 0.05 * space.reach) & (problem.radii <= 0.1 * space.reach))
        exact = ExactClearance(generator.robot, balls(problem.centers, problem.radii))
        for q in (problem.start, problem.goal):
            assert exact.distance(q).distance >= 0.03 * space.reach
        assert (
            abs(problem.goal[1] - problem.start[1]) <= np.pi
        )  # the nearest turn of the joint without limits


@pytest.mark.slow
def test_an_arm_of_a_file_is_run_by_the_command(rail: str, tmp_path: Path) -> None:
    out = tmp_path / "out.json"
    command = [
        "bench",
        "reach",
        "--robot",
        rail,
        "--locked",
        "bend=0.5",
        "--draft",
        "--obstacles",
        "2",
        "--problems",
        "2",
    ]
    command += ["--acceleration-limit", "rail=5", "--jobs", "1", "--json", str(out)]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    figures = json.loads(out.read_text())
    assert figures["problems"] == figures["success"] == 2
    assert (
        figures["limit_violations"] == figures["collision"] == figures["stuck"] == figures["under_way"] == 0
    )
    refused = CliRunner().invoke(app, ["bench", "reach", "--robot", "fr3", "--tip", "fr3_link4"])
    assert isinstance(refused.exception, ValueError)
    assert "tip cannot be given for robot 'fr3'" in str(refused.exception)
