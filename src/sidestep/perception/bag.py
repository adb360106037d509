"""Depth images from ROS 2 bags."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sidestep.perception import ros_message
from sidestep.perception.camera_record import CameraRecord
from sidestep.perception.frame import Frame
from sidestep.perception.joint_samples import JointSamples
from sidestep.perception.static_frames import StaticFrames

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader
    from rosbags.interfaces import Connection

IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
CAMERA_INFO, JOINT_STATE = "sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/JointState"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
BAG_SUFFIXES = (".mcap", ".db3")
_TRANSPORT = re.compile(r"/(?:compressedDepth|compressed)$")
_DEPTH_PARTS = re.compile(r"(?:/(?:aligned_depth_to_\w+|depth(?:_registered)?))?/[^/]+$")


@dataclass(frozen=True)
class _Stream:
    """A topic of depth images: the record of its camera, and whether its images are compressed."""

    topic: str
    record: CameraRecord
    compressed: bool


class BagRecording:
    """Depth images of a ROS 2 bag, MCAP or SQLite, in the order in which they were recorded.

    Images are `sensor_msgs/Image` of encoding 16UC1 or 32FC1, or `CompressedImage` of format compressedDepth PNG; the
    camera of `/front/depth/image_raw` is that of `/front/depth/camera_info` and called `front`. Poses come from
    `/tf_static`, q from `sensor_msgs/JointState` by name, linear between the messages before and after the capture.
    Colour is not read.

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
            streams = _depth_streams(reader, topics, self.path)
            infos, samples, frames = self._small_messages(reader, joints, max_joint_gap)
            self._streams = []
            names = _camera_names([connection.topic for connection in streams])
            for connection, name in zip(streams, names, strict=True):
                info_topic, info = _info_of(connection.topic, infos, self.path)
                pose = None if base is None else frames.pose(info.header.frame_id, base=base)
                owner = f"bag '{self.path}', {info_topic}"
                record = ros_message.camera_record(info, name, owner=owner, unit=unit, pose=pose, link=link)
                self._streams.append(_Stream(connection.topic, record, connection.msgtype == COMPRESSED))
        self.cameras = [stream.record for stream in self._streams]
        self.joint_names = samples.joint_names
        self._samples = samples

    def frames(self) -> Iterator[Frame]:
        """Reads the images one by one.

        Raises:
            ValueError: an image is malformed or of another size than its camera's; names the topic and the time.
        """
        streams = {stream.topic: stream for stream in self._streams}
        with self._reader() as reader:
            for connection, received, content in _messages(reader, IMAGE, COMPRESSED, topics=streams):
                message: Any = reader.deserialize(content, connection.msgtype)
                time = ros_message.seconds(message.header.stamp) or received * 1e-9
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

    def _small_messages(
        self, reader: AnyReader, joints: Sequence[str] | None, max_gap: float
    ) -> tuple[dict[str, Any], JointSamples, StaticFrames]:
        """The first camera info of each topic, the joint states, and the frames that stand still."""
        infos: dict[str, Any] = {}
        frames = StaticFrames()
        wanted = None if joints is None else tuple(joints)
        times, positions, seen = [], list[list[float]](), set[str]()
        for connection, received, content in _messages(reader, CAMERA_INFO, JOINT_STATE, TRANSFORMS):
            if connection.topic in infos or (
                connection.msgtype == TRANSFORMS and not connection.topic.endswith("tf_static")
            ):
                continue
            message: Any = reader.deserialize(content, connection.msgtype)
            if connection.msgtype == CAMERA_INFO:
                infos[connection.topic] = message
            elif connection.msgtype == TRANSFORMS:
                for item in message.transforms:
                    X = ros_message.transform_matrix(item.transform)
                    frames.add(item.header.frame_id, item.child_frame_id, pose=X)
            else:
                wanted = tuple(message.name) if wanted is None else wanted
                seen |= set(message.name)
                if set(wanted) <= set(message.name) and len(message.position) == len(message.name):
                    by_name = dict(zip(message.name, message.position.tolist(), strict=True))
                    times.append(ros_message.seconds(message.header.stamp) or received * 1e-9)
                    positions.append([by_name[name] for name in wanted])
        if wanted and not times:
            raise ValueError(
                f"bag '{self.path}' has no joint state with positions of all of {', '.join(wanted)}; "
                f"it has {', '.join(sorted(seen)) or 'none'}"
            )
        return infos, JointSamples(wanted or (), times, positions=positions, max_gap=max_gap), frames


def _messages(reader: AnyReader, *types: str, topics: Any = None) -> Iterator[tuple[Connection, int, bytes]]:
    """The messages of some types, and of some topics where they are given, in the order in which they came."""
    chosen = [c for c in reader.connections if c.msgtype in types and (topics is None or c.topic in topics)]
    if chosen:  # none would be all
        yield from reader.messages(connections=chosen)


def _depth_streams(reader: AnyReader, topics: Sequence[str] | None, path: Path) -> list[Connection]:
    """The topics of depth images: those asked for, or all whose first image is one of depth."""
    images = {c.topic: c for c in reader.connections if c.msgtype in (IMAGE, COMPRESSED)}
    if topics is not None:
        missing = [topic for topic in topics if topic not in images]
        if missing:
            raise ValueError(
                f"bag '{path}' has no images at {missing}; it has {', '.join(sorted(images)) or 'none'}"
            )
        return [images[topic] for topic in topics]
    encodings = {}
    for topic, connection in sorted(images.items()):
        first = next(iter(reader.messages(connections=[connection])), None)
        if first is not None:
            message: Any = reader.deserialize(first[2], connection.msgtype)
            encodings[topic] = message.format if connection.msgtype == COMPRESSED else message.encoding
    plain = {topic for topic, encoding in encodings.items() if encoding in ros_message.DEPTH_ENCODINGS}
    packed = {topic for topic, encoding in encodings.items() if "compressedDepth" in encoding}
    packed = {
        topic for topic in packed if _TRANSPORT.sub("", topic) not in plain
    }  # the same images once more
    if not plain | packed:
        seen = ", ".join(f"{topic} ({encoding})" for topic, encoding in encodings.items()) or "none"
        raise ValueError(
            f"bag '{path}' has no depth images (16UC1, 32FC1, compressedDepth); its images: {seen}"
        )
    return [images[topic] for topic in sorted(plain | packed)]


def _camera_names(topics: Sequence[str]) -> list[str]:
    """Names of cameras by topic: `front` of /front/depth/image_raw, `front/depth` where that is needed to tell them."""
    whole = [_TRANSPORT.sub("", topic) for topic in topics]
    short = [_DEPTH_PARTS.sub("", topic).strip("/") for topic in whole]
    long = [topic.rpartition("/")[0].strip("/") for topic in whole]
    names = [s if s and short.count(s) == 1 else n for s, n in zip(short, long, strict=True)]
    unique = [
        name if name and names.count(name) == 1 else topic.strip("/")
        for name, topic in zip(names, topics, strict=True)
    ]
    return unique


def _info_of(topic: str, infos: dict[str, Any], path: Path) -> tuple[str, Any]:
    """The camera info beside a topic of images, with its topic."""
    beside = _TRANSPORT.sub("", topic).rpartition("/")[0] + "/camera_info"
    if beside not in infos:
        raise ValueError(
            f"bag '{path}' has no message at {beside}, which describes the camera of {topic}; camera infos: "
            f"{', '.join(sorted(infos)) or 'none'}"
        )
    return beside, infos[beside]
