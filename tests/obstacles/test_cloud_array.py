"""NumPy files of every layout."""

import pickle
import re
from pathlib import Path

import numpy as np
import pytest

from sidestep.obstacles import load_point_cloud

POINTS = np.random.default_rng(7).uniform(-1.0, 1.0, (50, 3)).astype(np.float32)


@pytest.mark.parametrize(
    "array",
    [
        POINTS.reshape(5, 10, 3),
        np.column_stack([POINTS, np.ones((50, 1))]),
        np.column_stack([POINTS, np.ones((50, 4))]).reshape(10, 5, 7),
        np.asfortranarray(POINTS),
        POINTS.astype(">f8"),
        np.rec.fromarrays(POINTS[:, [2, 0, 1]].T, names="Z,X,Y"),
        np.rec.fromarrays([*POINTS.T, np.ones(50)], names="x,y,z,rgb").reshape(5, 10),
    ],
    ids=["image", "homogeneous", "wide image", "columns", "big endian", "named", "named image"],
)
@pytest.mark.parametrize("suffix", ["npy", "npz"])
def test_arrays_of_every_layout_give_the_same_points(tmp_path: Path, array: np.ndarray, suffix: str) -> None:
    path = tmp_path / f"cloud.{suffix}"
    if suffix == "npy":
        np.save(path, array)
    else:
        np.savez_compressed(path, points=array, colours=np.ones(3))
    np.testing.assert_array_equal(load_point_cloud(path).points, POINTS)


def test_half_precision_is_read_as_it_is(tmp_path: Path) -> None:
    np.save(tmp_path / "cloud.npy", POINTS.astype(np.float16))
    np.testing.assert_array_equal(load_point_cloud(tmp_path / "cloud.npy").points, POINTS.astype(np.float16))


def test_archives_and_records_without_points_say_what_they_hold(tmp_path: Path) -> None:
    np.savez(tmp_path / "two.npz", a=POINTS, b=POINTS)
    with pytest.raises(ValueError, match="it holds a, b; allowed: one array, or one called points or xyz"):
        load_point_cloud(tmp_path / "two.npz")
    np.save(tmp_path / "uv.npy", np.rec.fromarrays(POINTS.T, names="u,v,w"))
    with pytest.raises(ValueError, match="it has no fields x, y, z; its fields are u, v, w"):
        load_point_cloud(tmp_path / "uv.npy")


def test_a_field_or_an_array_may_be_called_xyz(tmp_path: Path) -> None:
    named = np.zeros(50, dtype=[("rgb", "u1", 3), ("xyz", "f4", 3)])
    named["xyz"] = POINTS
    np.save(tmp_path / "named.npy", named)
    np.testing.assert_array_equal(load_point_cloud(tmp_path / "named.npy").points, POINTS)
    np.savez(tmp_path / "xyz.npz", rgb=np.ones((50, 3)), xyz=POINTS)
    np.testing.assert_array_equal(load_point_cloud(tmp_path / "xyz.npz").points, POINTS)
    np.savez(tmp_path / "single.npz", anything=POINTS)
    np.testing.assert_array_equal(load_point_cloud(tmp_path / "single.npz").points, POINTS)


def test_images_of_a_camera_lose_their_holes(tmp_path: Path) -> None:
    image = POINTS.reshape(10, 5, 3).copy()
    image[::2, 3] = np.nan
    np.save(tmp_path / "image.npy", image)
    with pytest.warns(RuntimeWarning, match="5 of 50 points are not finite and were dropped"):
        points = load_point_cloud(tmp_path / "image.npy").points
    np.testing.assert_array_equal(points, image.reshape(-1, 3)[np.isfinite(image).all(axis=2).ravel()])


def test_integers_are_numbers(tmp_path: Path) -> None:
    np.save(tmp_path / "mm.npy", np.array([[1200, -20, 300], [5, 6, 7]], dtype=np.int16))
    points = load_point_cloud(tmp_path / "mm.npy", scale=0.001).points
    np.testing.assert_allclose(points, [[1.2, -0.02, 0.3], [0.005, 0.006, 0.007]], rtol=1e-15)  # a rounding


