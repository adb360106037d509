"""Recordings played through perception, against the scene they were rendered from."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sidestep import Arm
from sidestep.perception import FolderWriter, Frame, PixelLabel, open_recording
from sidestep.perception.playback import Playback, joint_order
from support.camera_scene import BALL, CAMERA, HEIGHT, HOLES, RADIUS, rendered, write_recording


@pytest.fixture(scope="module")
def arm() -> Arm:
    return Arm.load("fr3")


def test_labels_say_what_was_rendered(tmp_path: Path, arm: Arm) -> None:
    written = write_recording(tmp_path / "scene", arm)
    playback = Playback(open_recording(tmp_path / "scene"), arm)
    count = 0
    for played, q in zip(playback.play(), written, strict=True):
        assert np.array_equal(played.q, q)
        assert played.report.used
        stages = playback.stages("front")
        _, seen = rendered(arm, q)
        arm_pixels = stages.labels[seen == 1]
        assert len(arm_pixels) > 700  # a twenty-fifth of the image
        assert (arm_pixels == int(PixelLabel.arm)).all()
        assert (stages.labels[seen == 2] == int(PixelLabel.obstacle)).all()
        wall = stages.labels[seen == 3]
        assert np.isin(wall, [int(PixelLabel.obstacle), int(PixelLabel.edge)]).all()
        assert stages.pixels()["nothing"] == HOLES * HEIGHT
        assert sum(stages.pixels().values()) == seen.size
        count += 1
    assert (count, playback.skipped) == (5, 0)


def test_cells_are_where_the_ball_is_and_what_the_arm_hides_is_remembered(tmp_path: Path, arm: Arm) -> None:
    write_recording(tmp_path / "scene", arm)
    playback = Playback(open_recording(tmp_path / "scene"), arm)
    reports = [played.report for played in playback.play()]
    stages = playback.stages("front")
    assert stages.cells()["unseen"] == 0
    assert stages.cells()["seen"] + stages.cells()["hidden"] + stages.cells()["remembered"] == len(
        stages.centres
    )
    assert stages.cells()["hidden"] + stages.cells()["remembered"] == reports[-1].remembered > 0
    before_wall = stages.centres[:, 0] > -0.5
    distance = np.linalg.norm(stages.centres[before_wall] - BALL, axis=1)
    assert len(distance) > 30
    # A cell of the ball holds points of its surface: its middle is at most half a diagonal of 20 mm away.
    assert np.abs(distance - RADIUS).max() < 0.0174
    hidden = stages.kinds == 2
    assert (stages.ages[hidden] > 0.0).all()
    assert (stages.ages[stages.kinds == 0] == 0.0).all()
    assert stages.age_words("seen") == ""
    assert stages.age_words("hidden").endswith(f"up to {stages.ages[hidden].max():.2g} s")


def test_joints_are_taken_by_name(tmp_path: Path, arm: Arm) -> None:
    names = list(arm.robot.coordinate_names)
    q = arm.neutral + 0.1 * np.arange(arm.num_coordinates)
    depth = np.round(1000.0 * rendered(arm, q)[0]).astype(np.uint16)
    with FolderWriter(tmp_path / "turned", [CAMERA], joint_names=[*names[::-1], "gripper"]) as writer:
        writer.add(Frame("front", 1.0, depth, 0.001, q=np.append(q[::-1], 0.04)))
    (played,) = Playback(open_recording(tmp_path / "turned"), arm).play()
    assert np.array_equal(played.q, q)


def test_missing_joints_are_named(tmp_path: Path, arm: Arm) -> None:
    with pytest.raises(ValueError, match="no joint elbow of the arm; it has shoulder, wrist"):
        joint_order(["shoulder", "wrist"], ["wrist", "elbow"])
    write_recording(tmp_path / "without", arm, joints=False)
    with pytest.raises(ValueError, match=r"no joint states.*joints\.csv.*fr3_joint1"):
        Playback(open_recording(tmp_path / "without"), arm)
    standing = Playback(open_recording(tmp_path / "without"), arm, q=arm.neutral)
    assert all(np.array_equal(played.q, arm.neutral) for played in standing.play())


def test_an_image_without_a_state_is_skipped(tmp_path: Path, arm: Arm) -> None:
    names = list(arm.robot.coordinate_names)
    depth = np.full((CAMERA.height, CAMERA.width), 1500, dtype=np.uint16)
    with FolderWriter(tmp_path / "gap", [CAMERA], joint_names=names) as writer:
        for time in (0.0, 0.1, 2.0):
            writer.add(Frame("front", time, depth, 0.001, q=None if time == 0.1 else arm.neutral))
    playback = Playback(open_recording(tmp_path / "gap"), arm)
    assert [played.frame.time for played in playback.play()] == [0.0, 2.0]
    assert playback.skipped == 1


def test_cameras_are_as_told(tmp_path: Path, arm: Arm) -> None:
    write_recording(tmp_path / "scene", arm, count=1)
    moved = np.array(CAMERA.pose)
    moved[0, 3] += 0.01
    options = {"translation_error": 0.02, "far": 1.5, "clock_error": None}
    playback = Playback(
        open_recording(tmp_path / "scene"), arm, records=[replace(CAMERA, pose=moved)], camera_options=options
    )
    (camera,) = playback.perception.cameras
    assert np.array_equal(camera.pose, moved)
    assert (camera.translation_error, camera.far, camera.clock_error) == (0.02, 1.5, 0.005)
    list(playback.play())
    assert playback.stages("front").pixels()["outside"] > 0.8 * CAMERA.width * CAMERA.height  # the wall
