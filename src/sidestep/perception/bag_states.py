"""What a ROS 2 bag says beside its images: cameras, joint states, frames that stand still."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sidestep.perception.bag_topics import CAMERA_INFO, JOINT_STATE, TRANSFORMS, messages
from sidestep.perception.joint_samples import JointSamples
from sidestep.perception.ros_message import time_of, transform_matrix
from sidestep.perception.static_frames import StaticFrames

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader


@dataclass(frozen=True, eq=False)
class BagStates:
    """The first camera info of each topic, the joint states, and the frames of /tf_static."""

    infos: dict[str, Any]
    joints: JointSamples
    frames: StaticFrames


def read_states(reader: AnyReader, path: Path, *, joints: Sequence[str] | None, max_gap: float) -> BagStates:
    """Reads all messages but the images.

    Args:
        reader: the opened bag. path: what errors call it.
        joints: the joints of q; None: those of the first message. Messages without all of them are left out.
        max_gap: longest time [s] between two joint states that is bridged.

    Raises:
        ValueError: no message has all the joints; names those there are.
    """
    infos: dict[str, Any] = {}
    frames = StaticFrames()
    states: list[tuple[float, Any]] = []
    for connection, received, content in messages(reader, CAMERA_INFO, JOINT_STATE, TRANSFORMS):
        known = connection.topic in infos  # a camera says the same with each image
        if known or (connection.msgtype == TRANSFORMS and not connection.topic.endswith("tf_static")):
            continue
        message: Any = reader.deserialize(content, connection.msgtype)
        if connection.msgtype == CAMERA_INFO:
            infos[connection.topic] = message
        elif connection.msgtype == TRANSFORMS:
            for item in message.transforms:
                X = transform_matrix(item.transform)
                frames.add(item.header.frame_id, item.child_frame_id, pose=X)
        else:
            states.append((time_of(message, received), message))
    return BagStates(infos, _samples(states, path, joints, max_gap), frames)


def _samples(
    states: Sequence[tuple[float, Any]], path: Path, joints: Sequence[str] | None, max_gap: float
) -> JointSamples:
    """The positions of some joints, from the messages that have all of them."""
    first = states[0][1].name if states else ()
    wanted = tuple(first if joints is None else joints)
    times, positions = [], []
    for time, message in states:
        if set(wanted) <= set(message.name) and len(message.position) == len(message.name):
            by_name = dict(zip(message.name, message.position.tolist(), strict=True))
            times.append(time)
            positions.append([by_name[name] for name in wanted])
    if wanted and not times:
        seen = sorted({name for _, message in states for name in message.name})
        raise ValueError(
            f"bag '{path}' has no joint state with positions of all of {', '.join(wanted)}; "
            f"it has {', '.join(seen) or 'none'}"
        )
    return JointSamples(wanted, times, positions=positions, max_gap=max_gap)
