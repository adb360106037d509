"""Text files as people and programs write them."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from sidestep.obstacles import load_point_cloud

POINTS = np.random.default_rng(7).uniform(-1.0, 1.0, (50, 3)).astype(np.float32)


@pytest.mark.parametrize("mark", [" ", ",", ";", ", ", "\t", "   "])
@pytest.mark.parametrize(
    ("head", "order", "suffix"),
    [
        ("", [0, 1, 2], "xyz"),
        ("# made by a camera\n\n", [0, 1, 2], "txt"),
        ("50\n", [0, 1, 2], "pts"),
        ("{}\n", [0, 1, 2, 0], "csv"),
        ("# {}\n", [2, 0, 1], "csv"),
        ("//{}\n", [2, 2, 0, 1], "asc"),
    ],
)
def test_text_files_give_the_same_points(
    tmp_path: Path, mark: str, head: str, order: list[int], suffix: str
) -> None:
    names, taken = [], set[int]()
    for axis in reversed(order) if order == [2, 2, 0, 1] else order:
        names.append("intensity" if axis in taken else "xyz"[axis])
        taken.add(axis)
    names = names[::-1] if order == [2, 2, 0, 1] else names
    rows = "".join(
        mark.join(
            repr(float(point[axis])) if name != "intensity" else "7"
            for axis, name in zip(order, names, strict=True)
        )
        + "\r\n"
        for point in POINTS
    )
    (tmp_path / f"cloud.{suffix}").write_text(head.format(mark.join(names)) + rows, newline="")
    np.testing.assert_array_equal(load_point_cloud(tmp_path / f"cloud.{suffix}").points, POINTS)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "it holds no point"),
        ("# nothing\n", "it holds no point"),
        ("# two\n1 2\n3 4\n", "line 2 is '1 2'; allowed: x y z and more, between blanks, tabs, commas"),
        ("1 2 3\n4 5\n", "cannot be read"),
        ("1 2 three\n", "cannot be read"),
    ],
)
def test_text_that_is_no_cloud_is_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "cloud.txt").write_text(text)
    with pytest.raises(ValueError, match=rf"cloud\.txt' cannot be read: .*{message}|{message}"):
        load_point_cloud(tmp_path / "cloud.txt")


@pytest.mark.parametrize(
    "text",
    [
        '"x","y","z"\n"1","2","3"\n"4","5","6"\n',
        "X [m];Y [m];Z [m]\n1;2;3\n4;5;6\n",
        "x(m)\ty(m)\tz(m)\n1\t2\t3\n\n4\t5\t6\n",
        "1,0;2,0;3,0\n4,0;5,0;6,0\n",
        "Points:0,Points:1,Points:2,c\n1,2,3,4\n4,5,6,4\n",
        "Exported by a scanner\n1 2 3\n4 5 6\n",
        "% made by a program\n1 2 3\n4 5 6\n",
        "//X,Y,Z,R,G,B\n1,2,3,255,0,0\n4,5,6,0,0,255\n",
        "1 2 3 # one, and a comma\n4 5 6\n",
        "1,2,3,\n4,5,6,\n",
        "timestamp,x,y,z\n10:00:01,1,2,3\n10:00:02,4,5,6\n",
        "z y x label\n3 2 1 car\n6 5 4 car\n",
        "\ufeffx;y;z\n1;2;3\n4;5;6\n",
        "1\t\t2\t\t3\n4\t\t5\t\t6\n",
        "2\n\n1e0 +2 3\n4 5 6\n",
    ],
)
def test_what_programs_write_around_points_is_understood(tmp_path: Path, text: str) -> None:
    (tmp_path / "cloud.csv").write_text(text, encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        points = load_point_cloud(tmp_path / "cloud.csv").points
    np.testing.assert_array_equal(points, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])


@pytest.mark.parametrize(
    "text",
    [
        "x,y,z\n1,2,3\n,,\n",
        "x,y,z,r\n,,,7\n1,2,3,7\n",
        "x\ty\tz\tr\n\t\t\t255\n1\t2\t3\t4\n",
        "nan nan nan\n1 2 3\n",
        "1 2 3\n-inf 0 0\n",
    ],
)
def test_cells_without_a_number_are_counted(tmp_path: Path, text: str) -> None:
    (tmp_path / "cloud.csv").write_text(text)
    with pytest.warns(RuntimeWarning, match="1 of 2 points are not finite and were dropped"):
        np.testing.assert_array_equal(load_point_cloud(tmp_path / "cloud.csv").points, [[1.0, 2.0, 3.0]])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a,b,c,d\n1,2,3,4\n", "its columns are a, b, c, d, none of them x, y and z"),
        ("1 2 three\n4 5 6\n", "'1 2 three' is neither titles nor a point; allowed: x y z and more"),
        ("a wall\nand a table\n", "line 1 is 'a wall'; allowed: x y z and more"),
        ("1 2 3; 4 5 6\n", "line 1 is '1 2 3; 4 5 6'; allowed: x y z and more"),
        ("1,2,3\n4,5\n", "line 2 is '4,5', with 2 of the 3 columns that are needed$"),
        ("# made\n\n1 2 3\n\n4 5\n", "line 5 is '4 5', with 2 of the 3 columns that are needed$"),
        ("1 2 3\nhello world x\n", "line 2 is 'hello world x'; 'hello' is no number$"),
        ("1;2;3\n4;5;six\n", "line 2 is '4;5;six'; 'six' is no number$"),
        ("1 2 3 4 5 6\n" * 3, r"its points have shape \(3, 6\) and look transposed"),
    ],
)
def test_lines_that_are_no_points_are_never_passed_over(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "cloud.csv").write_text(text)
    with pytest.raises(ValueError, match=rf"cloud\.csv' cannot be read: {message}"):
        load_point_cloud(tmp_path / "cloud.csv")
