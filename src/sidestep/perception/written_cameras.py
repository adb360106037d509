"""What is asked of the cameras, frames and states that a writer gets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from sidestep.perception.camera_record import CameraRecord
from sidestep.perception.frame import Frame


def by_name(cameras: Sequence[CameraRecord]) -> dict[str, CameraRecord]:
    """The cameras of a recording by name.

    Raises:
        ValueError: there are none, or two of one name.
    """
    names = [camera.name for camera in cameras]
    if not names or len(set(names)) < len(names):
        raise ValueError(f"cameras are {names}, must be one or more of different names")
    return dict(zip(names, cameras, strict=True))


def camera_of(frame: Frame, cameras: Mapping[str, CameraRecord]) -> CameraRecord:
    """The camera of a frame.

    Raises:
        ValueError: it is none of these, or has images of another size.
    """
    camera = cameras.get(frame.camera)
    if camera is None:
        raise ValueError(f"frame is of camera {frame.camera!r}, must be of {', '.join(cameras)}")
    size = (camera.height, camera.width)
    if frame.depth.shape != size:
        raise ValueError(f"frame of camera '{camera.name}' has shape {frame.depth.shape}, must be {size}")
    return camera


def positions_of(q: npt.ArrayLike, joint_names: Sequence[str]) -> npt.NDArray[np.float64]:
    """Joint positions (n,) of n joints.

    Raises:
        ValueError: their number is another, or one is not finite.
    """
    values = np.asarray(q, dtype=np.float64)
    if values.shape != (len(joint_names),) or not np.isfinite(values).all():
        raise ValueError(
            f"q is {values.tolist()}, must be {len(joint_names)} finite positions: {', '.join(joint_names)}"
        )
    return values
