"""Depth images into ROS 2 bags."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from sidestep.math.pose import pose_vector
from sidestep.perception.bag import CAMERA_INFO, IMAGE, JOINT_STATE, TRANSFORMS
from sidestep.perception.camera_record import CameraRecord
from sidestep.perception.frame import Frame
from sidestep.perception.ros_message import MILLIMETRE
from sidestep.perception.written_cameras import by_name, camera_of, positions_of

_VERSION: Literal[9] = 9  # of the bag's metadata: that of ROS 2 Jazzy
_NAME = re.compile(r"[A-Za-z]\w*(?:/[A-Za-z]\w*)*", re.ASCII)  # what a topic may hold
_MODELS = {"none": "plumb_bob", "brown_conrady": "plumb_bob", "kannala_brandt": "equidistant"}


class BagWriter:
    """Writes the bag that `BagRecording` reads, as MCAP or SQLite.

    Camera `front` is written at /front/depth/image and /front/depth/camera_info, q at /joint_states, the cameras' poses
    once at /tf_static, in frame `base` or their link. Depth of unit 1 mm is 16UC1, any other 32FC1 in metres (uint16
    times unit, rounded to float32). Colour and the poses of single frames are not written.
    """

    def __init__(
        self,
        path: str | Path,
        cameras: Sequence[CameraRecord],
        *,
        joint_names: Sequence[str] = (),
        base: str = "world",
        storage: Literal["mcap", "sqlite3"] = "mcap",
    ) -> None:
        """Makes the bag and writes the cameras' poses.

        Args:
            path: the bag's folder; must not exist.
            cameras: whose frames come.
            joint_names: the joints, in the order of q; empty: q is not written.
            base: frame of the poses of cameras that stand in the world.
            storage: of the bag.

        Raises:
            FileExistsError: the folder exists.
            ValueError: there are no cameras or two of one name, a name or a distortion that ROS does not
                have, or another storage.
        """
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore

        self.path = Path(path)
        self._cameras = by_name(cameras)
        if storage not in ("mcap", "sqlite3"):
            raise ValueError(f"storage is {storage!r}, must be 'mcap' or 'sqlite3'")
        for camera in cameras:
            if not _NAME.fullmatch(camera.name):
                raise ValueError(
                    f"camera is called {camera.name!r}, a topic has letters, digits, _ and / alone"
                )
            if camera.distortion_model not in _MODELS:
                raise ValueError(
                    f"camera '{camera.name}' has distortion {camera.distortion_model!r}, ROS has {', '.join(_MODELS)}"
                )
        if self.path.exists():
            raise FileExistsError(f"bag '{self.path}' exists, nothing is overwritten")
        self.joint_names, self._base = tuple(joint_names), base
        self._store = get_typestore(Stores.ROS2_JAZZY)
        self._types = self._store.types
        plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
        self._writer = Writer(self.path, version=_VERSION, storage_plugin=plugin)
        self._writer.open()
        self._connections: dict[str, Any] = {}
        self._poses_written = False

    def add(self, frame: Frame) -> None:
        """Writes the image of a frame, its camera's description, and its q as a state at its time.

        Raises:
            ValueError: the frame is of no camera given or of another size, q of another length, or the time negative.
        """
        camera = camera_of(frame, self._cameras)
        if not self._poses_written:
            self._write_poses(frame.time)
        whole = frame.depth.dtype == np.uint16 and frame.unit == MILLIMETRE
        depth = np.ascontiguousarray(frame.depth if whole else frame.metres)
        header = self._header(frame.time, _optical_frame(camera))
        image = self._types[IMAGE](
            header=header,
            height=camera.height,
            width=camera.width,
            encoding="16UC1" if whole else "32FC1",
            is_bigendian=0,
            step=depth.strides[0],
            data=depth.astype(depth.dtype.newbyteorder("<"), copy=False).view(np.uint8).ravel(),
        )
        self._write(f"/{camera.name}/depth/camera_info", self._info(camera, header), frame.time)
        if frame.q is not None and self.joint_names:
            self.add_state(frame.time, frame.q)
        self._write(f"/{camera.name}/depth/image", image, frame.time)

    def add_state(self, time: float, q: npt.ArrayLike) -> None:
        """Writes joint positions q (n,) [rad or m] at a time [s].

        Raises:
            ValueError: q has another length or is not finite.
        """
        values = positions_of(q, self.joint_names)
        message = self._types[JOINT_STATE](
            header=self._header(time, ""),
            name=list(self.joint_names),
            position=values,
            velocity=np.zeros(0),
            effort=np.zeros(0),
        )
        self._write("/joint_states", message, time)

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Ends the bag."""
        self._writer.close()

    def _write(self, topic: str, message: Any, time: float) -> None:
        kind = message.__msgtype__
        if topic not in self._connections:
            profiles = [_latched()] if kind == TRANSFORMS else []
            self._connections[topic] = self._writer.add_connection(
                topic, kind, typestore=self._store, offered_qos_profiles=profiles
            )
        sec, nanosec = _stamp(time)
        content = self._store.serialize_cdr(message, kind)
        self._writer.write(self._connections[topic], sec * 1_000_000_000 + nanosec, content)

    def _header(self, time: float, frame: str) -> Any:
        sec, nanosec = _stamp(time)
        stamp = self._types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
        return self._types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)

    def _info(self, camera: CameraRecord, header: Any) -> Any:
        K = np.array([[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]])
        region = self._types["sensor_msgs/msg/RegionOfInterest"](
            x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
        )
        return self._types[CAMERA_INFO](
            header=header,
            height=camera.height,
            width=camera.width,
            distortion_model=_MODELS[camera.distortion_model],
            d=camera.distortion[: 4 if camera.distortion_model == "kannala_brandt" else 5].copy(),
            k=K.ravel(),
            r=np.eye(3).ravel(),
            p=np.hstack([K, np.zeros((3, 1))]).ravel(),
            binning_x=0,
            binning_y=0,
            roi=region,
        )

    def _write_poses(self, time: float) -> None:
        """The poses of the cameras at /tf_static."""
        make = {
            name: self._types[f"geometry_msgs/msg/{name}"] for name in ("Vector3", "Quaternion", "Transform")
        }
        transforms = []
        for camera in self._cameras.values():
            if camera.pose is not None:
                x, y, z, qw, qx, qy, qz = pose_vector(camera.pose).tolist()
                transform = make["Transform"](
                    translation=make["Vector3"](x=x, y=y, z=z),
                    rotation=make["Quaternion"](x=qx, y=qy, z=qz, w=qw),
                )
                transforms.append(
                    self._types["geometry_msgs/msg/TransformStamped"](
                        header=self._header(time, camera.link or self._base),
                        child_frame_id=_optical_frame(camera),
                        transform=transform,
                    )
                )
        if transforms:
            self._write("/tf_static", self._types[TRANSFORMS](transforms=transforms), time)
        self._poses_written = True


