"""Published problems in closed loop: two for a planar arm, one free and one whose goal is inside a post."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from sidestep import Robot
from sidestep.bench import (
    Method,
    MotionSettings,
    SceneResult,
    SceneSettings,
    read_motion_bench_maker,
    run_scenes,
    scenes,
)
from sidestep.bench.arm import Arm, Arms, load_robot
from sidestep.bench.scenes import SceneOutcome
from sidestep.bench.step_times import StepTimes
from sidestep.body import Body
from sidestep.cli import app

HERE = Path(__file__).parent
PLANAR = HERE / "motion_bench_maker_planar"
PANDA = HERE / "motion_bench_maker"
SETTINGS = SceneSettings(
    robot="planar3",
    method=Method.unswitched,
    motion=MotionSettings(duration=8.0),
    spacing=0.04,
    point_radius=0.02,
)


@pytest.fixture(scope="module")
def result() -> SceneResult:
    return run_scenes(SETTINGS, read_motion_bench_maker(PLANAR))


def test_each_problem_is_judged_on_its_solids(result: SceneResult) -> None:
    free, inside = result.outcomes
    assert free.solved
    assert free.outcome is not None
    assert free.outcome.min_clearance_m is not None
    assert free.outcome.min_clearance_m > 0.5  # the post is behind the arm
    # the planar arm moves 0.8, 0.6, 0.1 rad: the straight way is the shortest
    assert free.path_length >= np.linalg.norm([0.8 - 0.05, 0.6 - 0.05, 0.1 - 0.05])
    assert not inside.solved
    assert inside.goal.exact.distance < 0.0
    assert inside.goal.exact.obstacle == "post"


def test_the_report_counts_them(result: SceneResult) -> None:
    document = result.to_document(failures=True)
    figures = document["all"]
    assert document["sets"] == {"sweep": figures}
    assert (figures["problems"], figures["solved"], figures["straight_line_blocked"]) == (2, 1, 1)
    assert figures["motion_s"]["median"] == pytest.approx(result.outcomes[0].outcome.time_s)  # type: ignore[union-attr]
    assert figures["planning_ms"] is None  # nothing is planned
    assert figures["first_motion_ms"]["median"] > 0.0
    assert document["unknown_joints"] == ["gripper"]
    assert [(item["set"], item["index"]) for item in document["failures"]] == [("sweep", 2)]
    json.dumps(document, allow_nan=False)


@pytest.mark.slow
def test_finer_covers_are_tried_where_they_may_help_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    free, inside = read_motion_bench_maker(PLANAR)
    settings = replace(SETTINGS, method=Method.controller, motion=MotionSettings(duration=0.2), finer=True)
    blocked = run_scenes(settings, [inside])  # the meshes are inside the post as well
    assert blocked.outcomes[0].outcome is not None
    assert not blocked.outcomes[0].outcome.arrived
    assert blocked.to_document()["finer"] == []

    numbers: list[int] = []
    judged = scenes.judged

    def late_at_first(arm: Arm, *given: Any, **named: Any) -> tuple[SceneOutcome, StepTimes]:
        numbers.append(list(arm.body.links).count("link2"))
        outcome, times = judged(arm, *given, **named)
        return replace(outcome, tight={"link2": 31} if len(numbers) == 1 else {}), times

    monkeypatch.setattr(scenes, "judged", late_at_first)
    again = run_scenes(settings, [free])  # 0.2 s is not enough
    assert numbers[0] < 31
    assert numbers[1:] == [31]
    expected = {"set": "sweep", "index": 1, "links": {"link2": 31}, "solved": False}
    assert again.to_document()["finer"] == [expected]


def test_motions_without_an_optimum_are_counted(result: SceneResult) -> None:
    free, inside = result.outcomes
    ratios = (1.25, 1.5, float("nan"))
    several = replace(result, outcomes=(*(replace(free, jerk_time_ratio=ratio) for ratio in ratios), inside))
    figures = several.to_document()["all"]
    assert figures["jerk_time_ratio"]["median"] == pytest.approx(1.375)
    assert figures["jerk_time_ratio_unsolved"] == 1
    plain = result.to_document()["all"]
    assert plain["jerk_time_ratio"] is None
    assert plain["jerk_time_ratio_unsolved"] == 0


def test_goals_that_no_torque_holds_are_counted_and_said(result: SceneResult) -> None:
    _, failed = result.outcomes
    assert failed.goal_effort is None  # nothing is moved by torque
    several = replace(
        result, outcomes=tuple(replace(failed, goal_effort=share) for share in (0.4, 0.99, 1.04))
    )
    figures = several.to_document()["all"]
    assert (figures["goal_beyond_effort"], figures["goal_effort"]["max"]) == (1, pytest.approx(1.04))
    said = [any("104 % of a joint's effort limit" in r for r in item.reasons()) for item in several.outcomes]
    assert said == [False, False, True]


def test_the_optimum_needs_its_package_before_anything_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(ModuleNotFoundError, match="casadi"):
        run_scenes(replace(SETTINGS, jerk_time_ratio=True), read_motion_bench_maker(PLANAR))


@pytest.mark.slow
def test_the_command_states_the_time_over_the_optimum(tmp_path: Path) -> None:
    out = tmp_path / "out.json"
    command = ["bench", "motionbenchmaker", str(PLANAR), "--robot", "planar3", "--method", "unswitched"]
    run = CliRunner().invoke(
        app,
        [*command, "--optimum", "--jobs", "1", "--problems", "1", "--json", str(out)],
        env={"COLUMNS": "220"},
    )
    assert run.exit_code == 0, run.output
    assert "over optimum" in run.output
    figures = json.loads(out.read_text())["all"]
    assert figures["jerk_time_ratio_unsolved"] == 0
    assert 1.0 < figures["jerk_time_ratio"]["median"] < figures["time_ratio"]["median"]


@pytest.mark.slow
def test_processes_do_not_change_the_outcome(result: SceneResult) -> None:
    parallel = run_scenes(replace(SETTINGS, jobs=2), read_motion_bench_maker(PLANAR))
    for one, other in zip(result.outcomes, parallel.outcomes, strict=True):
        assert replace(one, outcome=None).index == other.index
        assert one.outcome is not None
        assert other.outcome is not None
        # The least clearance is that of a flat stretch here; where on it the search ends, to 1e-11 m, depends on the
        # convex parts that a process has already. The motion itself is equal bit for bit.
        rounding = 1e-9
        near = {
            "min_clearance_m": pytest.approx(other.outcome.min_clearance_m, abs=rounding),
            "clearance_time_s": pytest.approx(other.outcome.clearance_time_s, abs=rounding),
        }
        assert asdict(one.outcome) == asdict(other.outcome) | near
        assert one.path_length == other.path_length


def test_the_command_measures_ends_alone(tmp_path: Path) -> None:
    out = tmp_path / "out.json"
    command = ["bench", "motionbenchmaker", str(PLANAR), "--robot", "planar3", "--method", "unswitched"]
    run = CliRunner().invoke(
        app, [*command, "--clearances", "--jobs", "1", "--problems", "1", "--json", str(out)]
    )
    assert run.exit_code == 0, run.output
    figures = json.loads(out.read_text())["all"]
    assert figures["problems"] == 1
    assert "solved" not in figures
    assert figures["goal_clearance_mm"]["min"] > 500.0


def test_fingers_stand_where_the_request_puts_them() -> None:
    """The problem's opening, 65 mm a finger, is beyond the range of the Panda's file; the arm's 7 joints move."""
    pick, reach = read_motion_bench_maker(PANDA)
    plain = load_robot("panda")
    body = Body.fit(plain, components=1, cache=False, samples=200)
    arms = Arms("panda", Method.unswitched, body)
    wide, narrow = arms.of(reach), arms.of(pick)
    assert wide.robot.held == reach.held
    assert narrow.robot.held == pick.held
    assert arms.of(reach) is wide
    assert wide.robot.num_coordinates == 7
    assert ("panda_hand", "panda_link5") not in [tuple(sorted(pair)) for pair in wide.self_collision.pairs]


def test_a_goal_beyond_the_limits_is_said() -> None:
    [pick] = read_motion_bench_maker(PANDA / "pick_panda")
    body = Body.fit(Robot.named("panda"), components=1, cache=False, samples=200)
    arm = Arms("panda", Method.unswitched, body).of(pick)
    problem, published = arm.problem(pick, spacing=0.05, point_radius=0.0)
    assert published[3] == 0.0162  # joint 4 ends at -0.0698 rad
    assert problem.goal[3] == -0.0698
    assert len(problem.obstacles) == 0


def test_joints_that_do_not_fit_are_named() -> None:
    [problem] = read_motion_bench_maker(PANDA / "reach_panda")
    body = Body.fit(Robot.named("planar2"), components=1, cache=False, samples=200)
    with pytest.raises(ValueError, match=r"plans the joints panda_joint1, .* 'planar2' has joint1, joint2"):
        Arms("planar2", Method.unswitched, body).of(problem)
