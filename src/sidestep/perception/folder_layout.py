"""Sidestep's own layout of a folder of depth images, which `FolderWriter` writes."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sidestep.perception.camera_file import Pose, read_camera
from sidestep.perception.folder_content import FolderContent, ImageFile, colour_beside, depth_files
from sidestep.perception.joint_samples import JointSamples

POSE_COLUMNS = tuple(f"X{row}{column}" for row in range(3) for column in range(4))  # of frames.csv
_Rows = list[dict[str, str]]


def read_layout(path: Path, *, pose: Pose, rate: float, max_gap: float) -> FolderContent:
    """What a folder with `camera.json`, or with one folder of that kind for each camera, holds.

    Args:
        path: the folder.
        pose: see `read_camera`.
        rate: of images without a time [Hz].
        max_gap: longest time [s] between two rows of `joints.csv` that is bridged.

    Raises:
        ValueError: a file is malformed or does not fit the others; names it.
    """
    folders = camera_folders(path)
    if len(folders) > 1 and pose is not None and not isinstance(pose, str):
        raise ValueError(f"folder '{path}' has {len(folders)} cameras, one pose cannot be that of each")
    parts = [_read_folder(folder, path, pose=pose, rate=rate, max_gap=max_gap) for folder in folders]
    names = {part.joint_names for part in parts}
    if len(names) > 1:
        raise ValueError(f"folder '{path}': its cameras have different joints: {sorted(names)}")
    cameras = [camera for part in parts for camera in part.cameras]
    if len({camera.name for camera in cameras}) < len(cameras):
        raise ValueError(
            f"folder '{path}': two cameras have one name: {', '.join(sorted(camera.name for camera in cameras))}"
        )
    images = [image for part in parts for image in part.images]
    return FolderContent(cameras, images, names.pop(), all(part.times_known for part in parts))


def camera_folders(path: Path) -> list[Path]:
    """The folders that hold the images of one camera each: the folder itself, or those in it."""
    if _camera_file(path) is not None:
        return [path]
    return [
        folder for folder in sorted(path.iterdir()) if folder.is_dir() and _camera_file(folder) is not None
    ]


def _camera_file(folder: Path) -> Path | None:
    """`camera.json`, or the only `camera*.json`."""
    files = sorted(folder.glob("camera*.json"))
    named = [file for file in files if file.name == "camera.json"]
    return (named or files)[0] if named or len(files) == 1 else None


def _read_folder(folder: Path, top: Path, *, pose: Pose, rate: float, max_gap: float) -> FolderContent:
    file = _camera_file(folder)
    assert file is not None
    camera = read_camera(file, pose=pose)
    listed = folder / "frames.csv"
    times_known = listed.is_file()
    numbered = (
        _listed_images(listed, camera.name) if times_known else _unlisted_images(folder, camera.name, rate)
    )
    joints = next((file for file in (folder / "joints.csv", top / "joints.csv") if file.is_file()), None)
    if joints is None:
        return FolderContent([camera], [image for _, image in numbered], (), times_known)
    names, positions = _positions(joints, numbered, max_gap=max_gap)
    images = [
        ImageFile(image.camera, image.file, image.time, q, image.colour, image.pose)
        for (_, image), q in zip(numbered, positions, strict=True)
    ]
    return FolderContent([camera], images, names, times_known)


def _unlisted_images(folder: Path, camera: str, rate: float) -> list[tuple[int, ImageFile]]:
    return [
        (number, ImageFile(camera, file, number / rate, colour=colour_beside(file)))
        for number, file in depth_files(folder)
    ]


def _listed_images(listed: Path, camera: str) -> list[tuple[int, ImageFile]]:
    """The images of frames.csv: file, time [s], and where there are colour and the rows of a pose."""
    header, rows = _table(listed, needed=("file", "time"))
    has_pose = set(POSE_COLUMNS) <= set(header)
    images = []
    for number, row in enumerate(rows):
        file = listed.parent / row["file"]
        colour = listed.parent / row["colour"] if row.get("colour") else colour_beside(file)
        pose = None
        if has_pose and row[POSE_COLUMNS[0]]:
            upper = [_number(row, name, listed, number) for name in POSE_COLUMNS]
            pose = np.vstack([np.reshape(upper, (3, 4)), [0.0, 0.0, 0.0, 1.0]])
        time = _number(row, "time", listed, number)
        images.append((number, ImageFile(camera, file, time, colour=colour, pose=pose)))
    return images


def _positions(
    path: Path, images: Sequence[tuple[int, ImageFile]], *, max_gap: float
) -> tuple[tuple[str, ...], list[npt.NDArray[np.float64] | None]]:
    """The joints of joints.csv, and q (n,) of each image: by `time`, by `frame` (the image's number), or by row."""
    header, rows = _table(path, needed=())
    names = tuple(name for name in header if name not in ("time", "frame"))
    if not names:
        raise ValueError(f"'{path}' has no joint; its columns are {', '.join(header)}")
    values = np.array(
        [[_number(row, name, path, i) for name in names] for i, row in enumerate(rows)]
    ).reshape(len(rows), len(names))
    if "time" in header:
        times = [_number(row, "time", path, i) for i, row in enumerate(rows)]
        samples = JointSamples(names, times, positions=values, max_gap=max_gap)
        return names, [samples.at(image.time) for _, image in images]
    if "frame" in header:
        by_number = {int(_number(row, "frame", path, i)): i for i, row in enumerate(rows)}
        return names, [values[by_number[n]] if n in by_number else None for n, _ in images]
    if len(rows) != len(images):
        raise ValueError(
            f"'{path}' has {len(rows)} rows for {len(images)} images, must have one for each, or a column time or frame"
        )
    return names, list(values)


def _table(path: Path, *, needed: Sequence[str]) -> tuple[list[str], _Rows]:
    """The titles and rows of a CSV file."""
    with path.open(encoding="utf-8", newline="") as stream:
        reader = csv.DictReader(stream, skipinitialspace=True)
        header, rows = list(reader.fieldnames or []), list(reader)
    missing = [name for name in needed if name not in header]
    if missing:
        raise ValueError(f"'{path}' has no column {', '.join(missing)}; it has {', '.join(header)}")
    for number, row in enumerate(rows):
        if None in row or None in row.values():
            raise ValueError(f"'{path}', row {number}: not as many cells as the {len(header)} titles")
    return header, rows


def _number(row: dict[str, str], name: str, path: Path, index: int) -> float:
    try:
        value = float(row[name])
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise ValueError(f"'{path}', row {index}: {name} is {row[name]!r}, must be a finite number")
    return value
