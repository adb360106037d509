"""Folders of the Amazon Picking Challenge data of Princeton: one bin from an eye in hand, `cam.info.txt` beside."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sidestep.perception.camera_file import pinhole
from sidestep.perception.camera_record import CameraRecord
from sidestep.perception.folder_content import FolderContent, ImageFile, colour_beside, depth_files
from sidestep.perception.rounded_pose import rounded_pose

_UNIT = 1e-4  # [m] of these images
_WIDTH, _HEIGHT = 640, 480  # pixels of the camera, which the file does not state
_FRAME = re.compile(r"Camera-to-world extrinsic matrix .* for frame-(\d+)")


def read_apc(path: Path, *, rate: float) -> FolderContent:
    """What a folder with `cam.info.txt` holds: depth images and, with each, the pose of the depth camera in the world.

    The file gives poses X_WC of the colour camera and X_CD from depth to colour; the depth camera is at X_WC X_CD.

    Args:
        path: the folder.
        rate: the images have no time; that of image i is i / rate [s].

    Raises:
        ValueError: the file is malformed; names it.
    """
    info = path / "cam.info.txt"
    owner = f"'{info}'"
    matrices = _matrices(info)
    try:
        K = matrices["Depth camera intrinsic matrix"]
        X_CD = rounded_pose(matrices["Depth-to-color camera extrinsic matrix"], owner)
    except KeyError as error:
        raise ValueError(f"{owner} has no {error}; it has {', '.join(matrices)}") from error
    poses = {
        int(match[1]): rounded_pose(X_WC, f"{owner}: {title}") @ X_CD
        for title, X_WC in matrices.items()
        if (match := _FRAME.match(title))
    }
    fx, fy, cx, cy = pinhole(K, owner)
    camera = CameraRecord(path.resolve().name, _WIDTH, _HEIGHT, fx, fy, cx, cy, unit=_UNIT)
    images = []
    for number, file in depth_files(path):
        if number not in poses:
            raise ValueError(f"{owner} has no pose for '{file.name}'; it has those of {sorted(poses)}")
        pose = poses[number]
        images.append(ImageFile(camera.name, file, number / rate, colour=colour_beside(file), pose=pose))
    return FolderContent([camera], images)


def _matrices(path: Path) -> dict[str, npt.NDArray[np.float64]]:
    """The matrices of a file by title: the comment above each."""
    result: dict[str, npt.NDArray[np.float64]] = {}
    title, rows = "", list[list[float]]()
    for line in [*path.read_text(encoding="utf-8").splitlines(), "#"]:
        if line.startswith("#"):
            if rows:
                result[title] = np.array(rows)
            title, rows = line[1:].strip(), []
        elif line.strip():
            try:
                rows.append([float(word) for word in line.split()])
            except ValueError as error:
                raise ValueError(f"'{path}', {title}: {error}") from error
            if len(rows[-1]) != len(rows[0]):
                raise ValueError(
                    f"'{path}', {title}: a row of {len(rows[-1])} numbers below one of {len(rows[0])}"
                )
    return result
