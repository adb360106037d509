"""Recordings of depth images, whatever holds them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Protocol

from sidestep.perception.bag import BAG_SUFFIXES, BagRecording
from sidestep.perception.camera_file import Pose
from sidestep.perception.camera_record import CameraRecord
from sidestep.perception.folder import FolderRecording
from sidestep.perception.frame import Frame


class Recording(Protocol):
    """What every source of depth images has: cameras, the joints of q, whether times are real, and the frames."""

    @property
    def cameras(self) -> Sequence[CameraRecord]:
        """What is said of each camera."""

    @property
    def joint_names(self) -> tuple[str, ...]:
        """The joints, in the order of `Frame.q`; empty if none are recorded."""

    @property
    def times_known(self) -> bool:
        """Whether the source says when its images were captured."""

    def frames(self) -> Iterator[Frame]:
        """The images one by one, by time."""


def open_recording(
    path: str | Path, *, pose: Pose = None, rate: float = 30.0, colour: bool = False
) -> Recording:
    """A recording: a bag where the path is a file or a folder with `metadata.yaml`, else a folder of images.

    Args:
        path: the file or folder.
        pose: of a folder's camera, see `FolderRecording`; of a bag the frame in which its `/tf_static` gives the poses,
            see `base` of `BagRecording`.
        rate: images a second [Hz] where a folder has no times.
        colour: read the colour images of a folder too; those of a bag are not read.

    Raises:
        FileNotFoundError: there is nothing at the path.
        TypeError: a pose (4, 4) is given for a bag.
        ValueError: it is no recording, or malformed; says what is wrong.
    """
    path = Path(path)
    if path.is_file() or (path / "metadata.yaml").is_file():
        if pose is not None and not isinstance(pose, str):
            raise TypeError(f"pose is {pose!r}, must be the name of a frame of /tf_static for bag '{path}'")
        return BagRecording(path, base=pose)
    if not path.exists():
        raise FileNotFoundError(f"recording '{path}' does not exist")
    if any(next(path.glob(f"*{suffix}"), None) for suffix in BAG_SUFFIXES):
        raise ValueError(f"folder '{path}' holds bag files but no metadata.yaml; give the file")
    return FolderRecording(path, pose=pose, rate=rate, colour=colour)
