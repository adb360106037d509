"""Pixels of a recorded arm: counted against its mask and its meshes, drawn and measured."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import binary_dilation

from sidestep.bench import CameraRecordingSettings, recording_table, run_camera_recording
from sidestep.bench.camera_recording import RecordedArm, count_pixels, drawn_meshes
from sidestep.bench.link_surfaces import LinkSurfaces
from sidestep.bench.moving import maker_and_judge
from sidestep.math.pose import look_at, moved
from sidestep.perception import DepthCamera, PixelLabel

ARM, OBSTACLE = int(PixelLabel.arm), int(PixelLabel.obstacle)
POSE = look_at((1.6, 0.3, 0.7), (0.2, 0.0, 0.4))
SIZE = {"width": 160, "height": 120, "fx": 140.0, "fy": 140.0, "cx": 79.5, "cy": 59.5}
WALL = 2.5  # [m] depth behind the arm


def _camera() -> DepthCamera:
    return DepthCamera("front", width=160, height=120, fx=140.0, fy=140.0, cx=79.5, cy=59.5, pose=POSE)


def test_drawn_meshes_cover_what_projects_from_the_surface() -> None:
    robot = maker_and_judge("panda")[0].robot
    q, camera = robot.neutral, _camera()
    drawn = drawn_meshes(robot, q, camera)
    around = binary_dilation(drawn, np.ones((3, 3)))
    surfaces = LinkSurfaces(robot, "mesh")
    for X_WL, points in zip(surfaces.poses(q), surfaces._points, strict=True):
        p_C = (moved(points, X_WL) - POSE[:3, 3]) @ POSE[:3, :3]
        u, v = np.floor(camera.project(p_C) + 0.5).astype(int).T
        assert around[v, u].all()  # a corner of the outline may round to the pixel beside it
    assert 0.02 < drawn.mean() < 0.3


def test_pixels_are_counted_by_what_they_are_and_became() -> None:
    mask, drawn = np.zeros((2, 60), dtype=bool), np.zeros((2, 60), dtype=bool)
    mask[0, :4], drawn[0, 1:5] = True, True
    distance = np.full((2, 60), np.inf)
    distance[0, :3], distance[0, 4], distance[0, 30:34] = 0.01, 0.02, 0.045
    points = np.zeros((2, 60, 3))
    points[..., 0] = np.arange(60)
    labels = np.full((2, 60), OBSTACLE, dtype=np.uint8)
    labels[0, 0], labels[0, 30:32], labels[0, 40], labels[1, 6] = ARM, ARM, ARM, ARM
    image = RecordedArm(mask, drawn, distance, points, np.ones((2, 60), dtype=bool))
    row = count_pixels(image, labels, lambda p: 0.01 * p[:, 0])
    assert (row["mask"], row["mask_at_model"], row["left_over"]) == (4, 3, 3)
    assert (row["left_over_at_model"], row["left_over_apart"]) == (2, 1)
    assert (row["drawn"], row["drawn_left_over"]) == (3, 3)
    assert (row["world_near"], row["lost_near"], row["lost_far"]) == (4, 2, 1)
    assert row["max_lost"] == pytest.approx(0.4)
    assert (row["fringe_near"], row["fringe_lost"]) == (0, 1)
    both = recording_table([{"way": "given", "image": "0", **row}, {"way": "given", "image": "1", **row}])
    assert both["given"]["left_over_share"] == pytest.approx(4 / 6)
    assert (both["given"]["images"], both["given"]["max_lost"]) == (2, pytest.approx(0.4))


def _folder(tmp_path: Path, *, mask: bool = True) -> Path:
    """The Panda as its meshes' points show it, before a wall."""
    robot = maker_and_judge("panda")[0].robot
    q, camera, surfaces = robot.neutral, _camera(), LinkSurfaces(robot, "mesh")
    depth = np.full((120, 160), WALL)
    for X_WL, points in zip(surfaces.poses(q), surfaces._points, strict=True):
        p_C = (moved(points, X_WL) - POSE[:3, 3]) @ POSE[:3, :3]
        u, v = np.floor(camera.project(p_C) + 0.5).astype(int).T
        np.minimum.at(depth, (v, u), p_C[:, 2])
    Image.fromarray(np.round(1000.0 * depth).astype(np.uint16)).save(tmp_path / "depth_3.png")
    if mask:
        Image.fromarray(np.where(depth < WALL, 255, 0).astype(np.uint8)).save(tmp_path / "arm_mask_3.png")
    told = {**SIZE, "pose": POSE.tolist(), "name": "front"}
    (tmp_path / "camera.json").write_text(json.dumps(told))
    with (tmp_path / "joints.csv").open("w", newline="") as file:
        csv.writer(file).writerows([["frame", *robot.coordinate_names], [3, *q.tolist()]])
    return tmp_path


def test_a_recorded_arm_is_taken_out(tmp_path: Path) -> None:
    settings = CameraRecordingSettings(_folder(tmp_path), "panda", draws=1)
    table = recording_table(run_camera_recording(settings))
    given = table["given"]
    assert given["mask"] > 500
    assert given["mask_at_model"] == given["mask"]
    assert given["left_over"] == 0
    assert table["off"]["left_over"] == 0
    assert given["lost_far"] == given["world_near"] == 0  # the wall is far behind
    assert set(table) == {"given", "given, exact", "off"} | {
        f"{pose}, grown {growth} cm" for pose in ("given", "off") for growth in (5, 10)
    }


def test_a_recording_without_masks_or_joints_is_refused(tmp_path: Path) -> None:
    folder = _folder(tmp_path, mask=False)
    with pytest.raises(FileNotFoundError, match=r"there is no mask '.*arm_mask_3.png'"):
        run_camera_recording(CameraRecordingSettings(folder, "panda"))
    with pytest.raises(
        ValueError, match="the recording has no joint 'fr3_joint1' of fr3; it has panda_joint1"
    ):
        run_camera_recording(CameraRecordingSettings(folder, "fr3"))
