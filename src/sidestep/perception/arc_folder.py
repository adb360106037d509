"""Folders of the Amazon Robotics Challenge data of Princeton: images of bins with intrinsics as text."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sidestep.perception.camera_file import pinhole
from sidestep.perception.camera_record import CameraRecord
from sidestep.perception.folder_content import FolderContent, ImageFile, colour_beside
from sidestep.perception.rounded_pose import rounded_pose

_UNIT = 1e-4  # [m] of these images
_WIDTH, _HEIGHT = 640, 480  # pixels of the cameras, which the files do not state
_INTRINSICS = re.compile(r"(?:(.+)_)?camera(?:-(\d+)\.|-)intrinsics\.txt")


def intrinsics_files(path: Path) -> list[Path]:
    """`*camera-intrinsics.txt` and `*camera-N.intrinsics.txt` of a folder."""
    return sorted(file for file in path.iterdir() if _INTRINSICS.fullmatch(file.name))


def read_arc(path: Path, *, rate: float) -> FolderContent:
    """What a folder with intrinsics as text holds.

    The images of `a_camera-intrinsics.txt` are `a_*_depth.png`, those of camera N of `a_camera-N.intrinsics.txt`
    `a_*_N_depth.png`, and `a_camera-N.pose.txt` is its pose. The cameras are called `a` and `a_N`.

    Args:
        path: the folder.
        rate: the images have no time; that of image i of a camera is i / rate [s].

    Raises:
        ValueError: a file is malformed; names it.
    """
    cameras, images = [], []
    for file in intrinsics_files(path):
        match = _INTRINSICS.fullmatch(file.name)
        assert match is not None
        group, number = match[1] or "", match[2]
        name = "_".join(part for part in (group, number) if part) or path.resolve().name
        fx, fy, cx, cy = pinhole(_matrix(file), f"'{file}'")
        pose_file = file.with_name(file.name.replace("intrinsics", "pose"))
        pose = rounded_pose(_matrix(pose_file), f"'{pose_file}'") if pose_file.is_file() else None
        cameras.append(CameraRecord(name, _WIDTH, _HEIGHT, fx, fy, cx, cy, pose=pose, unit=_UNIT))
        pattern = f"{group}_*_depth.png" if number is None else f"{group}_*_{number}_depth.png"
        for index, depth in enumerate(sorted(path.glob(pattern if group else pattern[1:]))):
            images.append(ImageFile(name, depth, index / rate, colour=colour_beside(depth)))
    return FolderContent(cameras, images)


def _matrix(path: Path) -> npt.NDArray[np.float64]:
    try:
        return np.loadtxt(path, ndmin=2)
    except ValueError as error:
        raise ValueError(f"'{path}' is not a matrix: {error}") from error
