"""Cameras and depth images with all kinds of values, to be written and read back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sidestep.math.pose import about_axis
from sidestep.perception import CameraRecord, Frame

JOINTS = ("shoulder", "elbow")
START = 1_764_270_000.123456  # [s] a time of this century, where a double has steps of 2.4e-7 s


def pose(angle: float) -> np.ndarray:
    """A pose (4, 4) turned about a skew axis."""
    X = np.eye(4)
    X[:3, :3] = about_axis(np.array([0.36, 0.48, 0.8]), angle)
    X[:3, 3] = [0.1, -0.2, 1.0 / 3.0]
    return X


FRONT = CameraRecord(
    "front",
    32,
    24,
    30.25,
    31.5,
    15.7,
    11.3,
    "brown_conrady",
    np.array([0.1, -0.2, 1e-3, -2e-3, 0.05]),
    pose=pose(0.7),
)
HAND = CameraRecord(
    "hand",
    16,
    12,
    20.0,
    20.5,
    7.5,
    5.5,
    "kannala_brandt",
    np.array([0.1, 0.01, 1e-3, 1e-4, 0.0]),
    pose=pose(-1.9),
    link="wrist",
)


def whole_depth(camera: CameraRecord, seed: int) -> np.ndarray:
    """uint16 (H, W) with 0, 1 and 65535 among its values."""
    depth = np.random.default_rng(seed).integers(0, 65536, (camera.height, camera.width), dtype=np.uint16)
    depth[0, :3] = [0, 1, 65535]
    return depth


def metre_depth(camera: CameraRecord, seed: int) -> np.ndarray:
    """float32 (H, W) with nan, inf and 0 among its values."""
    depth = np.random.default_rng(seed).uniform(0.3, 5.0, (camera.height, camera.width)).astype(np.float32)
    depth[0, :3] = [np.nan, np.inf, 0.0]
    return depth


def frames(
    camera: CameraRecord, *, count: int = 3, start: float = START, metres: bool = False
) -> list[Frame]:
    """Images at 30 Hz, with q."""
    made = metre_depth if metres else whole_depth
    unit = 1.0 if metres else camera.unit
    return [
        Frame(camera.name, start + i / 30.0, made(camera, i), unit, q=np.array([0.1 * i, -1.0 / (i + 3.0)]))
        for i in range(count)
    ]


def assert_same_camera(read: CameraRecord, written: CameraRecord, *, pose_error: float = 0.0) -> None:
    """All attributes equal bit by bit, and the pose up to an error."""
    assert read.pose is not None
    assert written.pose is not None
    assert np.abs(read.pose - written.pose).max() <= pose_error
    same = replace(read, pose=None), replace(written, pose=None)
    for name in (
        "name",
        "width",
        "height",
        "fx",
        "fy",
        "cx",
        "cy",
        "distortion_model",
        "link",
        "unit",
        "pose",
    ):
        assert getattr(same[0], name) == getattr(same[1], name), name
    assert read.distortion.tolist() == written.distortion.tolist()


def assert_same_frame(read: Frame, written: Frame) -> None:
    """The image bit by bit, the time, the unit and q."""
    assert (read.camera, read.time, read.unit) == (written.camera, written.time, written.unit)
    assert read.depth.dtype == written.depth.dtype
    assert np.array_equal(read.depth, written.depth, equal_nan=written.depth.dtype.kind == "f")
    assert (read.q is None) == (written.q is None)
    if read.q is not None and written.q is not None:
        assert read.q.tolist() == written.q.tolist()
