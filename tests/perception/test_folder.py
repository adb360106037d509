"""Folders of depth images: written and read back, in other layouts, malformed."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from sidestep.perception import FolderRecording, FolderWriter, Frame, open_recording, read_depth_png
from support.depth_frames import (
    FRONT,
    HAND,
    JOINTS,
    assert_same_camera,
    assert_same_frame,
    frames,
    pose,
    whole_depth,
)

EASY = {
    "width": 32,
    "height": 24,
    "K": [[30.0, 0.0, 15.5], [0.0, 31.0, 11.5], [0.0, 0.0, 1.0]],
    "distortion": "none (rectified)",
    "depth_unit_m": 0.001,
    "T_base_camera": {"good": pose(0.3).tolist(), "coarse": pose(0.4).tolist()},
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three images numbered 0, 2 and 5, with two poses and a row of joints for each number."""
    (tmp_path / "camera.json").write_text(json.dumps(EASY))
    for number in (5, 0, 2):
        Image.fromarray(whole_depth(FRONT, number)).save(tmp_path / f"depth_{number}.png")
    rows = [f"{i},{0.1 * i!r},{-0.5 * i!r}" for i in range(6)]
    (tmp_path / "joints.csv").write_text("\n".join(["frame,shoulder,elbow", *rows]))
    return tmp_path


@pytest.mark.parametrize(("kind", "metres"), [("png", False), ("npy", False), ("png", True)])
def test_what_is_written_is_read_back_bit_by_bit(tmp_path: Path, kind: str, metres: bool) -> None:
    made = frames(FRONT, metres=metres)
    with FolderWriter(tmp_path / "new", [FRONT], joint_names=JOINTS, kind=kind) as writer:
        for frame in made:
            writer.add(frame)
    recording = open_recording(tmp_path / "new")
    assert isinstance(recording, FolderRecording)
    (camera,) = recording.cameras
    assert_same_camera(camera, FRONT, pose_error=1e-15)  # its rotation is made orthonormal when read
    assert (recording.joint_names, recording.times_known, len(recording)) == (JOINTS, True, 3)
    for read, written in zip(recording.frames(), made, strict=True):
        assert_same_frame(read, written)
    suffixes = {path.suffix for path in (tmp_path / "new").glob("depth_*")}
    assert suffixes == {".npy" if metres else f".{kind}"}


def test_two_cameras_have_a_folder_each_and_their_images_come_by_time(tmp_path: Path) -> None:
    made = [*frames(FRONT), *frames(HAND, start=1_764_270_000.13)]
    with FolderWriter(tmp_path, [FRONT, HAND], joint_names=JOINTS) as writer:
        for frame in made:
            writer.add(frame)
    recording = FolderRecording(tmp_path)
    for camera, written in zip(recording.cameras, [FRONT, HAND], strict=True):
        assert_same_camera(camera, written, pose_error=1e-15)
    for read, expected in zip(recording.frames(), sorted(made, key=lambda frame: frame.time), strict=True):
        assert_same_frame(read, expected)
    assert [frame.camera for frame in FolderRecording(tmp_path, camera="hand").frames()] == ["hand"] * 3
    with pytest.raises(ValueError, match="has no camera 'left'; it has front, hand"):
        FolderRecording(tmp_path, camera="left")


def test_poses_and_colours_of_frames_are_kept(tmp_path: Path) -> None:
    colour = np.arange(2 * 3 * 3, dtype=np.uint8).reshape(2, 3, 3)
    made = [
        Frame("front", 0.5, whole_depth(FRONT, 0), 0.001, pose=pose(1.1), colour=colour),
        Frame("front", 0.6, whole_depth(FRONT, 1), 0.001),
    ]
    with FolderWriter(tmp_path, [FRONT]) as writer:
        for frame in made:
            writer.add(frame)
    first, second = FolderRecording(tmp_path, colour=True).frames()
    assert first.pose is not None
    assert first.colour is not None
    assert first.pose.tolist() == pose(1.1).tolist()
    assert first.colour.tolist() == colour.tolist()
    assert (second.pose, second.colour, second.q) == (None, None, None)
    assert next(FolderRecording(tmp_path).frames()).colour is None


