"""Depth images from ROS 2 bags."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sidestep.perception import ros_message
from sidestep.perception.bag_states import read_states
from sidestep.perception.bag_topics import (
    COMPRESSED,
    IMAGE,
    camera_names,
    depth_topics,
    info_of,
    is_rectified,
    messages,
)
from sidestep.perception.camera_record import CameraRecord
from sidestep.perception.frame import Frame

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader

BAG_SUFFIXES = (".mcap", ".db3")


@dataclass(frozen=True)
class _Stream:
    """A topic of depth images: the record of its camera, and whether its images are compressed."""

    topic: str
    record: CameraRecord
    compressed: bool


class BagRecording:
    """Depth images of a ROS 2 bag, MCAP or SQLite, in the order in which they were recorded.

    Images are `sensor_msgs/Image` of encoding 16UC1 or 32FC1, or `CompressedImage` of format compressedDepth PNG; the
    camera of `/front/depth/image_raw` is that of `/front/depth/camera_info` and called `front`; images of a topic
    called `image_rect...` have no distortion and the intrinsics P. Poses come from `/tf_static`, q from
    `sensor_msgs/JointState` by name, linear between the messages before and after the capture. Colour is not read.

    Times [s] are those of the headers, on the clock that stamped them; an image without one has the time at which the
    bag received it.

    Attributes:
        path: the bag.
        cameras: what is said of each camera.
        joint_names: the joints, in the order of `Frame.q`; empty if none are recorded.
        times_known: True: a bag has times.
    """

    times_known = True

    def __init__(
        self,
        path: str | Path,
        *,
        topics: Sequence[str] | None = None,
        base: str | None = None,
        link: str = "",
        joints: Sequence[str] | None = None,
        unit: float = ros_message.MILLIMETRE,
        max_joint_gap: float = 0.2,
    ) -> None:
        """Reads all but the images.

        Args:
            path: the bag's folder, or its file.
            topics: those of the depth images; None: all topics of depth images.
            base: frame of `/tf_static` in which the cameras' poses are; None: they have none.
            link: the link of the arm that `base` is; "": it is the world.
            joints: the joints of q, in this order; None: those of the first message, in its order.
            unit: metres of one step of images of 16UC1, a millimetre by convention.
            max_joint_gap: longest time [s] between two joint states that is bridged; q is None inside longer ones.

        Raises:
            FileNotFoundError: there is no such bag.
            ValueError: it is no bag, has no depth images, or says too little about them; names the topics.
        """
        self.path = Path(path)
        if not self.path.exists():
            raise FileNotFoundError(f"bag '{self.path}' does not exist")
        if self.path.is_file() and self.path.suffix not in BAG_SUFFIXES:
            raise ValueError(
                f"bag '{self.path}' has suffix {self.path.suffix!r}, must be {' or '.join(BAG_SUFFIXES)}"
            )
        with self._reader() as reader:
            connections = depth_topics(reader, topics, self.path)
            states = read_states(reader, self.path, joints=joints, max_gap=max_joint_gap)
            self._streams = []
            names = camera_names([connection.topic for connection in connections])
            for connection, name in zip(connections, names, strict=True):
                info_topic, info = info_of(connection.topic, states.infos, self.path)
                pose = None if base is None else states.frames.pose(info.header.frame_id, base=base)
                owner = f"bag '{self.path}', {info_topic}"
                record = ros_message.camera_record(
                    info,
                    name,
                    owner=owner,
                    rectified=is_rectified(connection.topic),
                    unit=unit,
                    pose=pose,
                    link=link,
                )
                self._streams.append(_Stream(connection.topic, record, connection.msgtype == COMPRESSED))
        self.cameras = [stream.record for stream in self._streams]
        self.joint_names = states.joints.joint_names
        self._samples = states.joints

    def frames(self) -> Iterator[Frame]:
        """Reads the images one by one.

        Raises:
            ValueError: an image is malformed or of another size than its camera's; names the topic and the time.
        """
        streams = {stream.topic: stream for stream in self._streams}
        with self._reader() as reader:
            for connection, received, content in messages(reader, IMAGE, COMPRESSED, topics=streams):
                message: Any = reader.deserialize(content, connection.msgtype)
                time = ros_message.time_of(message, received)
                yield self._frame(streams[connection.topic], message, time)

    def _frame(self, stream: _Stream, message: Any, time: float) -> Frame:
        owner = f"bag '{self.path}': image of {stream.topic} at {time:.6f} s"
        read = ros_message.compressed_depth if stream.compressed else ros_message.image_depth
        depth, record = read(message, owner), stream.record
        if depth.shape != (record.height, record.width):
            raise ValueError(
                f"{owner} has shape {depth.shape}, must be ({record.height}, {record.width}) as its camera"
            )
        unit = record.unit if depth.dtype.kind == "u" else 1.0
        return Frame(record.name, time, depth, unit, q=self._samples.at(time))

    @contextlib.contextmanager
    def _reader(self) -> Iterator[AnyReader]:
        """The opened bag."""
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.rosbag2 import ReaderError
        from rosbags.typesys import Stores, get_typestore

        try:
            # SQLite bags before Iron hold no definitions of their messages.
            reader = AnyReader([self.path], default_typestore=get_typestore(Stores.ROS2_JAZZY))
            reader.open()
        except (AnyReaderError, ReaderError) as error:
            raise ValueError(f"bag '{self.path}' cannot be read: {error}") from error
        try:
            yield reader
        finally:
            reader.close()
