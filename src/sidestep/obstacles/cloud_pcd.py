"""Points of PCD files, and where they were taken from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sidestep.math.pose import from_quaternion, pose_at
from sidestep.obstacles.cloud_array import Points, array_points
from sidestep.obstacles.cloud_header import MAX_HEADER, read_header
from sidestep.obstacles.cloud_text import fault_in

ENCODINGS = ("ascii", "binary", "binary_compressed")
COMPRESSION = 100  # at most, of the compression of PCD files: 264 bytes from 3


@dataclass(frozen=True)
class _Header:
    """What a PCD file announces, and the number of bytes of the header."""

    words: dict[str, list[str]]
    sizes: list[int]
    counts: list[int]
    num_points: int
    encoding: str
    num_bytes: int

    def indices(self) -> list[int]:
        """Of x, y and z among the fields."""
        fields = [name.lower() for name in self.words["FIELDS"]]
        absent = [axis for axis in "xyz" if axis not in fields]
        if absent:
            raise ValueError(
                f"it has no field {', '.join(absent)}; its fields are {', '.join(self.words['FIELDS'])}"
            )
        return [fields.index(axis) for axis in "xyz"]


def read_pcd(path: Path) -> Points:
    """Points (N, 3) of a PCD file, ASCII, binary or compressed."""
    header = _read_header(path)
    read = {"ascii": _read_lines, "binary": _read_rows}.get(header.encoding, _read_compressed)
    points = read(path, header)
    if len(points) != header.num_points:
        raise ValueError(f"it announces {header.num_points} points and holds {len(points)}")
    return array_points(points)


def _read_lines(path: Path, header: _Header) -> Points:
    columns = [sum(header.counts[:index]) for index in header.indices()]
    content = path.read_bytes()[header.num_bytes :].decode("utf-8", errors="replace")
    lines = content.splitlines()
    if not content.strip():
        return np.zeros((0, 3))
    try:
        return np.loadtxt([line for line in lines if line.strip()], usecols=columns, ndmin=2)
    except ValueError as error:
        head = path.read_bytes()[: header.num_bytes].count(b"\n")
        raise ValueError(fault_in(lines, mark=None, columns=columns, first=head + 1)) from error


def _read_rows(path: Path, header: _Header) -> NDArray[np.void]:
    indices, widths = header.indices(), [s * n for s, n in zip(header.sizes, header.counts, strict=True)]
    types = header.words.get("TYPE", [])
    if len(types) != len(widths) or not set(types) <= set("FIU"):
        raise ValueError(f"TYPE is {' '.join(types)!r}; it must be F, I or U for each of the FIELDS")
    row = np.dtype(
        {
            "names": ["x", "y", "z"],
            "formats": [f"<{types[index].lower()}{header.sizes[index]}" for index in indices],
            "offsets": [sum(widths[:index]) for index in indices],
            "itemsize": sum(widths),
        }
    )
    return np.fromfile(path, row, count=header.num_points, offset=header.num_bytes)


def _read_compressed(path: Path, header: _Header) -> Points:
    from pypcd4.pypcd4 import PointCloud

    try:
        cloud = PointCloud.from_path(path).pc_data
    except Exception as error:  # pypcd4 raises anything
        raise ValueError("its points do not fit its header; the file is damaged or cut short") from error
    names = [header.words["FIELDS"][index] for index in header.indices()]
    return np.column_stack([np.asarray(cloud[name], dtype=np.float64) for name in names])


def read_viewpoint(path: Path) -> NDArray[np.float64]:
    """The pose (4, 4) of the sensor in the world that a PCD file states; unity where it states none.

    VIEWPOINT is a translation x y z and a quaternion w x y z, which need not have length 1.
    """
    words = _read_header(path).words.get("VIEWPOINT", ["0", "0", "0", "1", "0", "0", "0"])
    try:
        values = np.array([float(word) for word in words])
    except ValueError:
        values = np.zeros(0)
    length = float(np.linalg.norm(values[3:]))
    if len(values) != 7 or not np.isfinite(values).all() or length == 0.0:
        raise ValueError(f"VIEWPOINT is {' '.join(words)!r}, must be x y z and a quaternion w x y z")
    return pose_at(values[:3], from_quaternion(values[3:] / length))


def _read_header(path: Path) -> _Header:
    """The header; refuses what announces more than the file holds, before anything of that size is made."""
    lines, begin = read_header(path, b"DATA")
    words = {line[0].upper(): line[1:] for line in lines if line}
    encoding = " ".join(words["DATA"]).lower()
    if encoding not in ENCODINGS:
        raise ValueError(f"DATA is {encoding!r}, must be one of {', '.join(ENCODINGS)}")
    try:
        sizes, counts = ([int(word) for word in words.get(key, ())] for key in ("SIZE", "COUNT"))
    except ValueError as error:
        raise ValueError("SIZE and COUNT must be whole numbers") from error
    counts = counts or [1] * len(sizes)
    for key in ("WIDTH", "HEIGHT", "POINTS"):
        value = " ".join(words.get(key, ["1"]))
        if not value.isascii() or not value.isdigit():
            raise ValueError(f"{key} is {value!r}, must be a whole number")
    width, height = (int(words.get(key, ["1"])[0]) for key in ("WIDTH", "HEIGHT"))
    announced = int(words.get("POINTS", [str(width * height)])[0])
    for key, values in (("SIZE", sizes), ("COUNT", counts)):
        if len(values) != len(words.get("FIELDS", ())) or min(values, default=1) < 1:
            raise ValueError(f"{key} is {values}; it must be a positive number for each of the FIELDS")
    size = path.stat().st_size
    room = size - begin
    of_a_point = sum(counts)
    if encoding == "ascii":
        room = (room + 1) // 2  # every number has at least a digit and a separator
    else:
        of_a_point = sum(one * count for one, count in zip(sizes, counts, strict=True))
        room *= 1 if encoding == "binary" else COMPRESSION
    points = max(width * height, announced)
    if max(points, 1) * of_a_point > max(room, MAX_HEADER if points == 0 else 0):
        raise ValueError(
            f"it announces {points} points of {sum(counts)} numbers (COUNT {' '.join(map(str, counts))}), which is "
            f"more than the {size} bytes of the file hold"
        )
    return _Header(words, sizes, counts, announced, encoding, begin)
