"""ROS 2 bags: written and read back, what others write into them, malformed."""

from __future__ import annotations

import io
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from sidestep.perception import BagRecording, BagWriter, Frame, open_recording
from support.depth_frames import FRONT, HAND, JOINTS, assert_same_camera, assert_same_frame, frames, pose

STORE = get_typestore(Stores.ROS2_HUMBLE)
POSE_ERROR = 1e-15  # of a rotation that was a quaternion meanwhile


class Bag:
    """A bag whose messages are written one by one."""

    def __init__(self, path: Path) -> None:
        self.writer = Writer(path, version=9, storage_plugin=StoragePlugin.SQLITE3)
        self.writer.open()
        self.connections: dict[str, Any] = {}

    def add(self, topic: str, kind: str, *, time: float = 1.0, stamped: bool = True, **values: Any) -> None:
        """A message stamped with a time [s], which the bag receives 0.25 s later."""
        sec, nanosec = divmod(round(1e9 * time), 1_000_000_000) if stamped else (0, 0)
        stamp = STORE.types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
        header = STORE.types["std_msgs/msg/Header"](stamp=stamp, frame_id=values.pop("frame_id", "optical"))
        message = STORE.types[f"sensor_msgs/msg/{kind}"](header=header, **values)
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(topic, message.__msgtype__, typestore=STORE)
        content = STORE.serialize_cdr(message, message.__msgtype__)
        self.writer.write(self.connections[topic], round(1e9 * (time + 0.25)), content)

    def info(self, topic: str, *, width: int = 4, height: int = 3, **changed: Any) -> None:
        region = STORE.types["sensor_msgs/msg/RegionOfInterest"](
            x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
        )
        K = np.array([4.0, 0.0, 1.5, 0.0, 4.25, 1.0, 0.0, 0.0, 1.0])
        values = dict(
            width=width, height=height, distortion_model="plumb_bob", d=np.zeros(5), k=K, r=np.eye(3).ravel()
        )
        values |= dict(p=np.eye(3, 4).ravel(), binning_x=0, binning_y=0, roi=region)
        self.add(topic, "CameraInfo", **(values | changed))

    def image(
        self, topic: str, depth: np.ndarray, *, padding: int = 0, big: bool = False, **changed: Any
    ) -> None:
        rows = depth.astype(depth.dtype.newbyteorder(">" if big else "<")).view(np.uint8)
        data = np.pad(rows, ((0, 0), (0, padding)), constant_values=255)
        values = dict(height=depth.shape[0], width=depth.shape[1], step=data.shape[1], data=data.ravel())
        values |= dict(encoding="16UC1" if depth.dtype.kind == "u" else "32FC1", is_bigendian=int(big))
        self.add(topic, "Image", **(values | changed))

    def joints(self, time: float, **positions: float) -> None:
        q = np.array(list(positions.values()))
        empty = np.zeros(0)
        self.add(
            "/joint_states",
            "JointState",
            time=time,
            name=list(positions),
            position=q,
            velocity=empty,
            effort=empty,
        )


@pytest.fixture
def bag(tmp_path: Path) -> Bag:
    return Bag(tmp_path / "bag")


def read(bag: Bag, **options: Any) -> list[Frame]:
    bag.writer.close()
    return list(BagRecording(bag.writer.path, **options).frames())


DEPTH = np.arange(12, dtype=np.uint16).reshape(3, 4) * 5000


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
@pytest.mark.parametrize("metres", [False, True])
def test_what_is_written_is_read_back_bit_by_bit(tmp_path: Path, storage: Any, metres: bool) -> None:
    made = [*frames(FRONT, metres=metres), *frames(HAND, start=1_764_270_000.2)]
    with BagWriter(tmp_path / "bag", [FRONT, HAND], joint_names=JOINTS, storage=storage) as writer:
        for frame in made:
            writer.add(frame)
    recording = open_recording(tmp_path / "bag")
    for camera, written in zip(recording.cameras, [FRONT, HAND], strict=True):
        assert_same_camera(replace(camera, pose=written.pose), replace(written, link=""))
        assert camera.pose is None
    assert (recording.joint_names, recording.times_known) == (JOINTS, True)
    for frame, written in zip(recording.frames(), made, strict=True):
        assert_same_frame(frame, written)
    (file,) = (tmp_path / "bag").glob("*.mcap" if storage == "mcap" else "*.db3")
    assert [frame.time for frame in open_recording(file).frames()] == [frame.time for frame in made]


