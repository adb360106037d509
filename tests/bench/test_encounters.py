"""Drives, moving obstacles and faults: the same for a seed, judged on meshes, resumable; and the judge can fail."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from sidestep.bench import (
    DriveSettings,
    Encounter,
    EncounterJudge,
    FaultSettings,
    MovingSettings,
    Told,
    drive_table,
    fault_table,
    moving_table,
    parse_shard,
    run_campaign,
    run_drives,
    run_encounter,
    run_faults,
    run_moving,
)
from sidestep.bench.drives import FREE_AT_START, random_drive
from sidestep.bench.encounters import Course, IdealPlant, beyond_limits, load_with_meshes
from sidestep.bench.motion import Motion
from sidestep.bench.moving import FROM_ARM, EncounterMaker, MovingTask
from sidestep.distance import ExactClearance, SceneObject


@cache
def maker() -> EncounterMaker:
    return EncounterMaker(*load_with_meshes("fr3"))


def motion_of(q: np.ndarray, v: np.ndarray, a: np.ndarray, torque: np.ndarray | None = None) -> Motion:
    return Motion(q, v, a, np.zeros((len(q), 0, 7)), torque, 0, False, np.zeros(len(q)))


def test_steps_beyond_limits_are_counted_with_the_worst_ratio() -> None:
    limits = maker().robot.limits
    still = np.tile(maker().robot.neutral, (5, 1))
    v, a = np.zeros((5, 7)), np.zeros((5, 7))
    assert beyond_limits(motion_of(still, v, a), limits) == {}
    v[2, 1], v[3, 1] = 1.5 * limits.velocity[1], 1.1 * limits.velocity[1]
    q = still.copy()
    q[4, 0] = limits.upper[0] + 0.2
    torque = np.zeros((5, 7))
    torque[1:, 3] = 2.0 * limits.effort_rate[3] * 1e-3
    found = beyond_limits(motion_of(q, v, a, torque), limits)
    assert found["velocity"] == (2, pytest.approx(1.5, rel=1e-3))
    assert found["position"] == (1, pytest.approx(0.2, abs=1e-6))
    assert found["torque rate"] == (1, pytest.approx(2.0, rel=1e-3))
    assert set(found) == {"velocity", "position", "torque rate"}
    assert "position" not in beyond_limits(motion_of(q, v, a), limits, end=4)


@pytest.mark.parametrize("holds", [True, False])
def test_an_encounter_is_the_same_whatever_is_told(holds: bool) -> None:
    exact, late = (
        maker().make(MovingTask("fr3", told, 0.5, holds, 3), seed=1) for told in (Told.exact, Told.late)
    )
    np.testing.assert_array_equal(exact.start, late.start)
    np.testing.assert_array_equal(exact.objects[0].pose, late.objects[0].pose)
    other = maker().make(MovingTask("fr3", Told.exact, 0.5, holds, 4), seed=1)
    assert np.abs(exact.objects[0].pose - other.objects[0].pose).max() > 1e-3
    clearance = ExactClearance(maker().robot, exact.objects).distance(exact.start).distance
    assert clearance > FROM_ARM
    assert np.linalg.norm(exact.objects[0].velocity) == pytest.approx(0.5)


def test_the_judge_sees_a_contact_of_an_arm_that_is_told_nothing() -> None:
    """The check can fail: with obstacles told the same encounter ends without a contact."""
    task = MovingTask("fr3", Told.exact, 0.5, True, 0)
    told = maker().make(task, seed=0)
    judge = EncounterJudge(maker().robot)

    def blind(controller: object, step: int, q: np.ndarray) -> None:
        if step == 0:
            controller.set_goal(told.start)  # type: ignore[attr-defined]

    courses = [
        run_encounter(maker().arm, e, output="acceleration", plant=IdealPlant(e.start))
        for e in (told, replace(told, tell=blind))
    ]
    kept, lost = (judge.judge(e, c) for e, c in zip((told, told), courses, strict=True))
    assert kept.clearance_m > 0.0
    assert not kept.contact
    assert lost.clearance_m < 0.0
    assert lost.contact_speed == pytest.approx(0.0, abs=1e-6)
    assert lost.way_out is True


def test_speed_at_the_first_contact_is_that_of_the_arm() -> None:
    """A ball that stands in the way of an arm that turns its first joint at 1 rad/s."""
    robot = maker().robot
    steps = 600
    q = np.tile(robot.neutral, (steps, 1))
    q[:, 0] += 1e-3 * np.arange(steps)
    v = np.zeros_like(q)
    v[:, 0] = 1.0
    at = q[-1]
    ball = SceneObject.ball("ball", robot.pose(at, "fr3_hand")[:3, 3], radius=0.05, motion="moving")
    encounter = Encounter(0, q[0], steps, (ball,), lambda *_: None)
    poses = np.tile(np.r_[ball.pose[:3, 3], 1.0, 0.0, 0.0, 0.0], (steps, 1, 1))
    motion = replace(motion_of(q, v, np.zeros_like(q)), object_poses=poses)

    verdict = EncounterJudge(robot).judge(encounter, Course(motion, ("ok",) * steps))
    assert verdict.contact
    assert verdict.contact_speed == pytest.approx(1.0)
    exact = ExactClearance(robot, [ball])
    assert verdict.contact_s is not None
    first = round(verdict.contact_s / 1e-3)
    assert exact.distance(q[first]).distance <= 0.0 < exact.distance(q[first - 5]).distance


def test_balls_of_a_drive_are_away_from_the_start() -> None:
    robot = maker().robot
    for index in range(3):
        drive = random_drive(robot, DriveSettings(moving=0.4, seed=2), index)
        assert len(drive.objects) > 5
        assert ExactClearance(robot, drive.objects).distance(drive.start).distance > FREE_AT_START
        speeds = [np.linalg.norm(ball.velocity) for ball in drive.objects]
        assert set(np.round(speeds, 6)) == {0.0, 0.4}


class Doubler:
    """A worker that counts what it does in a file."""

    def __init__(self, log: Path | None = None) -> None:
        self.log = log

    def run(self, task: int) -> dict[str, object]:
        if self.log is not None:
            with self.log.open("a") as lines:
                lines.write(f"{task}\n")
        return {"name": str(task), "double": 2 * task}


def test_a_campaign_goes_on_where_it_was_cut_off(tmp_path: Path) -> None:
    file, log = tmp_path / "rows.jsonl", tmp_path / "log"
    given = {"name": str, "settings": {"bench": "doubles"}, "file": file}
    assert [row["double"] for row in run_campaign(lambda: Doubler(log), [1, 2, 3], **given)] == [2, 4, 6]
    lines = file.read_text().splitlines()
    file.write_text("\n".join([*lines[:2], lines[2][:5]]))  # the second row is cut off, the third is gone
    log.unlink()
    assert [row["double"] for row in run_campaign(lambda: Doubler(log), [1, 2, 3], **given)] == [2, 4, 6]
    assert log.read_text().split() == ["2", "3"]
    with pytest.raises(ValueError, match="of another campaign"):
        run_campaign(Doubler, [1], name=str, settings={"bench": "triples"}, file=file)


def test_shards_are_the_parts_of_a_campaign() -> None:
    parts = [
        [row["name"] for row in run_campaign(Doubler, range(7), name=str, settings={}, shard=(k, 3))]
        for k in (1, 2, 3)
    ]
    assert sorted(name for part in parts for name in part) == [str(k) for k in range(7)]
    assert max(map(len, parts)) - min(map(len, parts)) <= 1
    assert parse_shard("2/4") == (2, 4)
    for text in ("2", "a/b", "1-2"):
        with pytest.raises(ValueError, match="allowed: k/n"):
            parse_shard(text)
    with pytest.raises(ValueError, match="shard is 4/3"):
        run_campaign(Doubler, [1], name=str, settings={}, shard=(4, 3))


def test_settings_name_what_is_allowed() -> None:
    with pytest.raises(ValueError, match="case is 'rain', allowed: none, vanish"):
        FaultSettings(cases=("rain",))
    with pytest.raises(ValueError, match="speed is 0"):
        MovingSettings(speeds=(0.0,))
    with pytest.raises(ValueError, match="moving is -1"):
        DriveSettings(moving=-1.0)


@pytest.mark.slow
def test_a_small_set_of_each(tmp_path: Path) -> None:
    """Exact velocities, rest and a clean state: nothing is touched, and no hard limit is broken."""
    drives = drive_table(run_drives(DriveSettings(("fr3",), count=2)))["fr3"]
    assert drives["contacts"] == drives["self_contacts"] == 0
    assert drives["path"] > 1.0
    for name in ("position", "velocity", "torque", "torque rate"):
        assert drives["beyond"][name] == 0
    moving = moving_table(run_moving(MovingSettings(("fr3",), (Told.exact,), (0.5,), runs=1)))["fr3"][
        "exact 0.5"
    ]
    assert (moving["runs"], moving["contacts"], moving["self_contacts"]) == (2, 0, 0)
    file = tmp_path / "faults.jsonl"
    faults = fault_table(run_faults(FaultSettings(("fr3",), ("none", "noise"), runs=1), file=file))
    for case in ("none", "noise"):
        assert (faults[case]["runs"], faults[case]["contacts"]) == (1, 0)
        assert "torque" not in faults[case]["beyond"]
    rows = [json.loads(line) for line in file.read_text().splitlines()]
    assert [row["name"] for row in rows[1:]] == ["fr3 none 0", "fr3 noise 0"]
