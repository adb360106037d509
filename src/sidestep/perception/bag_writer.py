"""Depth images into ROS 2 bags."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Literal

import numpy.typing as npt

from sidestep.perception.bag_topics import TRANSFORMS
from sidestep.perception.camera_record import CameraRecord
from sidestep.perception.frame import Frame
from sidestep.perception.ros_maker import MODELS, RosMaker, stamp
from sidestep.perception.written_cameras import by_name, camera_of, positions_of

_VERSION: Literal[9] = 9  # of the bag's metadata: that of ROS 2 Jazzy
_NAME = re.compile(r"[A-Za-z]\w*(?:/[A-Za-z]\w*)*", re.ASCII)  # what a topic may hold


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
            if camera.distortion_model not in MODELS:
                raise ValueError(
                    f"camera '{camera.name}' has distortion {camera.distortion_model!r}, ROS has {', '.join(MODELS)}"
                )
        if self.path.exists():
            raise FileExistsError(f"bag '{self.path}' exists, nothing is overwritten")
        self.joint_names, self._base = tuple(joint_names), base
        self._store = get_typestore(Stores.ROS2_JAZZY)
        self._make = RosMaker(self._store)
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
            poses = self._make.poses(list(self._cameras.values()), self._base, time=frame.time)
            if poses.transforms:
                self._write("/tf_static", poses, frame.time)
            self._poses_written = True
        self._write(
            f"/{camera.name}/depth/camera_info", self._make.camera_info(camera, frame.time), frame.time
        )
        if frame.q is not None and self.joint_names:
            self.add_state(frame.time, frame.q)
        self._write(f"/{camera.name}/depth/image", self._make.image(frame), frame.time)

    def add_state(self, time: float, q: npt.ArrayLike) -> None:
        """Writes joint positions q (n,) [rad or m] at a time [s].

        Raises:
            ValueError: q has another length or is not finite.
        """
        values = positions_of(q, self.joint_names)
        self._write("/joint_states", self._make.joint_state(self.joint_names, values, time=time), time)

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
        sec, nanosec = stamp(time)
        content = self._store.serialize_cdr(message, kind)
        self._writer.write(self._connections[topic], sec * 1_000_000_000 + nanosec, content)


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
