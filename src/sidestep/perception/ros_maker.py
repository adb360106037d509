"""ROS 2 messages about depth cameras, made from values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sidestep.math.pose import pose_vector
from sidestep.perception.camera_record import CameraRecord
from sidestep.perception.frame import Frame
from sidestep.perception.ros_message import MILLIMETRE

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

MODELS = {"none": "plumb_bob", "brown_conrady": "plumb_bob", "kannala_brandt": "equidistant"}  # of distortion


class RosMaker:
    """Makes messages of the types of a ROS 2 release."""

    def __init__(self, store: Typestore) -> None:
        self._types: Any = store.types

    def image(self, frame: Frame) -> Any:
        """A `sensor_msgs/Image`: 16UC1 of depth in millimetres, else 32FC1."""
        whole = frame.depth.dtype == np.uint16 and frame.unit == MILLIMETRE
        depth = np.ascontiguousarray(frame.depth if whole else frame.metres)
        return self._types["sensor_msgs/msg/Image"](
            header=self._header(frame.time, optical_frame(frame.camera)),
            height=depth.shape[0],
            width=depth.shape[1],
            encoding="16UC1" if whole else "32FC1",
            is_bigendian=0,
            step=depth.strides[0],
            data=depth.astype(depth.dtype.newbyteorder("<"), copy=False).view(np.uint8).ravel(),
        )

    def camera_info(self, camera: CameraRecord, time: float) -> Any:
        """A `sensor_msgs/CameraInfo`."""
        K = np.array([[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]])
        region = self._types["sensor_msgs/msg/RegionOfInterest"](
            x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
        )
        return self._types["sensor_msgs/msg/CameraInfo"](
            header=self._header(time, optical_frame(camera.name)),
            height=camera.height,
            width=camera.width,
            distortion_model=MODELS[camera.distortion_model],
            d=camera.distortion[: 4 if camera.distortion_model == "kannala_brandt" else 5].copy(),
            k=K.ravel(),
            r=np.eye(3).ravel(),
            p=np.hstack([K, np.zeros((3, 1))]).ravel(),
            binning_x=0,
            binning_y=0,
            roi=region,
        )

    def joint_state(self, names: Sequence[str], q: npt.NDArray[np.float64], *, time: float) -> Any:
        """A `sensor_msgs/JointState` of positions."""
        return self._types["sensor_msgs/msg/JointState"](
            header=self._header(time, ""),
            name=list(names),
            position=q,
            velocity=np.zeros(0),
            effort=np.zeros(0),
        )

    def poses(self, cameras: Sequence[CameraRecord], base: str, *, time: float) -> Any:
        """A `tf2_msgs/TFMessage` of the cameras that have a pose, in their link or in `base`."""
        transforms = [
            self._types["geometry_msgs/msg/TransformStamped"](
                header=self._header(time, camera.link or base),
                child_frame_id=optical_frame(camera.name),
                transform=self._transform(camera.pose),
            )
            for camera in cameras
            if camera.pose is not None
        ]
        return self._types["tf2_msgs/msg/TFMessage"](transforms=transforms)

    def _transform(self, pose: npt.NDArray[np.float64]) -> Any:
        x, y, z, qw, qx, qy, qz = pose_vector(pose).tolist()
        return self._types["geometry_msgs/msg/Transform"](
            translation=self._types["geometry_msgs/msg/Vector3"](x=x, y=y, z=z),
            rotation=self._types["geometry_msgs/msg/Quaternion"](x=qx, y=qy, z=qz, w=qw),
        )

    def _header(self, time: float, frame: str) -> Any:
        sec, nanosec = stamp(time)
        made = self._types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
        return self._types["std_msgs/msg/Header"](stamp=made, frame_id=frame)


def optical_frame(camera: str) -> str:
    """The name of a camera's frame."""
    return f"{camera}_depth_optical_frame"


def stamp(time: float) -> tuple[int, int]:
    """Seconds and nanoseconds of a time [s], from its whole part on, so that times of this century keep their bits.

    Raises:
        ValueError: it is negative, or does not fit in 32 bits.
    """
    if not 0.0 <= time < 2.0**31:
        raise ValueError(f"time is {time} s, a bag has times from 0 to 2^31 s")
    sec = math.floor(time)
    nanosec = round((time - sec) * 1e9)
    return (sec, nanosec) if nanosec < 1_000_000_000 else (sec + 1, 0)
