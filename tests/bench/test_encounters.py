"""Drives, moving obstacles and faults: the same for a seed, judged on meshes, resumable; and the judge can fail."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from sidestep.bench import (
    After,
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
from sidestep.bench.encounters import Course, IdealPlant, load_with_meshes
from sidestep.bench.faults import broken_promises, fault_encounter
from sidestep.bench.motion import Motion
from sidestep.bench.moving import FROM_ARM, STANDS, EncounterMaker, MovingTask, is_kept
from sidestep.distance import ExactClearance, SceneObject
from sidestep.obstacles import Shape


@cache
def maker() -> EncounterMaker:
    return EncounterMaker(*load_with_meshes("fr3"))


def motion_of(q: np.ndarray, v: np.ndarray, a: np.ndarray, torque: np.ndarray | None = None) -> Motion:
    return Motion(q, v, a, np.zeros((len(q), 0, 7)), torque, 0, False, np.zeros(len(q)))


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


class Heard:
    """A controller that keeps the last solid that it was told of."""

    def set_goal(self, goal: object) -> None:
        """Nothing."""

    def set_obstacles(self, solid: Shape) -> None:
        self.solid = solid


@pytest.mark.parametrize(
    ("told", "x", "velocity"),
    [
        (Told.exact, -1.022911892777762, [0.4518059146631463, -0.14680959816953246, 0.15594344282687286]),
        (Told.wrong, -1.022911892777762, [0.3187137106044885, -0.08107826462913688, 0.13435972188237694]),
        (Told.untold, -1.022911892777762, [0.0, 0.0, 0.0]),
        (Told.late, -1.0492855049989782, [0.4518059146631463, -0.14680959816953246, 0.15594344282687286]),
    ],
)
def test_encounters_stay_those_of_earlier_results(told: Told, x: float, velocity: list[float]) -> None:
    """Figures of two versions are compared case by case: nothing may change the order of random draws."""
    encounter = maker().make(MovingTask("fr3", told, 0.5, True, 3), seed=1)
    heard = Heard()
    encounter.tell(heard, 330, encounter.start)  # type: ignore[arg-type]
    assert encounter.steps == 3100
    assert encounter.start[1] == pytest.approx(-1.0716390794156356)
    assert heard.solid.pose[0, 3] == pytest.approx(x)
    np.testing.assert_allclose(heard.solid.velocity, velocity, rtol=1e-12)


def test_what_fails_is_judged_in_the_same_encounter() -> None:
    """It stands still from the fault on, or goes on; right after a set, while it is under way."""
    exact = maker().make(MovingTask("fr3", Told.exact, 0.5, True, 3), seed=1)
    stands, goes_on = (
        maker().make(MovingTask("fr3", Told.dead, 0.5, True, 3, after), seed=1) for after in After
    )
    assert stands.fault is not None
    assert stands.fault == goes_on.fault
    assert exact.fault is None
    begins = stands.fault.begins
    assert round(begins / 1e-3) % 33 == 0
    assert 0.1 <= 0.75 - 0.5 * begins <= 0.6 + 0.5 * 0.017  # of its 0.75 m to the link, rounded to a set
    for encounter in (stands, goes_on):
        np.testing.assert_array_equal(exact.start, encounter.start)
        np.testing.assert_array_equal(exact.objects[0].pose_at(begins), encounter.objects[0].pose_at(begins))
    later = begins + 1.0
    np.testing.assert_array_equal(exact.objects[0].pose_at(later), goes_on.objects[0].pose_at(later))
    np.testing.assert_array_equal(stands.objects[0].pose_at(begins), stands.objects[0].pose_at(later))
    assert goes_on.steps == exact.steps
    assert stands.steps >= round((begins + STANDS) / 1e-3)
    with pytest.raises(ValueError, match="after is None and told dead"):
        MovingTask("fr3", Told.dead, 0.5, True, 3)
    with pytest.raises(ValueError, match="after is stands and told late"):
        MovingTask("fr3", Told.late, 0.5, True, 3, After.stands)


def test_robots_that_are_named_get_every_column() -> None:
    def columns(settings: MovingSettings, robot: str) -> set[tuple[Told, After | None]]:
        return {(task.told, task.after) for task in settings.tasks() if task.robot == robot}

    every = {(told, after) for told in Told for after in (After if told.fails else (None,))}
    assert len(every) == len(Told) + 5
    assert columns(MovingSettings(), "fr3") == every
    assert columns(MovingSettings(), "iiwa") == {(Told.exact, None), (Told.untold, None)}
    assert columns(MovingSettings(robots=("iiwa",)), "iiwa") == every
    with pytest.raises(ValueError, match="there is nothing to run"):
        MovingSettings(robots=())


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


def moving_row(**values: object) -> dict[str, object]:
    """Of an encounter without a contact."""
    return {
        **{"robot": "fr3", "told": "dead", "after": "goes_on", "speed": 0.5, "way_out": None, "said": None},
        **{"clearance_m": 0.1, "self_clearance_m": 0.1, "contact_speed": None, "contact_after_fault_s": None},
        **{"late_contact_speed": None, **values},
    }


def test_columns_say_what_is_promised_of_them() -> None:
    touched = {"clearance_m": -0.01, "contact_speed": 0.2, "contact_after_fault_s": 0.123, "way_out": True}
    cells = moving_table([moving_row(), moving_row(**touched, said="stale")])["fr3"]
    assert cells == {
        "dead goes_on 0.5": {
            **{"runs": 2, "contacts": 1, "with_way_out": 1, "self_contacts": 0, "contact_speeds": [0.2]},
            **{"late_contacts": 0, "said": 1, "contacts_after_fault_s": [0.12]},
        }
    }

    def kept(**values: object) -> bool:
        [(column, cell)] = moving_table([moving_row(**values)])["fr3"].items()
        return is_kept(column, cell)

    assert kept()
    assert kept(**touched)
    assert not kept(**touched, late_contact_speed=0.2)
    assert not kept(**touched, after="stands")
    assert not kept(**touched, told="exact", after=None)
    assert kept(**touched | {"way_out": False}, told="exact", after=None)
    assert not kept(told="exact", after=None, self_clearance_m=0.0)


def test_limits_that_a_fault_breaks_are_named() -> None:
    clean = {"clearance_m": 0.1, "self_clearance_m": 0.1, "before_contact": "", "case": "noise"}
    clean |= {"beyond": {}, "beyond_free": {}, "beyond_near": {}}

    def broken(**values: object) -> list[str]:
        [(case, cell)] = fault_table([clean, clean | values]).items()
        return broken_promises(case, cell)

    assert broken() == []
    assert broken(clearance_m=0.0) == ["contacts"]
    assert (
        broken(beyond={"position": (3, 0.0019), "velocity": (9, 1.2)}, beyond_near={"velocity": (9, 1.2)})
        == []
    )
    assert broken(beyond={"position": (3, 0.0021)}) == ["position"]
    assert broken(beyond={"commanded position": (1, 1e-5)}) == ["commanded position"]
    assert broken(beyond_free={"velocity": (1, 1.04)}) == []
    free = {"velocity": (1, 1.06), "torque rate": (1, 1.01)}
    assert broken(beyond_free=free) == ["velocity in free space", "torque rate in free space"]


@pytest.mark.parametrize(("case", "every", "period"), [("slow125Hz", 8, 1e-3), ("told250Hz", 4, 4e-3)])
def test_slow_calls_are_told_or_not(case: str, every: int, period: float) -> None:
    encounter = fault_encounter(maker(), case, 0, seed=0)
    q = encounter.start
    called = [k for k in range(20) if encounter.sense(k, q, q) is not None]
    assert called == list(range(0, 20, every))
    assert encounter.period == pytest.approx(period)


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
