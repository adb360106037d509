"""`sidestep camera`: exit codes, figures and files."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from sidestep import Arm, cli, perception
from sidestep.perception import Frame, open_recording
from support.camera_scene import CAMERA, HOLES, START, WIDTH, configurations, write_recording

Invoke = Callable[..., int]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recordings")
    write_recording(folder / "scene", Arm.load("fr3"), count=6, lost=[2])
    write_recording(folder / "without", Arm.load("fr3"), count=2, joints=False)
    return folder


@pytest.fixture
def invoke(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, scene: Path) -> Invoke:
    monkeypatch.chdir(tmp_path)
    for name in ("scene", "without"):
        (tmp_path / name).symlink_to(scene / name)

    def call(*arguments: str) -> int:
        monkeypatch.setattr(sys, "argv", ["sidestep", "camera", *arguments])
        with pytest.raises(SystemExit) as caught:
            cli.main()
        return int(caught.value.code or 0)

    return call


def test_view_writes_a_picture_and_its_figures(invoke: Invoke, capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        invoke("view", "scene", "--robot", "fr3", "--picture", "out.png", "--image", "3", "--json", "-") == 0
    )
    document = json.loads(capsys.readouterr().out)
    assert (document["camera"], document["image"], document["used"]) == ("front", 3, True)
    assert document["time_s"] == START + 4 / 30.0  # the third was lost
    assert document["question"] is None
    assert document["through_share"] == 0.0
    assert document["pixels"]["nothing"] == HOLES * CAMERA.height
    assert 700 < document["pixels"]["arm"] < 1000
    assert document["cells"]["seen"] > 13_500  # the wall, in cells that grow with the distance from the arm
    with Image.open("out.png") as image:
        assert image.width > 1000


def test_view_without_an_arm_shows_the_depth(invoke: Invoke, capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke("view", "without", "--picture", "depth.png") == 0
    assert "depth.png" in capsys.readouterr().out
    assert invoke("view", "without", "--picture", "depth.png", "--image", "2") == 2
    assert "--image is 2; allowed: 0 to 1" in capsys.readouterr().err


def test_errors_of_the_pose_reach_the_camera(invoke: Invoke, capsys: pytest.CaptureFixture[str]) -> None:
    def arm_pixels(*options: str) -> int:
        arguments = ("view", "scene", "--robot", "fr3", "--picture", "out.png", "--image", "0", "--json", "-")
        assert invoke(*arguments, *options) == 0
        return int(json.loads(capsys.readouterr().out)["pixels"]["arm"])

    plain = arm_pixels()
    assert arm_pixels("--far", "1.6") == plain  # the wall alone is beyond
    # The ball is 0.3 m from the arm: one grown by 0.45 m takes most of its 322 pixels as well.
    assert arm_pixels("--pose-error-mm", "450") > plain + 200
    assert arm_pixels("--pose-error-deg", "20") > plain + 200


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("view", "scene"), "give --robot NAME, or --picture FILE"),
        (("view", "--robot", "fr3"), "give either a recording or --realsense"),
        (("view", "scene", "--realsense", "--robot", "fr3"), "give either a recording or --realsense"),
        (("view", "nowhere", "--robot", "fr3"), "'nowhere' does not exist"),
        (("view", "scene", "--robot", "fr3", "--picture", "a.txt"), "--picture is a.txt; allowed"),
        (("view", "scene", "--robot", "fr3", "--json", "-"), "--json and --image go with --picture"),
        (("view", "without", "--robot", "fr3", "--picture", "a.png"), "no joint states"),
        (("view", "scene", "--robot", "ur5", "--picture", "a.png"), "of the arm; it has fr3_joint1"),
        (("view", "without", "--robot", "fr3", "--picture", "a.png", "--q", "elbow=1"), "no joint 'elbow'"),
        (("view", "scene", "--robot", "fr3", "--picture", "a.png", "--pose", "left"), "no pose 'left'"),
        (("report", "scene", "--out", "a.txt"), "a page ends with .html"),
        (("record", "scene"), "give SOURCE DEST, or --realsense DEST"),
    ],
)
def test_bad_input_is_refused(
    invoke: Invoke, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], words: str
) -> None:
    assert invoke(*arguments) == 2
    captured = capsys.readouterr()
    assert words in captured.err
    assert captured.err.startswith("error: ")


def test_an_arm_that_stands_needs_no_joint_states(invoke: Invoke) -> None:
    assert (
        invoke(
            "report", "without", "--robot", "fr3", "--q", "fr3_joint1=0", "-o", "a.html", "--json", "a.json"
        )
        == 0
    )
    (camera,) = json.loads(Path("a.json").read_text())["cameras"]
    assert camera["arm_pixels"]["p50"] > 700


def test_report_has_rates_lost_images_and_the_arm(invoke: Invoke, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ("report", "scene", "--robot", "fr3", "--out", "page.html", "--pictures", "1", "--json", "-")
    assert invoke(*arguments) == 0
    document = json.loads(capsys.readouterr().out)
    (camera,) = document["cameras"]
    assert (document["recording"], document["images"], camera["lost"]) == ("scene", 5, 1)
    assert camera["rate_hz"] == pytest.approx(30.0)
    assert camera["holes"]["max"] == pytest.approx(HOLES / WIDTH)
    assert Path("page.html").read_text(encoding="utf-8").count("data:image/png") == 6 + 1


def test_record_keeps_a_recording(invoke: Invoke, capsys: pytest.CaptureFixture[str]) -> None:
    moved = np.array(CAMERA.pose)
    moved[:3, 3] += [0.1, 0.2, 0.3]
    np.savetxt("pose.txt", moved)
    assert invoke("record", "scene", "copy", "--images", "3", "--pose", "pose.txt", "--json", "-") == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["images"], document["lost"]) == (3, 0)
    assert document["duration_s"] == pytest.approx(3 / 30.0)  # one between them was lost
    copy, source = open_recording("copy"), open_recording("scene")
    assert copy.joint_names == source.joint_names == tuple(document["joints"])
    assert np.allclose(copy.cameras[0].pose, moved, atol=1e-12)
    pairs = list(zip(copy.frames(), source.frames(), strict=False))
    assert len(pairs) == 3
    for one, other in pairs:
        assert (one.time, one.unit) == (other.time, other.unit)
        assert np.array_equal(one.depth, other.depth)
        assert np.array_equal(one.q, other.q)
    assert invoke("record", "scene", "copy") == 2
    assert "is not empty" in capsys.readouterr().err


@pytest.mark.parametrize("form", ["mcap", "sqlite3"])
def test_record_writes_a_bag_that_can_be_played(
    invoke: Invoke, capsys: pytest.CaptureFixture[str], form: str
) -> None:
    assert invoke("record", "scene", "bag", "--format", form, "-q") == 0
    assert capsys.readouterr().out == ""
    assert (
        invoke("report", "bag", "--pose", "world", "--robot", "fr3", "-o", "a.html", "--json", "a.json") == 0
    )
    (camera,) = json.loads(Path("a.json").read_text())["cameras"]
    assert (camera["images"], camera["lost"], camera["used"]) == (5, 1, 5)
    assert camera["arm_pixels"]["p50"] > 700
    np.savetxt("pose.txt", CAMERA.pose)  # the same, told by hand
    assert (
        invoke("report", "bag", "--pose", "pose.txt", "--robot", "fr3", "-o", "a.html", "--json", "b.json")
        == 0
    )
    (told,) = json.loads(Path("b.json").read_text())["cameras"]
    assert told["arm_pixels"] == camera["arm_pixels"]


def test_record_ends_after_a_time(invoke: Invoke, capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke("record", "scene", "short", "--seconds", "0.05", "--json", "-") == 0
    assert json.loads(capsys.readouterr().out)["images"] == 2
    capsys.readouterr()


class _FakeRealSense:
    """Stands for a live camera: images without end, until somebody interrupts it after the fifth."""

    times_known, joint_names, lost = True, (), 2

    def __init__(self, name: str, *, serial: str | None, pose: np.ndarray | None) -> None:
        self.cameras = [replace(CAMERA, name=name, pose=pose)]
        self.serial, self.is_open = serial, False

    def __enter__(self) -> _FakeRealSense:
        self.is_open = True
        return self

    def __exit__(self, *_: object) -> None:
        self.is_open = False

    def frames(self) -> Iterator[Frame]:
        for n in range(5):
            assert self.is_open
            depth = np.full((CAMERA.height, CAMERA.width), 1000 + n, dtype=np.uint16)
            yield Frame("camera", 5.0 + n / 30.0, depth, 0.001)
        raise KeyboardInterrupt


@pytest.mark.parametrize(("options", "count"), [((), 5), (("--images", "2"), 2)])
def test_a_live_camera_is_recorded_until_it_is_interrupted(
    invoke: Invoke,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    options: tuple[str, ...],
    count: int,
) -> None:
    monkeypatch.setattr(perception, "RealSense", _FakeRealSense)
    assert invoke("record", "--realsense", "live", "--json", "-", *options) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["images"], document["lost"], document["joints"]) == (count, 2, [])
    read = list(open_recording("live").frames())
    assert [int(frame.depth[0, 0]) for frame in read] == [1000 + n for n in range(count)]
    assert [frame.time for frame in read] == [5.0 + n / 30.0 for n in range(count)]


@dataclass
class _FakeCheck:
    """Stands for the core's `CameraCheck`: keeps what it is given, and finds what it is told."""

    found: SimpleNamespace

    def __call__(self, arm: Arm, camera: Any) -> _FakeCheck:
        self.camera, self.states, self.images = camera, [], []
        return self

    def add_state(self, q: np.ndarray, *, time: float) -> None:
        self.states.append((time, q.copy()))

    def add(self, depth: np.ndarray, *, time: float, unit: float | None) -> None:
        self.images.append((time, depth.dtype, unit))

    def solve(self) -> SimpleNamespace:
        return self.found