def test_joints_between_two_states_are_linear_and_unknown_outside_and_in_gaps(tmp_path: Path) -> None:
    with FolderWriter(tmp_path, [FRONT], joint_names=JOINTS) as writer:
        for time, q in ((1.0, [0.0, 2.0]), (1.1, [1.0, 0.0]), (2.0, [3.0, 4.0])):
            writer.add_state(time, q)
        for time in (0.9, 1.025, 1.1, 1.5, 2.0, 2.1):
            writer.add(Frame("front", time, whole_depth(FRONT, 0), 0.001))
    q = [frame.q for frame in FolderRecording(tmp_path).frames()]
    assert q[1] == pytest.approx(np.array([0.25, 1.5]), abs=1e-12)  # rounding of 1.025 - 1.0
    assert [values if values is None else values.tolist() for values in (q[0], *q[2:])] == [
        None,
        [1.0, 0.0],
        None,
        [3.0, 4.0],
        None,
    ]
    bridged = [frame.q for frame in FolderRecording(tmp_path, max_joint_gap=1.0).frames()]
    assert bridged[3] == pytest.approx(np.array([1.0 + 2.0 * 0.4 / 0.9, 4.0 * 0.4 / 0.9]), abs=1e-12)


def test_images_without_times_have_those_of_their_numbers(folder: Path) -> None:
    recording = FolderRecording(folder, pose="good")
    made = list(recording.frames())
    assert not recording.times_known
    assert [frame.time for frame in made] == [0.0, 2 / 30, 5 / 30]
    assert [frame.time for frame in FolderRecording(folder, pose="good", rate=10.0).frames()] == [
        0.0,
        0.2,
        0.5,
    ]
    for frame, number in zip(made, (0, 2, 5), strict=True):
        assert np.array_equal(frame.depth, whole_depth(FRONT, number))
        assert frame.q is not None
        assert frame.q.tolist() == [0.1 * number, -0.5 * number]


def test_a_camera_file_with_a_matrix_and_poses_by_name(folder: Path) -> None:
    (camera,) = FolderRecording(folder, pose="coarse").cameras
    assert (camera.name, camera.width, camera.height) == (folder.name, 32, 24)
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (30.0, 31.0, 15.5, 11.5)
    assert camera.pose == pytest.approx(pose(0.4), abs=1e-15)
    (camera,) = FolderRecording(folder, pose=pose(2.0)).cameras
    assert camera.pose == pytest.approx(pose(2.0), abs=1e-15)
    with pytest.raises(ValueError, match="has several poses, choose one: 'good', 'coarse'"):
        FolderRecording(folder)
    with pytest.raises(ValueError, match="no pose 'best'; it has 'good', 'coarse'"):
        FolderRecording(folder, pose="best")


def test_a_pose_in_single_precision_becomes_a_rotation(folder: Path) -> None:
    rough = pose(0.3).astype(np.float32)
    rough[3] = [1e-8, 0.0, 0.0, 1.0]
    (folder / "camera.json").write_text(json.dumps(EASY | {"T_base_camera": rough.tolist()}))
    (camera,) = FolderRecording(folder).cameras
    assert camera.pose is not None
    assert np.abs(camera.pose[:3, :3] @ camera.pose[:3, :3].T - np.eye(3)).max() < 1e-14  # double precision
    assert camera.pose == pytest.approx(pose(0.3), abs=1e-6)  # single precision


def test_joints_by_row(folder: Path) -> None:
    (folder / "joints.csv").write_text("shoulder\n0.5\n0.25\n-1\n")
    q = [frame.q for frame in FolderRecording(folder, pose="good").frames()]
    assert [values.tolist() for values in q if values is not None] == [[0.5], [0.25], [-1.0]]
    (folder / "joints.csv").write_text("shoulder\n0.5\n")
    with pytest.raises(ValueError, match="has 1 rows for 3 images"):
        FolderRecording(folder, pose="good")


@pytest.mark.parametrize(
    ("file", "content", "words"),
    [
        ("camera.json", "{", "camera.json' is not JSON"),
        ("camera.json", "[]", "holds list, must be an object"),
        ("camera.json", json.dumps({"K": EASY["K"], "width": 32}), "has no 'height'; it has K, width"),
        ("camera.json", json.dumps(EASY | {"K": [[1.0]]}), r"K is \[\[1.0\]\], must be"),
        (
            "camera.json",
            json.dumps(EASY | {"distortion": "plumb_bob"}),
            "distortion is 'plumb_bob', must be 'none'",
        ),
        ("camera.json", json.dumps({"name": "a", "width": 3}), "has no 'height'"),
        ("joints.csv", "frame\n1\n", "has no joint; its columns are frame"),
        ("joints.csv", "frame,a\n1,x\n", "row 0: a is 'x', must be a finite number"),
        ("joints.csv", "frame,a\n1\n", "row 0: not as many cells as the 2 titles"),
        ("frames.csv", "file\na.png\n", "frames.csv' has no column time; it has file"),
        ("frames.csv", "file,time\ndepth_0.png,nan\n", "row 0: time is 'nan', must be a finite number"),
    ],
)
def test_a_malformed_file_is_named(folder: Path, file: str, content: str, words: str) -> None:
    (folder / file).write_text(content)
    with pytest.raises(ValueError, match=words):
        FolderRecording(folder, pose="good")


