"""Values of depth images and cameras: what they keep and what they refuse."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sidestep.perception import CameraRecord, Frame

DEPTH = np.array([[0, 1500], [65535, 20]], dtype=np.uint16)


def test_metres_are_the_unit_times_the_depth() -> None:
    metres = Frame("front", 1.0, DEPTH, 0.0001).metres
    assert metres.dtype == np.float32
    assert metres == pytest.approx(np.array([[0.0, 0.15], [6.5535, 0.002]]), rel=1e-6)  # single precision


def test_depth_in_metres_is_kept_as_it_is() -> None:
    depth = np.array([[np.nan, 0.5], [np.inf, 0.0]], dtype=np.float32)
    frame = Frame("front", 0.0, depth, 1.0)
    assert np.array_equal(frame.metres, depth, equal_nan=True)
    assert Frame("front", 0.0, depth.astype(np.float64), 1.0).depth.dtype == np.float32


def test_a_frame_cannot_be_written_to_but_its_source_can() -> None:
    depth, q = DEPTH.copy(), np.array([0.1, 0.2])
    frame = Frame("front", 0.0, depth, 0.001, q=q, pose=np.eye(4))
    assert frame.q is not None
    assert frame.pose is not None
    for value in (frame.depth, frame.q, frame.pose):
        with pytest.raises(ValueError, match="read-only"):
            value[0] = 1
    depth[0, 0] = q[0] = 7
    assert frame.q.tolist() == [0.1, 0.2]
    assert np.shares_memory(frame.depth, depth)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"camera": ""}, "camera is '', must be the name"),
        ({"time": np.nan}, "time is nan s, must be finite"),
        ({"depth": DEPTH[0]}, r"depth has shape \(2,\), must be \(H, W\)"),
        ({"depth": DEPTH[:0]}, r"depth has shape \(0, 2\), must be \(H, W\)"),
        ({"depth": DEPTH.astype(np.int32)}, "depth is int32, must be uint16, float32 or float64"),
        ({"unit": 0.0}, "unit is 0.0 m, must be positive"),
        ({"depth": DEPTH.astype(np.float32)}, "unit is 0.001 m, must be 1 for depth in metres"),
        ({"q": [0.1, np.inf]}, r"q is \[0.1, inf\], must be finite"),
        ({"colour": np.zeros((2, 2), np.uint8)}, r"colour is uint8 \(2, 2\), must be uint8 \(h, w, 3\)"),
        ({"pose": 2.0 * np.eye(4)}, "frame of camera 'front': pose is not a rigid transform"),
    ],
)
def test_a_bad_frame_is_refused(changed: dict[str, Any], words: str) -> None:
    good: dict[str, Any] = {"camera": "front", "time": 0.0, "depth": DEPTH, "unit": 0.001}
    Frame(**good)
    with pytest.raises((TypeError, ValueError), match=words):
        Frame(**(good | changed))


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"name": ""}, "name is '', must be the name"),
        ({"width": 0}, "camera 'front': size is 0 x 48 pixels, must be positive"),
        ({"fx": -1.0}, "fx is -1.0, must be positive"),
        ({"unit": np.inf}, "unit is inf, must be positive and finite"),
        ({"cy": np.nan}, "cx, cy are 31.5, nan, must be finite"),
        (
            {"distortion_model": "fisheye"},
            "distortion_model is 'fisheye', must be one of none, brown_conrady",
        ),
        ({"distortion": np.ones(4)}, "must be five finite numbers"),
        ({"distortion": np.ones(5)}, "must be zero for model 'none'"),
        ({"pose": np.zeros((4, 4))}, "camera 'front': pose is not a rigid transform"),
    ],
)
def test_a_bad_camera_is_refused(changed: dict[str, Any], words: str) -> None:
    good: dict[str, Any] = dict(name="front", width=64, height=48, fx=60.0, fy=61.0, cx=31.5, cy=23.5)
    assert CameraRecord(**good).distortion.tolist() == [0.0] * 5
    with pytest.raises(ValueError, match=words):
        CameraRecord(**(good | changed))
