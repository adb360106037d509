"""Whole benchmarks: counts add up, and processes do not matter."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from sidestep.bench import BenchSettings, Method, MotionSettings, ProblemSettings, reach, run_bench
from sidestep.bench.problems import ProblemGenerator, ReachProblem
from sidestep.body import Body
from sidestep.cli import app
from sidestep.robot import Robot
from support.two_links import BOX, beside

SETTINGS = BenchSettings(
    problems=ProblemSettings(robot="planar3", obstacles=2, seed=1),
    count=4,
    method=Method.unswitched,
    motion=MotionSettings(duration=5.0),
)


@pytest.fixture(scope="module")
def serial() -> dict[str, object]:
    return run_bench(SETTINGS).to_document(failures=True)


def test_every_problem_is_counted_once(serial: dict[str, int]) -> None:
    touched = serial["problems"] - serial["success"] - serial["stuck"] - serial["under_way"]
    assert serial["problems"] == 4
    assert max(serial["collision"], serial["self_collision"]) <= touched
    assert touched <= serial["collision"] + serial["self_collision"]
    assert set(serial["step_us"]) == {"median", "p95", "p99", "p99.9", "max"}
    assert serial["step_us"]["median"] <= serial["step_us"]["p99"] <= serial["step_us"]["max"]
    json.dumps(serial, allow_nan=False)


@pytest.mark.slow
def test_processes_do_not_change_the_outcome(serial: dict[str, object]) -> None:
    parallel = run_bench(replace(SETTINGS, jobs=2)).to_document(failures=True)
    for document in (serial, parallel):
        document.pop("step_us")  # times differ, nothing else does
        document.pop("jobs")
    assert parallel == serial


def test_the_command_writes_figures_and_the_problems(serial: dict[str, object], tmp_path: Path) -> None:
    file, out = tmp_path / "problems.json", tmp_path / "out.json"
    command = ["bench", "reach", "--robot", "planar3", "--obstacles", "2", "--problems", "4", "--seed", "1"]
    how = ["--method", "unswitched", "--duration", "5", "--jobs", "1", "--json", str(out)]
    first = CliRunner().invoke(app, [*command, *how, "--export", str(file)])
    assert first.exit_code in (0, 1), first.output
    drawn = json.loads(out.read_text())
    for key in ("success", "collision", "stuck", "self_collision", "steps", "min_clearance_m"):
        assert drawn[key] == serial[key]
    again = CliRunner().invoke(app, ["bench", "reach", "--problems-file", str(file), *how])
    assert again.exit_code == first.exit_code
    read = json.loads(out.read_text())
    for key in ("success", "collision", "stuck", "self_collision", "steps", "min_clearance_m"):
        assert read[key] == serial[key]


def test_nothing_to_run_is_refused() -> None:
    with pytest.raises(ValueError, match="count"):
        replace(SETTINGS, count=0)


@pytest.mark.slow
@pytest.mark.parametrize("index", [4, 15, 23])
def test_a_fast_arm_minds_what_is_ahead_not_what_is_nearest(index: int) -> None:
    # At full speed a UR10 needs 0.3 m to stop. Rows of the nearest alone let it touch within 0.7 s: itself (4), or
    # an obstacle ahead while another was nearer beside it.
    settings = ProblemSettings(robot="ur10", obstacles=10)
    problem = ProblemGenerator(settings).problem(index)
    bench = BenchSettings(problems=settings, motion=MotionSettings(duration=1.0))
    (outcome,) = run_bench(bench, problems=[problem]).outcomes
    assert not outcome.collision
    assert not outcome.self_collision
    assert outcome.limits == {}


def test_poses_are_reached_in_any_posture() -> None:
    settings = BenchSettings(
        problems=ProblemSettings(robot="fr3", obstacles=0, seed=2),
        count=2,
        motion=MotionSettings(duration=10.0, poses=True),
    )
    result = run_bench(settings)
    for outcome in result.outcomes:
        assert outcome.success
        distance, angle = outcome.pose_error
        assert distance < 1e-3
        assert angle < np.radians(0.5)
    assert (
        max(outcome.error_rad for outcome in result.outcomes) > 0.05
    )  # not by the posture it was drawn with
    assert result.to_document()["poses"] is True


def test_the_thesis_has_no_pose_goals() -> None:
    with pytest.raises(ValueError, match="pose goals are for the methods 'controller' and 'barrier'"):
        run_bench(replace(SETTINGS, motion=MotionSettings(duration=5.0, poses=True)))


@pytest.mark.slow
def test_finer_covers_reach_what_only_the_cover_blocks(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    file = tmp_path / "box.urdf"
    file.write_text(BOX)
    goal, start = np.array([0.5, 0.0]), np.array([-0.5, 0.0])
    ball = beside(Robot.from_urdf(file), goal, 0.010)
    problem = ReachProblem(
        robot=str(file),
        seed=0,
        index=0,
        start=start,
        goal=goal,
        centers=ball.pose[:3, 3][None],
        velocities=np.zeros((1, 3)),
        radii=np.array([ball.radius]),
        straight_line_blocked=False,
    )
    coarse = Body.cover(Robot.from_urdf(file), components={"l2": 2})
    monkeypatch.setattr(reach, "build_body", lambda *_given, **_named: coarse)
    settings = BenchSettings(
        problems=ProblemSettings(robot=str(file)), motion=MotionSettings(duration=4.0, tolerance=0.005)
    )
    (blocked,) = run_bench(settings, problems=[problem]).outcomes
    (reached,) = run_bench(replace(settings, finer=True), problems=[problem]).outcomes
    assert blocked.only_short_of_goal
    assert reached.success
    assert reached.min_clearance_m == pytest.approx(0.010, abs=0.003)
    with pytest.raises(ValueError, match="finer is for the controller"):
        replace(settings, method=Method.thesis, finer=True)