def correction(**others: Any) -> SimpleNamespace:
    told = {
        "pose": np.array(CAMERA.pose),
        "translation": 0.002,
        "rotation": 0.001,
        "clock_offset": -0.001,
        "rms_before": 0.004,
        "rms_after": 0.003,
        "overshoot": 0.01,
        "translation_spread": 0.0005,
        "rotation_spread": 0.0004,
        "clock_spread": 0.0003,
        "images": 5,
        "points": 4000,
        "question": "",
    }
    return SimpleNamespace(**(told | others))


@pytest.mark.parametrize(
    ("others", "options", "code", "words"),
    [
        ({}, (), 0, "the camera is where it is said to be"),
        ({"translation": 0.013}, (), 1, "13.0 mm away, more than 5.0 mm"),
        ({"translation": 0.013}, ("--pose-error-mm", "15"), 0, "the camera is where it is said to be"),
        ({"rotation": np.deg2rad(0.55)}, (), 1, "turned by 0.55°, more than 0.29°"),
        ({"clock_offset": -0.03}, (), 1, "its clock off by -30.0 ms, more than 5.0 ms"),
        ({"question": "the arm does not move"}, (), 1, "the arm does not move"),
    ],
)
def test_check_says_whether_the_camera_is_where_it_is_told(
    invoke: Invoke,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    others: dict[str, Any],
    options: tuple[str, ...],
    code: int,
    words: str,
) -> None:
    fake = _FakeCheck(correction(**others))
    monkeypatch.setattr(perception, "CameraCheck", fake, raising=False)
    arguments = ("check", "scene", "--robot", "fr3", "--json", "a.json", "--out", "pose.txt")
    assert invoke(*arguments, *options) == code
    assert words in capsys.readouterr().out
    (document,) = json.loads(Path("a.json").read_text())["cameras"]
    assert document["as_told"] is (code == 0)
    assert document["translation_m"] == fake.found.translation
    assert np.allclose(np.loadtxt("pose.txt"), CAMERA.pose, atol=1e-8)
    expected = configurations(Arm.load("fr3"), 6)
    assert [time for time, _ in fake.states] == [time for time, _, _ in fake.images]
    for (_, q), n in zip(fake.states, (0, 1, 3, 4, 5), strict=True):
        assert np.array_equal(q, expected[n])
    assert fake.images[0] == (START, np.uint16, 0.001)


def test_check_finds_a_camera_that_is_moved(invoke: Invoke) -> None:
    moved = np.array(CAMERA.pose)
    moved[:3, 3] += 0.03 * moved[:3, 0]
    np.savetxt("moved.txt", moved)
    assert invoke("check", "scene", "--robot", "fr3", "--pose", "moved.txt", "--json", "a.json") == 1
    (document,) = json.loads(Path("a.json").read_text())["cameras"]
    assert document["translation_m"] > 0.01
    assert document["rms_after_m"] < document["rms_before_m"]
