"""Obstacles from point-cloud files, and thinning that loses nothing."""

from __future__ import annotations

import io
import math
import re
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sidestep._core import Obstacles, real_array

Points = NDArray[np.float64]
MAX_COLUMNS = 16  # of a point: coordinates, normal, colour; more are points that stand in columns
MAX_UNPACKED = 2_000_000_000  # bytes of an array in an archive
FAR = 10.0  # [m] half of a cloud beyond this, or a point beyond ten times it, is warned of
MAX_HEADER = 65_536  # bytes of a text header
COMPRESSION = 100  # at most, of the compression of PCD files: 264 bytes from 3


def load_point_cloud(
    path: str | Path,
    *,
    radius: float = 0.0,
    voxel: float | None = None,
    scale: float = 1.0,
    invalid: Literal["raise", "drop"] = "drop",
) -> Obstacles:
    """Reads obstacle points from a .ply, .pcd, .npy, .npz or text file.

    Coordinates are taken as metres in the world, times `scale`; points that are implausibly far for that are
    warned of. PLY may be ASCII or binary of either byte order; PCD may be ASCII, binary or compressed (its
    VIEWPOINT is not applied). NPY, and NPZ with one array or one called "points", hold an array (N, 3) or (H, W, 3),
    or one with up to 16 columns of which the first three are x, y, z, or a structured one with fields x, y, z. Text
    files (.txt, .xyz, .csv, .asc, .pts) hold a point a line, x, y, z first or where a first line names them, between
    blanks, commas or semicolons; `#` begins a comment.

    Args:
        path: the file.
        radius: radius of every point [m].
        voxel: edge [m] of the cells in which points are merged, see `merge_in_voxels`; None keeps all points.
        scale: of the coordinates: 0.001 for a file in millimetres.
        invalid: what to do with points that are not finite, which depth cameras write where they see nothing:
            drop them with a warning that gives their number, or refuse the file.

    Raises:
        FileNotFoundError: if there is no such file.
        ValueError: if the format is unknown, the file is malformed or a mesh, or no point is left.
    """
    path = Path(path)
    if invalid not in ("raise", "drop"):
        raise ValueError(f"invalid is {invalid!r}, must be 'raise' or 'drop'")
    if not (np.isfinite(scale) and scale > 0.0):
        raise ValueError(f"scale is {scale}, must be positive and finite")
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
    points *= scale
    _warn_of_units(points, path)
    radii = np.full(len(points), float(radius))
    if voxel is not None:
        points, radii = merge_in_voxels(points, radii, voxel=voxel)
    return Obstacles(points, radii=radii)


def _warn_of_units(points: Points, path: Path) -> None:
    """Warns of points that no arm reaches: of most of them, or of a few that stand for "nothing seen"."""
    distance = np.abs(points).max(axis=1)
    middle, farthest = float(np.median(distance)), int(np.argmax(distance))
    if middle > FAR:
        cause = (
            f"half of its points are farther than {middle:.4g} m; are they in millimetres? Then scale=0.001"
        )
    elif distance[farthest] > 10.0 * FAR:
        count = np.count_nonzero(distance > 10.0 * FAR)
        cause = (
            f"{count} of {len(points)} points are farther than {10.0 * FAR:g} m: point {farthest} is at "
            f"{np.array2string(points[farthest], precision=4)} m; does that stand for nothing seen?"
        )
    else:
        return
    warnings.warn(f"point cloud '{path}': {cause}", RuntimeWarning, stacklevel=3)


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
    cloud = real_array(points, "points")
    if cloud.ndim != 2 or cloud.shape[1] != 3 or not np.isfinite(cloud).all():
        raise ValueError(f"points have shape {cloud.shape}, expected finite points (N, 3)")
    if not (np.isfinite(voxel) and voxel > 0.0):
        raise ValueError(f"voxel is {voxel}, must be positive and finite [m]")
    own = np.broadcast_to(real_array(radii, "radii"), len(cloud))
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
    if not isinstance(array, np.ndarray):
        raise ValueError("it is a NumPy archive; its suffix must be .npz")
    return _points(array)


