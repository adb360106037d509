"""Folders of published data sets, in small: text files of poses and intrinsics beside images in 0.1 mm."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from sidestep.perception import FolderRecording
from support.depth_frames import pose

K = np.array([[477.5, 0.0, 314.25], [0.0, 478.5, 245.75], [0.0, 0.0, 1.0]])


def save(path: Path, value: int) -> None:
    Image.fromarray(np.full((480, 640), value, np.uint16)).save(path)


def text(matrix: np.ndarray) -> str:
    return "\n".join("\t".join(f"{x: .8e}" for x in row) for row in matrix) + "\n"


def cam_info(poses: dict[int, np.ndarray], X_CD: np.ndarray) -> str:
    blocks = {
        "Environment: shelf": "",
        "Color camera intrinsic matrix": text(2.0 * K),
        "Depth camera intrinsic matrix": text(K),
        "Depth-to-color camera extrinsic matrix": text(X_CD),
    }
    blocks |= {
        f"Camera-to-world extrinsic matrix (camera pose) for frame-{i:06d}": text(X) for i, X in poses.items()
    }
    return "\n".join(f"# {title}\n{block}" for title, block in blocks.items())


def test_an_eye_in_hand_has_the_pose_of_its_depth_camera_in_each_image(tmp_path: Path) -> None:
    X_CD = pose(0.01)
    poses = {0: pose(0.5), 1: pose(1.5)}
    (tmp_path / "cam.info.txt").write_text(cam_info(poses, X_CD))
    for number in (0, 1):
        save(tmp_path / f"depth_{number:02d}.png", 5000 + number)
    save(tmp_path / "depth_registered_01.png", 1)  # of the colour camera: not read
    recording = FolderRecording(tmp_path)
    (camera,) = recording.cameras
    assert (camera.fx, camera.fy, camera.cx, camera.cy, camera.unit) == (477.5, 478.5, 314.25, 245.75, 1e-4)
    made = list(recording.frames())
    assert [(frame.time, int(frame.depth[0, 0])) for frame in made] == [(0.0, 5000), (1 / 30, 5001)]
    for frame, X_WC in zip(made, poses.values(), strict=True):
        assert frame.pose == pytest.approx(X_WC @ X_CD, abs=1e-7)  # nine digits in the file


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (
            lambda content: content.replace("frame-000001", "frame-000007"),
            r"no pose for 'depth_01.png'; it has",
        ),
        (
            lambda content: content.replace("Depth-to-color", "Other"),
            "has no 'Depth-to-color camera extrinsic",
        ),
        (lambda content: content.replace("4.77500000e+02", "x"), "Depth camera intrinsic matrix: could not"),
        (lambda content: content.replace(" 4.77500000e+02", ""), "a row of 3 numbers below one of 2"),
    ],
)
def test_a_malformed_file_of_poses_is_named(tmp_path: Path, edit, words: str) -> None:
    content = cam_info({0: pose(0.5), 1: pose(1.5)}, pose(0.01))
    (tmp_path / "cam.info.txt").write_text(edit(content))
    for number in (0, 1):
        save(tmp_path / f"depth_{number:02d}.png", 5000)
    with pytest.raises(ValueError, match=words):
        FolderRecording(tmp_path)


def test_bins_have_intrinsics_as_text(tmp_path: Path) -> None:
    (tmp_path / "clutter_camera-intrinsics.txt").write_text(text(K))
    (tmp_path / "two_camera-1.intrinsics.txt").write_text(text(np.diag([2.0, 2.0, 1.0]) @ K))
    (tmp_path / "two_camera-1.pose.txt").write_text(text(pose(0.9)))
    values = {"clutter_background": 10, "clutter_image": 11, "two_background_1": 20, "two_input_1": 21}
    for name, value in values.items():
        save(tmp_path / f"{name}_depth.png", value)
    recording = FolderRecording(tmp_path)
    clutter, two = recording.cameras
    assert (clutter.name, clutter.fx, clutter.unit, clutter.pose) == ("clutter", 477.5, 1e-4, None)
    assert (two.name, two.fx) == ("two_1", 955.0)
    assert two.pose == pytest.approx(pose(0.9), abs=1e-7)  # nine digits in the file
    images = [(frame.camera, frame.time, int(frame.depth[0, 0])) for frame in recording.frames()]
    assert images == [
        ("clutter", 0.0, 10),
        ("two_1", 0.0, 20),
        ("clutter", 1 / 30, 11),
        ("two_1", 1 / 30, 21),
    ]
    with pytest.raises(ValueError, match="pose is 'left', but the cameras of folder"):
        FolderRecording(tmp_path, pose="left")
    (tmp_path / "clutter_camera-intrinsics.txt").write_text("1 2 3\n")
    with pytest.raises(
        ValueError, match=r"clutter_camera-intrinsics.txt': K is \[\[1.0, 2.0, 3.0\]\], must be"
    ):
        FolderRecording(tmp_path)