def _optical_frame(camera: CameraRecord) -> str:
    return f"{camera.name}_depth_optical_frame"


def _stamp(time: float) -> tuple[int, int]:
    """Seconds and nanoseconds of a time [s], from its whole part on, so that times of this century keep their bits."""
    if not 0.0 <= time < 2.0**31:
        raise ValueError(f"time is {time} s, a bag has times from 0 to 2^31 s")
    sec = math.floor(time)
    nanosec = round((time - sec) * 1e9)
    return (sec, nanosec) if nanosec < 1_000_000_000 else (sec + 1, 0)


def _latched() -> Any:
    """The quality of service of /tf_static: who comes late still gets the last message."""
    from rosbags.interfaces import (
        Qos,
        QosDurability,
        QosHistory,
        QosLiveliness,
        QosReliability,
        QosTime,
    )

    return Qos(
        history=QosHistory.KEEP_LAST,
        depth=1,
        reliability=QosReliability.RELIABLE,
        durability=QosDurability.TRANSIENT_LOCAL,
        deadline=QosTime(0, 0),
        lifespan=QosTime(0, 0),
        liveliness=QosLiveliness.SYSTEM_DEFAULT,
        liveliness_lease_duration=QosTime(0, 0),
        avoid_ros_namespace_conventions=False,
    )