def test_an_image_that_is_none_is_named(folder: Path) -> None:
    recording = FolderRecording(folder, pose="good")
    Image.fromarray(whole_depth(HAND, 0)).save(folder / "depth_0.png")
    with pytest.raises(ValueError, match=r"depth_0.png' has shape \(12, 16\), must be \(24, 32\)"):
        next(recording.frames())
    (folder / "depth_0.png").write_bytes(b"version https://git-lfs.github.com/spec/v1\n")
    with pytest.raises(ValueError, match=r"depth_0.png' is a Git LFS pointer"):
        next(recording.frames())
    (folder / "depth_0.png").unlink()
    with pytest.raises(FileNotFoundError, match=r"depth_0.png' does not exist"):
        next(recording.frames())


def test_a_png_of_eight_bits_or_cut_off_is_refused(folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "eight.png"
    Image.fromarray(np.zeros((2, 2), np.uint8)).save(path)
    with pytest.raises(ValueError, match=r"eight.png' has pixels of mode 'L', must be one 16-bit channel"):
        read_depth_png(path)
    content = (folder / "depth_0.png").read_bytes()
    assert np.array_equal(read_depth_png(content), whole_depth(FRONT, 0))
    for broken in (content[: len(content) // 2], b"", b"no image"):
        with pytest.raises(ValueError, match="cannot be read as PNG"):
            read_depth_png(broken)


def test_an_array_of_another_kind_is_refused(folder: Path) -> None:
    (folder / "depth_0.png").unlink()
    recordings = []
    for array in (np.zeros((24, 32), np.int64), np.array([{}], dtype=object)):
        np.save(folder / "depth_0.npy", array)
        recordings.append(FolderRecording(folder, pose="good"))
        with pytest.raises(ValueError, match=r"depth_0.npy' (is int64, must be|cannot be read)"):
            next(recordings[-1].frames())


def test_a_folder_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="does not exist"):
        open_recording(tmp_path / "missing")
    with pytest.raises(ValueError, match="says nothing of a camera"):
        open_recording(tmp_path)
    (tmp_path / "camera.json").write_text(json.dumps(EASY))
    with pytest.raises(ValueError, match="has no depth images"):
        open_recording(tmp_path, pose="good")
    with pytest.raises(ValueError, match=r"rate is 0\.0 Hz"):
        FolderRecording(tmp_path, rate=0.0)


def test_the_writer_refuses_what_it_could_not_read_back(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="must be one or more of different names"):
        FolderWriter(tmp_path / "a", [FRONT, FRONT])
    with pytest.raises(ValueError, match="must be the name of a folder"):
        FolderWriter(tmp_path / "b", [FRONT, replace(HAND, name="../hand")])
    with pytest.raises(ValueError, match="kind is 'tiff', must be 'png' or 'npy'"):
        FolderWriter(tmp_path / "c", [FRONT], kind="tiff")  # type: ignore[arg-type]
    writer = FolderWriter(tmp_path / "d", [FRONT], joint_names=JOINTS)
    with pytest.raises(FileExistsError, match="not empty"):
        FolderWriter(tmp_path / "d", [FRONT])
    with pytest.raises(ValueError, match="frame is of camera 'hand', must be of front"):
        writer.add(frames(HAND)[0])
    with pytest.raises(ValueError, match=r"has shape \(12, 16\), must be \(24, 32\)"):
        writer.add(Frame("front", 0.0, whole_depth(HAND, 0), 0.001))
    with pytest.raises(ValueError, match=r"has unit 0.0001 m, must be 0.001"):
        writer.add(Frame("front", 0.0, whole_depth(FRONT, 0), 0.0001))
    with pytest.raises(ValueError, match="must be 2 finite positions: shoulder, elbow"):
        writer.add_state(0.0, [1.0])
