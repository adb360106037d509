"""The topics of a ROS 2 bag that tell of depth cameras."""

from __future__ import annotations

import re
from collections.abc import Container, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sidestep.perception.ros_message import DEPTH_ENCODINGS

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader
    from rosbags.interfaces import Connection

IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
CAMERA_INFO, JOINT_STATE = "sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/JointState"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
_TRANSPORT = re.compile(r"/(?:compressedDepth|compressed)$")
_DEPTH_PARTS = re.compile(r"(?:/(?:aligned_depth_to_\w+|depth(?:_registered)?))?/[^/]+$")


def messages(
    reader: AnyReader, *types: str, topics: Container[str] | None = None
) -> Iterator[tuple[Connection, int, bytes]]:
    """The messages of some types, and of some topics where they are given, in the order in which they came."""
    chosen = [c for c in reader.connections if c.msgtype in types and (topics is None or c.topic in topics)]
    if chosen:  # none would be all
        yield from reader.messages(connections=chosen)


def depth_topics(reader: AnyReader, topics: Sequence[str] | None, path: Path) -> list[Connection]:
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
    plain = {topic for topic, encoding in encodings.items() if encoding in DEPTH_ENCODINGS}
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


def camera_names(topics: Sequence[str]) -> list[str]:
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


def info_of(topic: str, infos: dict[str, Any], path: Path) -> tuple[str, Any]:
    """The camera info beside a topic of images, with its topic."""
    beside = _TRANSPORT.sub("", topic).rpartition("/")[0] + "/camera_info"
    if beside not in infos:
        raise ValueError(
            f"bag '{path}' has no message at {beside}, which describes the camera of {topic}; camera infos: "
            f"{', '.join(sorted(infos)) or 'none'}"
        )
    return beside, infos[beside]


def is_rectified(topic: str) -> bool:
    """Whether the images of a topic have no distortion any more, by the names of ROS: image_rect, image_rect_raw."""
    return "rect" in _TRANSPORT.sub("", topic).rpartition("/")[2].split("_")
