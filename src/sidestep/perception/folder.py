"""Depth images from a folder."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from sidestep.perception.apc_folder import read_apc
from sidestep.perception.arc_folder import intrinsics_files, read_arc
from sidestep.perception.camera_file import Pose
from sidestep.perception.camera_record import CameraRecord
from sidestep.perception.folder_content import FolderContent, ImageFile
from sidestep.perception.folder_layout import camera_folders, read_layout
from sidestep.perception.frame import Frame
from sidestep.perception.image_file import read_colour, read_depth


class FolderRecording:
    """Depth images of a folder, in the order of their times.

    The folder of one camera holds:

    - `camera.json`: the attributes of `CameraRecord`, or `K` (3, 3), `width`, `height` and more, see `read_camera`;
    - `depth_12.png` (16 bits) or `depth_12.npy` (uint16, or float metres): the images, by number;
    - `frames.csv`, where the times are known: `file` and `time` [s] of each image, and where there are `colour`, a
      file, and `X00` to `X23`, the upper rows of the camera's pose;
    - `joints.csv`, where the joints are known: a column for each joint [rad or m] beside `time` [s], between whose rows
      q is linear, or `frame`, the image's number, or neither: a row for each image;
    - `color_12.jpg` or `.png`: colour.

    Several cameras have a folder each inside the folder; `joints.csv` may then stand beside them. Folders of two
    published data sets are read as they are: `cam.info.txt` (see `read_apc`), `*intrinsics.txt` (see `read_arc`).

    Times are those of `frames.csv`. Without it the time of an image is its number / `rate`: `times_known` is then
    False, and nothing that depends on time (clock offset, velocity) can be measured.

    Attributes:
        path: the folder.
        cameras: what is said of each camera.
        joint_names: the joints, in the order of `Frame.q`; empty if none are recorded.
        times_known: whether the folder says when its images were captured.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        camera: str | None = None,
        pose: Pose = None,
        rate: float = 30.0,
        colour: bool = False,
        max_joint_gap: float = 0.2,
    ) -> None:
        """Reads all but the images.

        Args:
            path: the folder.
            camera: only the images of this one.
            pose: of the camera: the name of one of those in `camera.json`, or a pose (4, 4) instead.
            rate: images a second [Hz] where the folder has no times.
            colour: read colour images too.
            max_joint_gap: longest time [s] between two rows of joints that is bridged; q is None inside longer ones.

        Raises:
            FileNotFoundError: there is no such folder.
            ValueError: it holds no cameras or images, or a file is malformed; names it and what is allowed.
        """
        self.path = Path(path)
        if not (math.isfinite(rate) and rate > 0.0):
            raise ValueError(f"rate is {rate} Hz, must be positive and finite")
        if not self.path.is_dir():
            raise FileNotFoundError(f"folder '{self.path}' does not exist")
        content = _content(self.path, pose=pose, rate=rate, max_gap=max_joint_gap)
        names = [record.name for record in content.cameras]
        if camera is not None and camera not in names:
            raise ValueError(f"folder '{self.path}' has no camera {camera!r}; it has {', '.join(names)}")
        self.cameras = [record for record in content.cameras if camera in (None, record.name)]
        self.joint_names = content.joint_names
        self.times_known = content.times_known
        self._records = {record.name: record for record in self.cameras}
        self._images = sorted(
            (image for image in content.images if image.camera in self._records),
            key=lambda image: (image.time, image.camera),
        )
        if not self._images:
            raise ValueError(
                f"folder '{self.path}' has no depth images: files called depth_12.png, depth_12.npy or scene_depth.png"
            )
        self._colour = colour

    def __len__(self) -> int:
        """The number of images."""
        return len(self._images)

    def frames(self) -> Iterator[Frame]:
        """Reads the images one by one.

        Raises:
            FileNotFoundError, ValueError: an image is missing, malformed or of another size than its camera's.
        """
        for image in self._images:
            yield self._read(image, self._records[image.camera])

    def _read(self, image: ImageFile, record: CameraRecord) -> Frame:
        depth = read_depth(image.file)
        if depth.shape != (record.height, record.width):
            raise ValueError(
                f"depth image '{image.file}' has shape {depth.shape}, must be ({record.height}, {record.width}) as of "
                f"camera '{record.name}'"
            )
        return Frame(
            image.camera,
            image.time,
            depth,
            record.unit if depth.dtype.kind == "u" else 1.0,
            q=image.q,
            colour=read_colour(image.colour) if self._colour and image.colour else None,
            pose=image.pose,
        )


def _content(path: Path, *, pose: Pose, rate: float, max_gap: float) -> FolderContent:
    """What a folder of any known format holds."""
    if camera_folders(path):
        return read_layout(path, pose=pose, rate=rate, max_gap=max_gap)
    foreign = (path / "cam.info.txt").is_file() or intrinsics_files(path)
    if foreign and pose is not None:
        raise ValueError(
            f"pose is {pose!r}, but the cameras of folder '{path}' have their poses in its text files"
        )
    if (path / "cam.info.txt").is_file():
        return read_apc(path, rate=rate)
    if foreign:
        return read_arc(path, rate=rate)
    raise ValueError(
        f"folder '{path}' says nothing of a camera: it has neither camera.json nor a folder for each camera with one, "
        "nor cam.info.txt or *intrinsics.txt"
    )