def test_poses_are_those_of_tf_static(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag", [FRONT, HAND]) as writer:
        writer.add(frames(HAND)[0])
        writer.add(frames(FRONT)[0])
    (front,) = BagRecording(tmp_path / "bag", topics=["/front/depth/image"], base="world").cameras
    assert_same_camera(front, FRONT, pose_error=POSE_ERROR)
    (hand,) = BagRecording(tmp_path / "bag", topics=["/hand/depth/image"], base="wrist", link="wrist").cameras
    assert_same_camera(hand, HAND, pose_error=POSE_ERROR)
    (inverse,) = BagRecording(
        tmp_path / "bag", topics=["/front/depth/image"], base="/front_depth_optical_frame"
    ).cameras
    assert inverse.pose == pytest.approx(np.eye(4), abs=0.0)
    with pytest.raises(
        ValueError, match="'hand_depth_optical_frame' to 'world', which is joined to front_depth"
    ):
        BagRecording(tmp_path / "bag", base="world")


def test_depth_of_another_unit_is_written_in_metres(tmp_path: Path) -> None:
    camera = replace(FRONT, unit=0.00025)
    frame = frames(camera)[0]
    with BagWriter(tmp_path / "bag", [camera]) as writer:
        writer.add(frame)
    (back,) = BagRecording(tmp_path / "bag").frames()
    assert back.unit == 1.0
    assert np.array_equal(back.depth, frame.metres)


@pytest.mark.parametrize("big", [False, True])
@pytest.mark.parametrize("dtype", [np.uint16, np.float32])
def test_rows_may_be_padded_and_of_either_byte_order(bag: Bag, big: bool, dtype: Any) -> None:
    bag.info("/front/depth/camera_info")
    bag.image("/front/depth/image_raw", DEPTH.astype(dtype), padding=6, big=big)
    (frame,) = read(bag)
    assert (frame.camera, frame.time, frame.unit) == ("front", 1.0, 0.001 if dtype is np.uint16 else 1.0)
    assert frame.depth.dtype == dtype
    assert frame.depth.tolist() == DEPTH.tolist()


def packed(depth: np.ndarray, header: bytes = bytes(12)) -> np.ndarray:
    stream = io.BytesIO()
    Image.fromarray(depth).save(stream, "PNG")
    return np.frombuffer(header + stream.getvalue(), np.uint8)


def test_compressed_depth_is_read(bag: Bag) -> None:
    topic = "/front/depth/image/compressedDepth"
    bag.info("/front/depth/camera_info")
    bag.add(topic, "CompressedImage", format="16UC1; compressedDepth png", data=packed(DEPTH))
    # Depth in float as its quantised inverse: value = A / depth + B, in whole numbers.
    metres = np.linspace(0.5, 4.0, 12).reshape(3, 4)
    A, B = 10100.0, 1.0 - 10100.0 / 10.0
    values = np.floor(A / metres + B).astype(int)
    header = struct.pack("<iff", 0, A, B)
    values[0, 0] = 0
    data = packed(values.astype(np.uint16), header)
    bag.add(topic, "CompressedImage", time=2.0, format="32FC1; compressedDepth png", data=data)
    whole, quantised = read(bag)
    assert whole.camera == "front"
    assert np.array_equal(whole.depth, DEPTH)
    assert np.isnan(quantised.depth[0, 0])
    step = metres**2 / A  # of the depth where the value grows by one
    error = np.abs(quantised.depth - metres)[1:]
    assert (error <= 1.01 * step[1:]).all()
    assert error.max() > 1e-5  # it was quantised


def test_the_same_images_in_another_transport_are_read_once(bag: Bag) -> None:
    bag.info("/front/depth/camera_info")
    bag.image("/front/depth/image", DEPTH)
    bag.add(
        "/front/depth/image/compressedDepth",
        "CompressedImage",
        format="16UC1; compressedDepth",
        data=packed(DEPTH),
    )
    bag.image("/front/color/image", DEPTH[:, :3], encoding="rgb8", width=2, step=6)
    assert [frame.camera for frame in read(bag)] == ["front"]


def test_an_image_without_a_stamp_has_the_time_of_its_arrival(bag: Bag) -> None:
    bag.info("/front/depth/camera_info")
    bag.image("/front/depth/image", DEPTH, stamped=False)
    assert [frame.time for frame in read(bag)] == [1.25]


def test_joints_are_taken_by_name_at_the_capture(bag: Bag) -> None:
    bag.info("/front/depth/camera_info")
    bag.joints(0.95, a=0.0, b=10.0, finger=0.1)
    bag.joints(0.97, finger=0.2)
    bag.joints(1.15, b=30.0, a=1.0)
    for time in (0.9, 1.0, 1.15):
        bag.image("/front/depth/image", DEPTH, time=time)
    before, between, at = read(bag, joints=["b", "a"])
    assert before.q is None
    assert between.q == pytest.approx(np.array([15.0, 0.25]), abs=1e-12)  # rounding of 0.05 / 0.2
    assert at.q is not None
    assert at.q.tolist() == [30.0, 1.0]
    assert BagRecording(bag.writer.path).joint_names == ("a", "b", "finger")
    with pytest.raises(ValueError, match="no joint state with positions of all of b, c; it has a, b, finger"):
        BagRecording(bag.writer.path, joints=["b", "c"])


@pytest.mark.parametrize(
    ("model", "d", "expected", "kept"),
    [
        ("plumb_bob", [0.1, 0.2, 0.3, 0.4, 0.5], "brown_conrady", [0.1, 0.2, 0.3, 0.4, 0.5]),
        ("plumb_bob", [], "none", [0.0] * 5),
        (
            "rational_polynomial",
            [0.1, 0.2, 0.3, 0.4, 0.5, 0, 0, 0],
            "brown_conrady",
            [0.1, 0.2, 0.3, 0.4, 0.5],
        ),
        ("equidistant", [0.1, 0.2, 0.3, 0.4], "kannala_brandt", [0.1, 0.2, 0.3, 0.4, 0.0]),
        ("", [0.0] * 5, "none", [0.0] * 5),
    ],
)
def test_distortion_by_its_name_in_ros(
    bag: Bag, model: str, d: list[float], expected: str, kept: list[float]
) -> None:
    bag.info("/front/depth/camera_info", distortion_model=model, d=np.array(d))
    bag.image("/front/depth/image", DEPTH)
    bag.writer.close()
    (camera,) = BagRecording(bag.writer.path).cameras
    assert (camera.distortion_model, camera.distortion.tolist()) == (expected, kept)
    assert (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy) == (
        4,
        3,
        4.0,
        4.25,
        1.5,
        1.0,
    )


def test_rectified_images_have_the_intrinsics_p(bag: Bag) -> None:
    P = np.array([5.0, 0.0, 2.5, 0.0, 0.0, 5.25, 2.0, 0.0, 0.0, 0.0, 1.0, 0.0])
    for camera, name in (("a", "image_rect_raw"), ("b", "image_raw")):
        bag.info(f"/{camera}/depth/camera_info", d=np.full(5, 0.1), p=P)
        bag.image(f"/{camera}/depth/{name}", DEPTH)
    bag.writer.close()
    rectified, raw = BagRecording(bag.writer.path).cameras
    assert (rectified.fx, rectified.fy, rectified.cx, rectified.cy) == (5.0, 5.25, 2.5, 2.0)
    assert (rectified.distortion_model, raw.distortion_model) == ("none", "brown_conrady")
    assert (raw.fx, raw.fy, raw.cx, raw.cy) == (4.0, 4.25, 1.5, 1.0)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"distortion_model": "rational_polynomial", "d": np.full(8, 0.1)}, "only with k4 to k6 zero"),
        (
            {"distortion_model": "fisheye", "d": np.ones(4)},
            "distortion_model is 'fisheye' with d .* must be plumb_bob",
        ),
        ({"k": np.zeros(9)}, "K is zero: the camera has no calibration"),
        ({"binning_x": 2}, "binning 2 x 0 and a region of 0 x 0 pixels"),
    ],
)
def test_a_camera_that_cannot_be_used_is_named(bag: Bag, changed: dict[str, Any], words: str) -> None:
    bag.info("/front/depth/camera_info", **changed)
    bag.image("/front/depth/image", DEPTH)
    bag.writer.close()
    with pytest.raises(ValueError, match=f"bag', /front/depth/camera_info: .*{words}"):
        BagRecording(bag.writer.path)


