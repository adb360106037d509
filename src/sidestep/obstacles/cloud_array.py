"""Points of NumPy files."""

from __future__ import annotations

import math
import zipfile
import zlib
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]
MAX_COLUMNS = 16  # of a point: coordinates, normal, colour; more are points that stand in columns
MAX_UNPACKED = 2_000_000_000  # bytes of an array in an archive
NAMES = ("points", "xyz")  # of the array in an archive that holds several
MAGIC = b"\x93NUMPY"


def read_npy(path: Path) -> Points:
    """Points (N, 3) of an array in a .npy file; nothing is ever unpickled."""
    with path.open("rb") as stream:
        shape, dtype = _check_header(stream)
        announced, held = math.prod(shape) * dtype.itemsize, path.stat().st_size - stream.tell()
    if announced > held:
        raise ValueError(
            f"it is cut short: it announces an array {shape} of {announced} bytes and holds {held}"
        )
    return array_points(np.load(path, allow_pickle=False, mmap_mode="r"))


def read_npz(path: Path) -> Points:
    """Points (N, 3) of the only array of a .npz file, or of the one called points or xyz."""
    try:
        return _points_of_archive(path)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError) as error:
        raise ValueError("it is no NumPy archive, or it is damaged or cut short") from error


def _points_of_archive(path: Path) -> Points:
    with zipfile.ZipFile(path) as archive:
        held = [name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy")]
        chosen = held if len(held) == 1 else [name for name in NAMES if name in held]
        if not chosen:
            raise ValueError(
                f"it holds {', '.join(held) or 'nothing'}; allowed: one array, or one called {' or '.join(NAMES)}"
            )
        size = archive.getinfo(f"{chosen[0]}.npy").file_size
        if size > MAX_UNPACKED:
            raise ValueError(f"{chosen[0]} has {size} bytes; at most {MAX_UNPACKED} are allowed")
        with archive.open(f"{chosen[0]}.npy") as stream:
            shape, dtype = _check_header(stream)
            if math.prod(shape) * dtype.itemsize > size:
                raise ValueError(f"it announces an array {shape}, which is more than its bytes hold")
        with archive.open(f"{chosen[0]}.npy") as stream:
            return array_points(np.lib.format.read_array(stream, allow_pickle=False))


def _check_header(stream: IO[bytes]) -> tuple[tuple[int, ...], np.dtype]:
    """Shape and type of an array in NumPy's format; refuses what NumPy would have to unpickle."""
    magic = stream.read(len(MAGIC) + 2)
    if magic.startswith(b"PK"):
        raise ValueError("it is a NumPy archive; its suffix must be .npz")
    if not magic.startswith(MAGIC):
        raise ValueError("it is no NumPy file; write it by numpy.save(path, points)")
    reader = np.lib.format.read_array_header_1_0 if magic[-2] == 1 else np.lib.format.read_array_header_2_0
    try:
        shape, _, dtype = reader(stream)
    except (ValueError, TypeError) as error:
        raise ValueError("its header is damaged or cut short") from error
    if dtype.hasobject:
        raise ValueError(
            "it holds Python objects, which are never unpickled; save numbers: numpy.save(path, points.astype(float))"
        )
    return shape, dtype


def array_points(values: object) -> Points:
    """Points (N, 3) of an array, as a copy: the file of a mapped array is closed with it.

    Args:
        values: (N, 3) or (H, W, 3), or up to 16 columns of which the first are x, y, z; or a structured array with
            fields x, y, z, or xyz.
    """
    array = np.asarray(values)
    if array.dtype.names is not None:
        array = _coordinates(array, {str(name).lower(): name for name in array.dtype.names})
    if array.dtype.kind not in "fiu":
        raise ValueError(f"it does not hold an array of real numbers, its type is {array.dtype}")
    if array.size == 0 and (array.ndim == 1 or array.shape[-1] == 3):
        return np.zeros((0, 3))
    if array.ndim not in (2, 3) or not 3 <= array.shape[-1] <= MAX_COLUMNS:
        raise ValueError(
            f"its points have shape {array.shape}, expected (N, 3) or (H, W, 3), or up to {MAX_COLUMNS} columns "
            f"beginning with x, y, z, or fields x, y, z{_advice(array.shape)}"
        )
    check_rows(array.shape)
    return np.array(array.reshape(-1, array.shape[-1])[:, :3], dtype=np.float64)


def check_rows(shape: tuple[int, ...]) -> None:
    """Refuses what would read as few points with many columns, and is more likely points that stand in columns.

    Raises ValueError for (N, C) with N < C, and for (3, H, W), where C and W are more than 4.
    """
    few = 3 <= shape[0] < shape[-1] if len(shape) == 2 else shape[0] == 3
    if few and shape[-1] > 4:
        raise ValueError(
            f"its points have shape {shape} and look transposed{_advice(shape)}; if every row is a point, save "
            "x, y, z alone: array[..., :3]"
        )


def _coordinates(array: NDArray[np.void], names: dict[str, str]) -> NDArray[np.generic]:
    if {"x", "y", "z"} <= set(names):
        return np.stack([array[names[axis]] for axis in "xyz"], axis=-1)
    if "xyz" in names:
        coordinates: NDArray[np.generic] = array[names["xyz"]]
        return coordinates
    raise ValueError(f"it has no fields x, y, z; its fields are {', '.join(names.values())}")


def _advice(shape: tuple[int, ...]) -> str:
    if len(shape) == 2 and 3 <= shape[0] <= MAX_COLUMNS:
        return "; they stand in columns: save array.T"
    if len(shape) == 3 and 3 <= shape[0] <= MAX_COLUMNS:
        return "; the coordinates come first: save numpy.moveaxis(array, 0, -1)"
    if len(shape) == 2 and min(shape) > MAX_COLUMNS:
        return "; a depth image holds no points: turn it into some by the camera's intrinsics"
    return ""