@pytest.mark.parametrize("suffix", ["npy", "npz"])
@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.array([[1, None, 2]]), "it holds Python objects, which are never unpickled; save numbers"),
        (np.zeros(2, [("x", "O"), ("y", "f4"), ("z", "f4")]), "it holds Python objects, which are never"),
        (np.ones((2, 3), complex), "does not hold an array of real numbers, its type is complex128"),
        (np.ones((2, 3), bool), "does not hold an array of real numbers, its type is bool"),
        (np.zeros((0, 3)), "holds no point; where nothing is seen, use Obstacles.none()"),
        (np.array([]), "holds no point; where nothing is seen, use Obstacles.none()"),
        (np.ones((3, 48, 64)), "the coordinates come first: save numpy.moveaxis(array, 0, -1)"),
        (np.ones((48, 64), np.uint16), "a depth image holds no points: turn it into some by the camera's"),
        (np.ones((3, 10)), "(3, 10) and look transposed; they stand in columns: save array.T; if every"),
        (np.ones((6, 10)), "(6, 10) and look transposed"),
        (np.ones((3, 5)), "(3, 5) and look transposed"),
        (
            np.ones((3, 5, 10)),
            "look transposed; the coordinates come first: save numpy.moveaxis(array, 0, -1)",
        ),
        (np.ones(3), "have shape (3,), expected (N, 3) or (H, W, 3), or up to 16 columns beginning with"),
    ],
)
def test_arrays_that_hold_no_points_are_refused(
    tmp_path: Path, array: np.ndarray, message: str, suffix: str
) -> None:
    path = tmp_path / f"cloud.{suffix}"
    (np.save if suffix == "npy" else np.savez)(path, array)
    with pytest.raises(ValueError, match=re.escape(message)):
        load_point_cloud(path)


class Trap:
    """Tells when it is unpickled."""

    def __reduce__(self) -> tuple[object, ...]:
        return pytest.fail, ("unpickled",)


def test_nothing_is_unpickled(tmp_path: Path) -> None:
    (tmp_path / "pickle.npy").write_bytes(pickle.dumps(Trap()))
    with pytest.raises(ValueError, match=r"it is no NumPy file; write it by numpy\.save"):
        load_point_cloud(tmp_path / "pickle.npy")
    np.save(tmp_path / "trap.npy", np.array([Trap()], dtype=object), allow_pickle=True)
    with pytest.raises(ValueError, match="never unpickled"):
        load_point_cloud(tmp_path / "trap.npy")
    np.savez(tmp_path / "archive.npz", points=POINTS)
    (tmp_path / "archive.npz").rename(tmp_path / "archive.npy")
    with pytest.raises(ValueError, match=r"its suffix must be \.npz"):
        load_point_cloud(tmp_path / "archive.npy")


def test_an_archive_that_announces_more_than_it_holds_is_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "cloud.npz", POINTS)
    content = (tmp_path / "cloud.npz").read_bytes()
    old, new = b"(50, 3), }" + b" " * 9, b"(99999999999, 3), }"
    assert old in content
    (tmp_path / "cloud.npz").write_bytes(content.replace(old, new))
    with pytest.raises(ValueError, match=r"which is more than its bytes hold|it is damaged or cut short"):
        load_point_cloud(tmp_path / "cloud.npz")


@pytest.mark.parametrize("shape", [(3, 3), (3, 4), (3, 10, 3), (2, 6), (7, 6)])
def test_few_points_are_read_where_rows_can_be_points(tmp_path: Path, shape: tuple[int, ...]) -> None:
    array = np.random.default_rng(3).uniform(-1.0, 1.0, shape)
    np.save(tmp_path / "few.npy", array)
    points = load_point_cloud(tmp_path / "few.npy").points
    np.testing.assert_array_equal(points, array.reshape(-1, shape[-1])[:, :3])


def test_an_archive_that_is_damaged_says_so(tmp_path: Path) -> None:
    np.savez_compressed(tmp_path / "cloud.npz", points=POINTS)
    content = (tmp_path / "cloud.npz").read_bytes()
    middle = len(content) // 2
    for damaged in (content[:middle], content[:middle] + bytes(20) + content[middle + 20 :], b""):
        (tmp_path / "cloud.npz").write_bytes(damaged)
        with pytest.raises(
            ValueError, match=r"cloud\.npz' cannot be read: it is no NumPy archive, or it is damaged"
        ):
            load_point_cloud(tmp_path / "cloud.npz")
