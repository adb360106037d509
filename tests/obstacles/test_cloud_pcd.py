"""PCD files as drivers write them, and their viewpoints."""

import struct
import warnings
from pathlib import Path

import numpy as np
import pytest
from pypcd4.pypcd4 import Encoding, PointCloud

from sidestep.obstacles import load_point_cloud

FLOATS = struct.pack("<6f", 1, 2, 3, 4, 5, 6)
LINES = b"1 2 3\n4 5 6\n"
AS_FLOATS = ("x y z", "4 4 4", "F F F", "1 1 1")
HALF = "0.7071067811865476"


def written(
    folder: Path,
    body: bytes,
    *,
    columns: tuple[str, str, str, str] = AS_FLOATS,
    encoding: str = "ascii",
    size: tuple[int, int] = (2, 1),
    viewpoint: str | None = None,
    end: str = "\n",
) -> Path:
    fields, sizes, types, counts = columns
    head = ["# .PCD v.7 - Point Cloud Data file format", "VERSION .7", f"FIELDS {fields}", f"SIZE {sizes}"]
    head += [f"TYPE {types}", *([f"COUNT {counts}"] if counts else [])]
    head += [f"WIDTH {size[0]}", f"HEIGHT {size[1]}"]
    head += [f"VIEWPOINT {viewpoint}"] if viewpoint else []
    head += [f"POINTS {size[0] * size[1]}", f"DATA {encoding}", ""]
    path = folder / "cloud.pcd"
    path.write_bytes(end.join(head).encode() + body)
    return path


