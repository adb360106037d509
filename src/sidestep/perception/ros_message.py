"""ROS 2 messages about depth cameras, as values."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep.math.pose import pose_at
from sidestep.perception.camera_file import pinhole
from sidestep.perception.camera_record import CameraRecord
from sidestep.perception.image_file import read_depth_png

MILLIMETRE = 0.001  # [m] unit of encoding 16UC1 (REP 118)
_DTYPES = {"16UC1": np.uint16, "mono16": np.uint16, "32FC1": np.float32}
DEPTH_ENCODINGS = ("16UC1", "32FC1")  # mono16 is read where its topic is asked for
_QUANTISED = struct.Struct(
    "<iff"
)  # heads a compressedDepth image: kind, and A, B of 32FC1: depth = A / (value - B)


def time_of(message: Any, received: int) -> float:
    """The time [s] of a message's header; where that is 0, when the bag received it [ns]."""
    stamp = message.header.stamp
    return float(stamp.sec + stamp.nanosec * 1e-9) or received * 1e-9


def image_depth(message: Any, owner: str) -> npt.NDArray[Any]:
    """Depth (H, W), uint16 or float32 [m], of a `sensor_msgs/Image`.

    Raises:
        ValueError: another encoding, or fewer bytes than the size asks for; names the owner.
    """
    if message.encoding not in _DTYPES:
        raise ValueError(f"{owner} has encoding {message.encoding!r}, must be one of {', '.join(_DTYPES)}")
    dtype = np.dtype(_DTYPES[message.encoding]).newbyteorder(">" if message.is_bigendian else "<")
    height, width, step = int(message.height), int(message.width), int(message.step)
    if step < width * dtype.itemsize or len(message.data) < height * step:
        raise ValueError(
            f"{owner} has {len(message.data)} bytes in rows of {step}, must have {height} rows of at least "
            f"{width * dtype.itemsize}"
        )
    rows = message.data[: height * step].reshape(height, step)[:, : width * dtype.itemsize]
    depth = np.ascontiguousarray(rows).view(dtype)
    return depth.astype(dtype.newbyteorder("="), copy=False)


def compressed_depth(message: Any, owner: str) -> npt.NDArray[Any]:
    """Depth (H, W), uint16 or float32 [m], of a `sensor_msgs/CompressedImage` of the transport compressedDepth.

    Depth in float is stored as its quantised inverse; the nothing-seen value 0 becomes nan.

    Raises:
        ValueError: another format than PNG of 16UC1 or 32FC1, or no such content; names the owner.
    """
    encoding, _, transport = message.format.partition(";")
    if "compressedDepth" not in transport or "rvl" in transport.lower() or encoding not in DEPTH_ENCODINGS:
        allowed = " or ".join(f"'{name}; compressedDepth png'" for name in DEPTH_ENCODINGS)
        raise ValueError(f"{owner} has format {message.format!r}, must be {allowed}")
    content = message.data.tobytes()
    if len(content) <= _QUANTISED.size:
        raise ValueError(f"{owner} has {len(content)} bytes, must have a header and a PNG")
    try:
        values = read_depth_png(content[_QUANTISED.size :])
    except ValueError as error:
        raise ValueError(f"{owner}: {error}") from error
    if encoding == "16UC1":
        return values
    _, scale, shift = _QUANTISED.unpack_from(content)
    with np.errstate(divide="ignore"):
        depth = np.float32(scale) / (values.astype(np.float32) - np.float32(shift))
    return np.where(values == 0, np.float32(np.nan), depth)


def camera_record(
    message: Any, name: str, *, owner: str, rectified: bool, unit: float, **pose: Any
) -> CameraRecord:
    """The camera of a `sensor_msgs/CameraInfo`: K and the distortion d, or P alone of images that were rectified.

    plumb_bob is brown_conrady, and so is rational_polynomial where k4 to k6 are 0; equidistant is kannala_brandt. Where
    all coefficients are 0 the model is none.

    Args:
        message: the message.
        name: of the camera.
        owner: what an error calls the message.
        rectified: whether the distortion was taken out of the images.
        unit: of its images, see `CameraRecord`.
        pose: `pose` and `link` of the record.

    Raises:
        ValueError: another distortion model, or no calibration.
    """
    if not np.any(message.k):
        raise ValueError(f"{owner}: K is zero: the camera has no calibration")
    if message.binning_x > 1 or message.binning_y > 1 or message.roi.width or message.roi.height:
        raise ValueError(
            f"{owner}: binning {message.binning_x} x {message.binning_y} and a region of {message.roi.width} x "
            f"{message.roi.height} pixels; only whole images are read"
        )
    if rectified and np.any(message.d):
        fx, fy, cx, cy = pinhole(np.reshape(message.p, (3, 4))[:, :3], f"{owner}: P")
        return CameraRecord(name, int(message.width), int(message.height), fx, fy, cx, cy, unit=unit, **pose)
    fx, fy, cx, cy = pinhole(np.reshape(message.k, (3, 3)), owner)
    model, coefficients = _distortion(
        message.distortion_model, np.asarray(message.d, dtype=np.float64), owner
    )
    return CameraRecord(
        name, int(message.width), int(message.height), fx, fy, cx, cy, model, coefficients, unit=unit, **pose
    )


def _distortion(model: str, d: npt.NDArray[np.float64], owner: str) -> tuple[str, npt.NDArray[np.float64]]:
    """The name and coefficients (5,) of `CameraRecord`."""
    if not d.any():
        return "none", np.zeros(5)
    words = f"{owner}: distortion_model is {model!r} with d {d.tolist()}"
    if model == "plumb_bob" and len(d) in (4, 5):
        return "brown_conrady", np.append(d, np.zeros(5 - len(d)))
    if model == "rational_polynomial" and len(d) >= 5:
        if d[5:].any():
            raise ValueError(f"{words}; only with k4 to k6 zero: rectify the images")
        return "brown_conrady", d[:5]
    if model == "equidistant" and len(d) == 4:
        return "kannala_brandt", np.append(d, 0.0)
    raise ValueError(f"{words}, must be plumb_bob (5), rational_polynomial (8) or equidistant (4)")


def transform_matrix(transform: Any) -> npt.NDArray[np.float64]:
    """The pose (4, 4) of a `geometry_msgs/Transform`."""
    t, r = transform.translation, transform.rotation
    return pose_at([t.x, t.y, t.z], xyzw=[r.x, r.y, r.z, r.w])
