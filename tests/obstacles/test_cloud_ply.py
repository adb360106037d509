"""PLY files as cameras and scanners write them."""

import struct
import warnings
from pathlib import Path

import numpy as np
import pytest

from sidestep.obstacles import load_point_cloud

VERTEX = "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
COLOUR = "property uchar red\nproperty uchar green\nproperty uchar blue\n"
NORMAL = "property float nx\nproperty float ny\nproperty float nz\n"
CAMERA = "element camera 1\nproperty float view_px\nproperty float view_py\n"
FACES = "element face 0\nproperty list uchar int vertex_indices\n"
FLOATS = struct.pack("<6f", 1, 2, 3, 4, 5, 6)
LINES = b"1 2 3\n4 5 6\n"


def written(folder: Path, elements: str, body: bytes, *, encoding: str = "ascii", end: str = "\n") -> Path:
    head = f"ply\nformat {encoding} 1.0\ncomment element vertex 9\nobj_info any\n{elements}end_header\n"
    path = folder / "cloud.ply"
    path.write_bytes(head.replace("\n", end).encode() + body)
    return path


@pytest.mark.parametrize(
    ("elements", "body", "encoding", "end"),
    [
        (VERTEX, LINES, "ascii", "\n"),
        (VERTEX, LINES.replace(b"\n", b"\r\n"), "ascii", "\r\n"),
        (VERTEX, b" 1\t2 3 \n4  5 6\n", "ascii", "\n"),
        (VERTEX + COLOUR, b"1 2 3 9 9 9\n4 5 6 9 9 9\n", "ascii", "\n"),
        (
            "element vertex 2\n" + COLOUR + "property float z\nproperty float x\nproperty float y\n",
            b"9 9 9 3 1 2\n9 9 9 6 4 5\n",
            "ascii",
            "\n",
        ),
        (VERTEX + CAMERA, LINES + b"7 8\n", "ascii", "\n"),
        (CAMERA + VERTEX, b"7 8\n" + LINES, "ascii", "\n"),
        (VERTEX + FACES, LINES, "ascii", "\n"),
        (VERTEX, FLOATS, "binary_little_endian", "\n"),
        (VERTEX, FLOATS, "binary_little_endian", "\r\n"),
        (VERTEX, struct.pack(">6f", 1, 2, 3, 4, 5, 6), "binary_big_endian", "\n"),
        (
            VERTEX.replace("float", "double"),
            struct.pack("<6d", 1, 2, 3, 4, 5, 6),
            "binary_little_endian",
            "\n",
        ),
        (CAMERA + VERTEX, struct.pack("<2f", 7, 8) + FLOATS, "binary_little_endian", "\n"),
        (VERTEX + CAMERA, FLOATS + struct.pack("<2f", 7, 8), "binary_little_endian", "\n"),
        (VERTEX + FACES, FLOATS, "binary_little_endian", "\n"),
        (
            VERTEX + NORMAL + COLOUR,
            b"".join(struct.pack("<6f3B", *p, 0, 0, 1, 9, 9, 9) for p in ((1, 2, 3), (4, 5, 6))),
            "binary_little_endian",
            "\n",
        ),
    ],
)
def test_elements_and_properties_besides_are_passed_over(
    tmp_path: Path, elements: str, body: bytes, encoding: str, end: str
) -> None:
    path = written(tmp_path, elements, body, encoding=encoding, end=end)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_array_equal(load_point_cloud(path).points, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])


def test_holes_are_counted(tmp_path: Path) -> None:
    with pytest.warns(RuntimeWarning, match="1 of 2 points are not finite and were dropped"):
        points = load_point_cloud(written(tmp_path, VERTEX, b"nan nan nan\n4 5 6\n")).points
    np.testing.assert_array_equal(points, [[4.0, 5.0, 6.0]])


@pytest.mark.parametrize(
    ("elements", "message"),
    [
        (VERTEX.replace("vertex 2", "vertex 0"), "holds no point; where nothing is seen"),
        (VERTEX.replace("property float z\n", ""), "its vertices have no x, y, z; they have x, y"),
        (CAMERA, "its elements are camera; one must be vertex"),
    ],
)
def test_headers_without_points_are_refused(tmp_path: Path, elements: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        load_point_cloud(written(tmp_path, elements, b"" if "0" in message else b"1 2 3\n4 5 6\n"))