@pytest.mark.parametrize(
    ("body", "options"),
    [
        (LINES, {}),
        (LINES, {"columns": ("X Y Z", *AS_FLOATS[1:])}),
        (LINES, {"columns": (*AS_FLOATS[:3], "")}),
        (LINES, {"encoding": "ASCII"}),
        (b"1\t2  3\r\n4 5 6\r\n", {"end": "\r\n"}),
        (b"3 9 1 2\n6 9 4 5\n", {"columns": ("z rgb x y", "4 4 4 4", "F U F F", "1 1 1 1")}),
        (
            b"9 7 8 9 1 2 3\n9 7 8 9 4 5 6\n",
            {"columns": ("rgb normal x y z", "4 4 4 4 4", "F F F F F", "1 3 1 1 1")},
        ),
        (FLOATS, {"encoding": "binary"}),
        (FLOATS, {"encoding": "BINARY", "columns": (*AS_FLOATS[:3], "")}),
        (FLOATS, {"encoding": "binary", "end": "\r\n"}),
        (FLOATS, {"encoding": "binary", "size": (1, 2)}),
        (
            struct.pack("<6h", 1, 2, 3, 4, 5, 6),
            {"encoding": "binary", "columns": ("x y z", "2 2 2", "I I I", "")},
        ),
        (
            struct.pack("<d3xdfdd3xdfd", 1, 2, 0.5, 3, 4, 5, 0.5, 6),
            {"encoding": "binary", "columns": ("x _ y rgb z", "8 1 8 4 8", "F U F F F", "1 3 1 1 1")},
        ),
    ],
)
def test_headers_and_paddings_of_drivers_are_understood(tmp_path: Path, body: bytes, options: dict) -> None:
    path = written(tmp_path, body, **options)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_array_equal(load_point_cloud(path).points, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_holes_of_an_organized_cloud_are_counted(tmp_path: Path, encoding: str) -> None:
    body = b"nan nan nan\n4 5 6\n" if encoding == "ascii" else struct.pack("<6f", *3 * [np.nan], 4, 5, 6)
    with pytest.warns(RuntimeWarning, match="1 of 2 points are not finite and were dropped"):
        points = load_point_cloud(written(tmp_path, body, encoding=encoding, size=(1, 2))).points
    np.testing.assert_array_equal(points, [[4.0, 5.0, 6.0]])


def test_the_viewpoint_is_applied_on_request(tmp_path: Path) -> None:
    # a quarter turn about z takes (1, 2, 3) to (-2, 1, 3); quaternions of files are rounded or not normed
    for quaternion in (f"{HALF} 0 0 {HALF}", "2 0 0 2"):
        path = written(tmp_path, LINES, viewpoint=f"10 20 30 {quaternion}")
        np.testing.assert_array_equal(load_point_cloud(path).points, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
        with pytest.warns(RuntimeWarning, match="half of its points are farther than"):
            points = load_point_cloud(path, viewpoint=True).points
        # roundings at the scale of 40
        np.testing.assert_allclose(points, [[8.0, 21.0, 33.0], [5.0, 24.0, 36.0]], rtol=0.0, atol=1e-14)
        scaled = load_point_cloud(path, viewpoint=True, scale=0.01, radius=0.02)
        np.testing.assert_allclose(scaled.points, 0.01 * points, rtol=1e-15)
        np.testing.assert_array_equal(scaled.radii, [0.02, 0.02])


def test_the_viewpoint_of_a_compressed_file_and_one_left_out(tmp_path: Path) -> None:
    cloud = PointCloud.from_xyz_points(np.array([[1, 2, 3], [4, 5, 6]], dtype=np.float32))
    cloud.metadata = cloud.metadata.model_copy(update={"viewpoint": (0.5, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0)})
    cloud.save(tmp_path / "compressed.pcd", encoding=Encoding.BINARY_COMPRESSED)
    points = load_point_cloud(tmp_path / "compressed.pcd", viewpoint=True).points  # half a turn about x
    np.testing.assert_allclose(points, [[1.5, -2.0, -3.0], [4.5, -5.0, -6.0]], rtol=1e-15)
    points = load_point_cloud(written(tmp_path, LINES), viewpoint=True).points
    np.testing.assert_array_equal(points, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])


def test_holes_are_holes_from_every_viewpoint(tmp_path: Path) -> None:
    path = written(tmp_path, b"nan inf 0\n4 5 6\n", viewpoint="1 0 0 1 0 0 0")
    with pytest.warns(RuntimeWarning) as caught:
        points = load_point_cloud(path, viewpoint=True).points
    np.testing.assert_array_equal(points, [[5.0, 5.0, 6.0]])
    assert len(caught) == 1


@pytest.mark.parametrize("viewpoint", ["0 0 0 0 0 0 0", "0 0 0 1 0 0", "0 0 nan 1 0 0 0", "a b c 1 0 0 0"])
def test_a_viewpoint_that_is_no_pose_is_refused_where_it_matters(tmp_path: Path, viewpoint: str) -> None:
    path = written(tmp_path, LINES, viewpoint=viewpoint)
    assert len(load_point_cloud(path).points) == 2
    with pytest.raises(
        ValueError, match=f"VIEWPOINT is '{viewpoint}', must be x y z and a quaternion w x y z"
    ):
        load_point_cloud(path, viewpoint=True)


def test_only_pcd_files_have_a_viewpoint(tmp_path: Path) -> None:
    np.save(tmp_path / "cloud.npy", np.eye(3))
    with pytest.raises(ValueError, match=r"cloud\.npy' has no viewpoint; only \.pcd files have one"):
        load_point_cloud(tmp_path / "cloud.npy", viewpoint=True)


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_an_empty_file_says_so(tmp_path: Path, encoding: str) -> None:
    with pytest.raises(ValueError, match="holds no point; where nothing is seen"):
        load_point_cloud(written(tmp_path, b"", encoding=encoding, size=(0, 1)))


def test_a_type_that_is_none_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, FLOATS, encoding="binary", columns=("x y z", "4 4 4", "F F D", ""))
    with pytest.raises(ValueError, match="TYPE is 'F F D'; it must be F, I or U for each of the FIELDS"):
        load_point_cloud(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("DATA ascii", "DATA zip", "DATA is 'zip', must be one of ascii, binary, binary_compressed$"),
        ("SIZE 4 4 4", "SIZE 4 4 x", "SIZE and COUNT must be whole numbers$"),
        ("4 5 6", "4 5", "line 10 is '4 5', with 2 of the 3 columns that are needed$"),
        ("4 5 6", "4 5 six", "line 10 is '4 5 six'; 'six' is no number$"),
    ],
)
def test_what_is_wrong_with_a_file_is_said_with_its_line(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    head = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 3\nHEIGHT 1\nPOINTS 3\nDATA ascii\n"
    (tmp_path / "cloud.pcd").write_text((head + "1 2 3\n10.25 20.5 30.75\n4 5 6\n").replace(old, new))
    with pytest.raises(ValueError, match=rf"cloud\.pcd' cannot be read: {message}"):
        load_point_cloud(tmp_path / "cloud.pcd")
