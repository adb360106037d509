"""What a folder of depth images holds, before an image is read."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sidestep.perception.camera_record import CameraRecord

# depth_12.png, depth.png, person_depth.png, input_0_depth.npy; the number is that of the image.
_DEPTH_NAME = re.compile(r"(?:.+_)?depth(?:_(\d+))?\.(?:png|npy)", re.IGNORECASE)
_COLOUR_NAMES = ("color", "colour")
_COLOUR_SUFFIXES = (".png", ".jpg", ".jpeg")


@dataclass(frozen=True, eq=False)
class ImageFile:
    """A depth image on disk: the name of its camera, its capture time [s], q (n,), colour and pose where there are."""

    camera: str
    file: Path
    time: float
    q: npt.NDArray[np.float64] | None = None
    colour: Path | None = None
    pose: npt.NDArray[np.float64] | None = None


@dataclass(frozen=True, eq=False)
class FolderContent:
    """The cameras, joints and images of a folder; `times_known`: whether it says when its images were captured."""

    cameras: Sequence[CameraRecord]
    images: Sequence[ImageFile]
    joint_names: tuple[str, ...] = ()
    times_known: bool = False


def depth_files(folder: Path) -> list[tuple[int, Path]]:
    """The depth images of a folder by number: that in the name, or else that of the file among those without one."""
    found = sorted(
        (path, match[1])
        for path in folder.iterdir()
        if (match := _DEPTH_NAME.fullmatch(path.name)) and path.is_file()
    )
    without = (path for path, number in found if number is None)
    return sorted(
        [*enumerate(without), *((int(number), path) for path, number in found if number is not None)]
    )


def colour_beside(depth: Path) -> Path | None:
    """The colour image of a depth image: `color_3.jpg` of `depth_3.png`."""
    for word in _COLOUR_NAMES:
        stem = re.sub("depth(?=(_[0-9]+)?$)", word, depth.stem, flags=re.IGNORECASE)
        for suffix in _COLOUR_SUFFIXES:
            path = depth.with_name(stem + suffix)
            if path.is_file():
                return path
    return None