def test_names_of_cameras_tell_them_apart(bag: Bag) -> None:
    topics = [
        "/cam/cam/depth/image_rect_raw",
        "/left/aligned_depth_to_color/image_raw",
        "/left/depth/image",
        "/depth/i",
    ]
    for topic in topics:
        bag.info(topic.rpartition("/")[0] + "/camera_info")
        bag.image(topic, DEPTH)
    assert [frame.camera for frame in read(bag)] == [
        "cam/cam",
        "left/aligned_depth_to_color",
        "left/depth",
        "depth",
    ]


def test_a_bag_that_says_too_little_is_refused(bag: Bag, tmp_path: Path) -> None:
    bag.image("/front/depth/image", DEPTH)
    bag.image("/front/color/image", DEPTH[:, :3], encoding="rgb8", width=2, step=6)
    bag.info("/color/camera_info")
    bag.writer.close()
    with pytest.raises(
        ValueError, match=r"no message at /front/depth/camera_info, .*; camera infos: /color/camera_info"
    ):
        BagRecording(bag.writer.path)
    with pytest.raises(
        ValueError, match=r"no images at \['/a'\]; it has /front/color/image, /front/depth/image"
    ):
        BagRecording(bag.writer.path, topics=["/a"])
    other = Bag(tmp_path / "colour")
    other.image("/front/image", DEPTH[:, :3], encoding="rgb8", width=2, step=6)
    other.writer.close()
    with pytest.raises(ValueError, match=r"no depth images .*; its images: /front/image \(rgb8\)"):
        BagRecording(other.writer.path)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"encoding": "rgb8"}, "has encoding 'rgb8', must be one of 16UC1, mono16, 32FC1"),
        ({"step": 7}, "has 24 bytes in rows of 7, must have 3 rows of at least 8"),
        ({"data": np.zeros(5, np.uint8)}, "has 5 bytes in rows of 8"),
        ({"height": 2}, r"has shape \(2, 4\), must be \(3, 4\) as its camera"),
    ],
)
def test_a_malformed_image_is_named(bag: Bag, changed: dict[str, Any], words: str) -> None:
    bag.info("/front/depth/camera_info")
    bag.image("/front/depth/image", DEPTH, time=1.5, **changed)
    with pytest.raises(ValueError, match=f"image of /front/depth/image at 1.500000 s {words}"):
        read(bag, topics=["/front/depth/image"])