def _read_npz(path: Path) -> Points:
    with zipfile.ZipFile(path) as archive:
        names = [name for name in archive.namelist() if name.endswith(".npy")]
        name = "points.npy" if "points.npy" in names else names[0] if len(names) == 1 else None
        if name is None:
            held = ", ".join(item.removesuffix(".npy") for item in names) or "nothing"
            raise ValueError(f"it holds {held}; allowed: one array, or one called points")
        if archive.getinfo(name).file_size > MAX_UNPACKED:
            raise ValueError(
                f"{name} has {archive.getinfo(name).file_size} bytes; at most {MAX_UNPACKED} are allowed"
            )
        content = io.BytesIO(archive.read(name))
    version = np.lib.format.read_magic(content)
    head = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, kind = head(content)
    if math.prod(shape) * kind.itemsize > len(content.getbuffer()):
        raise ValueError(f"it announces an array {shape}, which is more than its bytes hold")
    content.seek(0)
    return _points(np.load(content, allow_pickle=False))


def _read_text(path: Path) -> Points:
    lines = path.read_text(encoding="utf-8-sig").splitlines()
    titles: list[str] = []
    first = len(lines)
    for index, line in enumerate(lines):  # a comment may name the columns as well
        words = _words(line.lstrip("#/ "))
        if {"x", "y", "z"} <= set(words):
            titles = words
        elif words and not line.lstrip().startswith(("#", "//")):
            first = index
            break
    body = lines[first:]
    if body and len(_words(body[0])) == 1 and len(body) > 1 and _words(body[0])[0].isdigit():
        body = body[1:]  # the number of points, as .pts and .xyz may begin
    if not body:
        raise ValueError("it holds no point")
    mark = _separator(body[0])
    columns = [titles.index(axis) for axis in "xyz"] if titles else [0, 1, 2]
    if len(_words(body[0])) <= max(columns):
        raise ValueError(
            f"line {len(lines) - len(body) + 1} is {body[0][:80]!r}; allowed: x y z and more, between blanks, commas "
            "or semicolons"
        )
    return _points(np.loadtxt(body, delimiter=mark, usecols=columns, ndmin=2, comments=["#", "//"]))


def _separator(line: str) -> str | None:
    """Between the numbers of a line; None for blanks."""
    return next((mark for mark in ";," if mark in line), None)


def _words(line: str) -> list[str]:
    return [word.strip().strip('"').lower() for word in line.split(_separator(line)) if word.strip()]


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
    """Points (N, 3) of what a file holds, as a copy: the file of a mapped array is closed with it."""
    array = np.asarray(values)
    if array.dtype.names is not None:
        names = {str(name).lower(): name for name in array.dtype.names}
        if not {"x", "y", "z"} <= set(names):
            raise ValueError(f"it has no fields x, y, z; its fields are {', '.join(array.dtype.names)}")
        array = np.stack([array[names[axis]].astype(np.float64) for axis in "xyz"], axis=-1)
    if array.dtype.kind not in "fiu":
        raise ValueError("it does not hold an array of real numbers")
    if array.ndim not in (2, 3) or not 3 <= array.shape[-1] <= MAX_COLUMNS:
        turned = array.ndim == 2 and array.shape[0] == 3
        hint = "; they stand in columns: save array.T" if turned else ""
        raise ValueError(
            f"its points have shape {array.shape}, expected (N, 3) or (H, W, 3), or up to {MAX_COLUMNS} columns "
            f"beginning with x, y, z{hint}"
        )
    return np.array(array.reshape(-1, array.shape[-1])[:, :3], dtype=np.float64)


READERS: dict[str, Callable[[Path], Points]] = {
    ".ply": _read_ply,
    ".pcd": _read_pcd,
    ".npy": _read_npy,
    ".npz": _read_npz,
    ".txt": _read_text,
    ".xyz": _read_text,
    ".csv": _read_text,
    ".asc": _read_text,
    ".pts": _read_text,
}
