"""Obstacles from point-cloud files, and thinning that loses nothing."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sidestep._core import Obstacles

Points = NDArray[np.float64]
MAX_HEADER = 65_536  # bytes of a text header
COMPRESSION = 100  # at most, of the compression of PCD files: 264 bytes from 3


def load_point_cloud(
    path: str | Path,
    *,
    radius: float = 0.0,
    voxel: float | None = None,
    invalid: Literal["raise", "drop"] = "raise",
) -> Obstacles:
    """Reads obstacle points from a .ply, .pcd or .npy file.

    Coordinates are taken as metres in the world. PLY may be ASCII or binary of either byte order; PCD may be
    ASCII, binary or compressed (its VIEWPOINT is not applied); NPY holds an array (N, 3).

    Args:
        path: the file.
        radius: radius of every point [m].
        voxel: edge [m] of the cells in which points are merged, see `merge_in_voxels`; None keeps all points.
        invalid: what to do with points that are not finite, which depth cameras write where they see nothing:
            refuse the file, or drop them with a warning that gives their number.

    Raises:
        FileNotFoundError: if there is no such file.
        ValueError: if the format is unknown, the file is malformed or a mesh, or no point is left.
    """
    path = Path(path)
    if invalid not in ("raise", "drop"):
        raise ValueError(f"invalid is {invalid!r}, must be 'raise' or 'drop'")
    if not path.is_file():
        raise FileNotFoundError(f"point cloud '{path}' does not exist")
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise ValueError(
            f"point cloud '{path}' has suffix '{path.suffix}', must be one of {', '.join(READERS)}"
        )
    try:
        points = reader(path)
    except Exception as error:  # the readers raise anything; the file's name must reach the user
        raise ValueError(f"point cloud '{path}' cannot be read: {error}") from error
    finite = np.isfinite(points).all(axis=1)
    num_invalid = int(np.count_nonzero(~finite))
    if num_invalid and invalid == "raise":
        raise ValueError(
            f"point cloud '{path}': {num_invalid} of {len(points)} points are not finite, the first is point "
            f"{int(np.argmin(finite))}; invalid='drop' leaves them out"
        )
    if num_invalid:
        warnings.warn(
            f"point cloud '{path}': {num_invalid} of {len(points)} points are not finite and were dropped",
            RuntimeWarning,
            stacklevel=2,
        )
        points = points[finite]
    if len(points) == 0:
        raise ValueError(f"point cloud '{path}' holds no point")
    radii = np.full(len(points), float(radius))
    if voxel is not None:
        points, radii = merge_in_voxels(points, radii, voxel=voxel)
    return Obstacles(points, radii=radii)


def merge_in_voxels(points: ArrayLike, radii: ArrayLike = 0.0, *, voxel: float) -> tuple[Points, Points]:
    """Merges the points of each cell of a grid into one ball that contains all of theirs.

    The ball sits at the centre of the box around the cell's points and reaches over the farthest of them, so
    it adds at most half the cell's diagonal, sqrt(3)/2 voxel, to the largest radius; a point alone stays as
    it is. The merged obstacle contains the original one: thinning makes the arm more careful, never less.

    Args:
        points: (N, 3) [m].
        radii: one or (N,) [m].
        voxel: edge of a cell [m].

    Returns:
        Points (M, 3) and radii (M,) with M <= N, in the order of the cells.

    Raises:
        ValueError: if the voxel is not a positive length or the points are not finite (N, 3).
    """
    cloud = np.asarray(points, dtype=np.float64)
    if cloud.ndim != 2 or cloud.shape[1] != 3 or not np.isfinite(cloud).all():
        raise ValueError(f"points have shape {cloud.shape}, expected finite points (N, 3)")
    if not (np.isfinite(voxel) and voxel > 0.0):
        raise ValueError(f"voxel is {voxel}, must be positive and finite [m]")
    own = np.broadcast_to(np.asarray(radii, dtype=np.float64), len(cloud))
    _, cell = np.unique(np.floor(cloud / voxel), axis=0, return_inverse=True)
    cell = cell.reshape(-1)
    order = np.argsort(cell, kind="stable")
    starts = (
        np.flatnonzero(np.r_[True, np.diff(cell[order]) > 0]) if len(cloud) else np.zeros(0, dtype=np.int64)
    )
    low = np.minimum.reduceat(cloud[order], starts)
    high = np.maximum.reduceat(cloud[order], starts)
    centres = 0.5 * (low + high)
    reach = np.linalg.norm(cloud - centres[cell], axis=1) + own
    return centres, np.maximum.reduceat(reach[order], starts)


def _read_ply(path: Path) -> Points:
    from trimesh.exchange.ply import load_ply

    _check_ply_size(path)
    with path.open("rb") as stream:
        contents = load_ply(stream, fix_texture=False, skip_materials=True)
    faces = contents.get("faces")
    if faces is not None and len(faces):
        raise ValueError(
            f"it is a mesh of {len(faces)} faces, not a cloud; MeshShape(path) samples its surface"
        )
    points = _points(contents.get("vertices"))
    announced = re.search(rb"element\s+vertex\s+(\d+)", path.read_bytes())
    if announced is None or int(announced[1]) != len(points):  # trimesh lets a short ASCII file pass
        count = "no" if announced is None else int(announced[1])
        raise ValueError(f"it announces {count} points and holds {len(points)}")
    return points


def _read_pcd(path: Path) -> Points:
    from pypcd4.pypcd4 import PointCloud

    _check_pcd_size(path)
    cloud = PointCloud.from_path(path)
    absent = [name for name in ("x", "y", "z") if name not in cloud.fields]
    if absent:
        raise ValueError(f"it has no field {', '.join(absent)}; its fields are {', '.join(cloud.fields)}")
    if len(cloud.pc_data) != cloud.metadata.points:
        raise ValueError(f"it announces {cloud.metadata.points} points and holds {len(cloud.pc_data)}")
    return _points(np.column_stack([np.asarray(cloud.pc_data[name], dtype=np.float64) for name in "xyz"]))


def _read_npy(path: Path) -> Points:
    array = np.load(path, allow_pickle=False, mmap_mode="r")  # compares the shape with the size of the file
    if not isinstance(array, np.ndarray) or array.dtype.kind not in "fiu":
        raise ValueError("it does not hold an array of real numbers")
    return _points(array)


def _header(path: Path, end: bytes) -> tuple[list[list[str]], int]:
    """The words of each line of a header up to one that begins with `end`, and the bytes that follow."""
    with path.open("rb") as stream:
        start = stream.read(MAX_HEADER)
    lines: list[list[str]] = []
    offset = 0
    for line in start.splitlines(keepends=True):
        offset += len(line)
        lines.append(line.decode("utf-8", errors="replace").split())
        if line.strip().startswith(end):
            return lines, path.stat().st_size - offset
    raise ValueError(f"its header has no line {end.decode()} within {MAX_HEADER} bytes")


def _check_pcd_size(path: Path) -> None:
    """Refuses a header that announces more than the file holds, before anything of that size is made."""
    lines, room = _header(path, b"DATA")
    head = {words[0].upper(): words[1:] for words in lines if words}
    size, count = ([int(word) for word in head.get(key, ())] for key in ("SIZE", "COUNT"))
    count = count or [1] * len(size)
    encoding = " ".join(head["DATA"]).lower()
    for key in ("WIDTH", "HEIGHT", "POINTS"):
        value = " ".join(head.get(key, ["1"]))
        if not value.isascii() or not value.isdigit():
            raise ValueError(f"{key} is {value!r}, must be a whole number")
    width, height = (int(head.get(key, ["1"])[0]) for key in ("WIDTH", "HEIGHT"))
    points = max(width * height, int(head.get("POINTS", ["0"])[0]))
    for key, values in (("SIZE", size), ("COUNT", count)):
        if len(values) != len(head.get("FIELDS", ())) or min(values, default=1) < 1:
            raise ValueError(f"{key} is {values}; it must be a positive number for each of the FIELDS")
    of_a_point = sum(count) if encoding == "ascii" else sum(s * n for s, n in zip(size, count, strict=True))
    if encoding.startswith("binary") and encoding != "binary":
        room *= COMPRESSION
    elif encoding == "ascii":
        room = (room + 1) // 2  # every number has at least a digit and a separator
    if max(points, 1) * of_a_point > max(room, MAX_HEADER if points == 0 else 0):
        raise ValueError(
            f"it announces {points} points of {sum(count)} numbers (COUNT {' '.join(map(str, count))}), which is "
            f"more than the {path.stat().st_size} bytes of the file hold"
        )


def _check_ply_size(path: Path) -> None:
    """As `_check_pcd_size`: every row of an element takes at least a byte for each property."""
    lines, room = _header(path, b"end_header")
    elements: list[list[str | int]] = []
    for words in lines:
        if words[:1] == ["element"]:
            if len(words) != 3 or not (words[2].isascii() and words[2].isdigit()):
                raise ValueError(f"its header says {' '.join(words)!r}; it must be: element NAME NUMBER")
            elements.append([words[1], int(words[2]), 0])
        elif words[:1] == ["property"] and elements:
            elements[-1][2] = int(elements[-1][2]) + 1
    least = sum(int(number) * max(1, int(properties)) for _, number, properties in elements)
    if least > room + 1:  # the last line may end with the file
        name, number, _ = max(elements, key=lambda element: int(element[1]))
        raise ValueError(
            f"it announces {number} of element {name}, which is more than the {path.stat().st_size} bytes of the "
            "file hold"
        )


def _points(values: object) -> Points:
    points = np.array(values, dtype=np.float64)  # a copy: the file of a mapped array is closed with it
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"its points have shape {points.shape}, expected (N, 3)")
    return points


READERS: dict[str, Callable[[Path], Points]] = {".ply": _read_ply, ".pcd": _read_pcd, ".npy": _read_npy}