@pytest.mark.parametrize(
    ("form", "data", "words"),
    [
        ("16UC1; compressedDepth rvl", packed(DEPTH), "has format '16UC1; compressedDepth rvl', must be"),
        ("16UC1; compressedDepth png", np.zeros(12, np.uint8), "has 12 bytes, must have a header and a PNG"),
        ("16UC1; compressedDepth png", packed(DEPTH)[5:], "cannot be read as PNG"),
    ],
)
def test_a_malformed_compressed_image_is_named(bag: Bag, form: str, data: np.ndarray, words: str) -> None:
    bag.info("/front/depth/camera_info")
    bag.add("/front/depth/image/compressedDepth", "CompressedImage", format=form, data=data)
    with pytest.raises(ValueError, match=words):
        read(bag)


def test_what_is_no_bag_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="does not exist"):
        BagRecording(tmp_path / "missing")
    with pytest.raises(FileNotFoundError, match="does not exist"):
        open_recording(tmp_path / "missing.mcap")
    for name, words in {
        "a.bag": r"has suffix '.bag', must be .mcap or .db3",
        "a.mcap": "cannot be read",
    }.items():
        (tmp_path / name).write_bytes(b"no bag")
        with pytest.raises(ValueError, match=words):
            open_recording(tmp_path / name)
    with pytest.raises(ValueError, match=r"holds bag files but no metadata.yaml"):
        open_recording(tmp_path)
    with pytest.raises(TypeError, match=r"must be the name of a frame of /tf_static"):
        open_recording(tmp_path / "a.mcap", pose=pose(0.1))


def test_the_writer_refuses_what_a_bag_cannot_hold(tmp_path: Path) -> None:
    with pytest.raises(
        ValueError, match="has distortion 'inverse_brown_conrady', ROS has none, brown_conrady"
    ):
        BagWriter(tmp_path / "a", [replace(FRONT, distortion_model="inverse_brown_conrady")])
    with pytest.raises(ValueError, match="camera is called 'my camera', a topic has"):
        BagWriter(tmp_path / "a", [replace(FRONT, name="my camera")])
    with pytest.raises(ValueError, match="storage is 'zip', must be 'mcap' or 'sqlite3'"):
        BagWriter(tmp_path / "a", [FRONT], storage="zip")  # type: ignore[arg-type]
    with BagWriter(tmp_path / "a", [FRONT], joint_names=JOINTS) as writer:
        with pytest.raises(FileExistsError, match="nothing is overwritten"):
            BagWriter(tmp_path / "a", [FRONT])
        with pytest.raises(ValueError, match="frame is of camera 'hand', must be of front"):
            writer.add(frames(HAND)[0])
        with pytest.raises(ValueError, match=r"time is -1.0 s, a bag has times from 0"):
            writer.add(Frame("front", -1.0, frames(FRONT)[0].depth, 0.001))
        with pytest.raises(ValueError, match="must be 2 finite positions"):
            writer.add_state(0.0, [1.0, np.nan])
