"""Point-cloud files of every encoding, bad files, and thinning that loses nothing."""

import re
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from pypcd4.pypcd4 import Encoding, PointCloud

from sidestep.obstacles import load_point_cloud, merge_in_voxels

POINTS = np.random.default_rng(7).uniform(-1.0, 1.0, (50, 3)).astype(np.float32)


def write_ply_ascii(path: Path, points: np.ndarray) -> None:
    head = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n"
    head += "".join(f"property float {c}\n" for c in "xyz") + "end_header\n"
    path.write_text(head + "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in points.astype(float).tolist()))


def ply_binary_writer(order: str) -> Callable[[Path, np.ndarray], None]:
    def write(path: Path, points: np.ndarray) -> None:
        name = {"<": "little", ">": "big"}[order]
        head = f"ply\nformat binary_{name}_endian 1.0\ncomment a depth camera\nelement vertex {len(points)}\n"
        # a colour between the coordinates and the next point, as cameras write it
        head += "".join(f"property float {c}\n" for c in "xyz") + "property uchar red\nend_header\n"
        body = b"".join(struct.pack(f"{order}fffB", *point, 200) for point in points)
        path.write_bytes(head.encode() + body)

    return write


def pcd_writer(encoding: Encoding) -> Callable[[Path, np.ndarray], None]:
    def write(path: Path, points: np.ndarray) -> None:
        intensity = np.linspace(0.0, 1.0, len(points), dtype=np.float32)
        PointCloud.from_xyzi_points(np.column_stack([points, intensity])).save(path, encoding=encoding)

    return write


WRITERS: dict[str, tuple[str, Callable[[Path, np.ndarray], None]]] = {
    "ply ascii": ("cloud.ply", write_ply_ascii),
    "ply little endian": ("cloud.ply", ply_binary_writer("<")),
    "ply big endian": ("cloud.ply", ply_binary_writer(">")),
    "pcd ascii": ("cloud.pcd", pcd_writer(Encoding.ASCII)),
    "pcd binary": ("cloud.pcd", pcd_writer(Encoding.BINARY)),
    "pcd compressed": ("cloud.pcd", pcd_writer(Encoding.BINARY_COMPRESSED)),
    "npy": ("cloud.NPY", lambda path, points: np.save(path.open("wb"), points)),
}


@pytest.fixture(params=WRITERS)
def written(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[[np.ndarray], Path]:
    name, writer = WRITERS[request.param]

    def write(points: np.ndarray) -> Path:
        writer(tmp_path / name, points)
        return tmp_path / name

    return write


def test_points_come_back_as_written(written: Callable[[np.ndarray], Path]) -> None:
    obstacles = load_point_cloud(written(POINTS), radius=0.01)
    # single precision goes through binary files unchanged; ASCII PCD is written with fewer digits
    np.testing.assert_allclose(obstacles.points, POINTS, rtol=0.0, atol=1e-6)
    np.testing.assert_array_equal(obstacles.radii, np.full(50, 0.01))
    np.testing.assert_array_equal(obstacles.velocities, np.zeros((50, 3)))


def test_points_that_are_not_finite_are_never_dropped_in_silence(
    written: Callable[[np.ndarray], Path],
) -> None:
    holes = POINTS.copy()
    holes[[3, 17]] = np.nan
    path = written(holes)
    with pytest.raises(
        ValueError, match=r"2 of 50 points are not finite, the first is point 3; invalid='drop'"
    ):
        load_point_cloud(path, invalid="raise")
    with pytest.warns(RuntimeWarning, match="2 of 50 points are not finite and were dropped"):
        obstacles = load_point_cloud(path)
    np.testing.assert_allclose(obstacles.points, np.delete(POINTS, [3, 17], axis=0), rtol=0.0, atol=1e-6)


def test_a_cloud_of_invalid_points_only_is_empty(tmp_path: Path) -> None:
    np.save(tmp_path / "blind.npy", np.full((4, 3), np.nan))
    with pytest.raises(ValueError, match=r"no point that can be used: 4 of 4 points are not finite$"):
        load_point_cloud(tmp_path / "blind.npy", invalid="drop")


def test_truncated_files_are_refused(written: Callable[[np.ndarray], Path]) -> None:
    path = written(POINTS)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) - 60])
    with pytest.raises(ValueError, match=rf"point cloud '.*{path.name}' cannot be read: ."):
        load_point_cloud(path)


def test_clouds_that_are_not_in_metres_are_warned_of(
    tmp_path: Path, recwarn: pytest.WarningsRecorder
) -> None:
    np.save(tmp_path / "mm.npy", 1000.0 * POINTS)
    with pytest.warns(RuntimeWarning, match=r"mm\.npy': half of its points are farther than .*scale=0\.001"):
        load_point_cloud(tmp_path / "mm.npy")
    recwarn.clear()
    scaled = load_point_cloud(tmp_path / "mm.npy", scale=0.001)
    np.testing.assert_allclose(scaled.points, POINTS, rtol=1e-6)
    assert not recwarn.list
    np.save(tmp_path / "all.npy", 1000.0 * (POINTS + 2.0))
    with pytest.warns(RuntimeWarning) as caught:
        load_point_cloud(tmp_path / "all.npy")
    assert len(caught) == 1  # said once, with the file's name
    assert "all.npy" in str(caught[0].message)
    for scale in (0.0, -1.0, float("nan")):
        with pytest.raises(ValueError, match=f"scale is {scale}, must be positive and finite"):
            load_point_cloud(tmp_path / "mm.npy", scale=scale)


def test_a_few_points_that_are_far_are_warned_of_and_those_that_are_nowhere_are_dropped(
    tmp_path: Path,
) -> None:
    far = POINTS.astype(float)
    far[7] = 2e3, 0.0, 0.0
    np.save(tmp_path / "far.npy", far)
    with pytest.warns(RuntimeWarning, match=r"1 of 50 points are farther than 100 m: one is at \[2000\."):
        np.testing.assert_array_equal(load_point_cloud(tmp_path / "far.npy").points, far)
    far[[9, 11], 1] = 1e30, np.nan
    np.save(tmp_path / "nowhere.npy", far)
    with pytest.warns(RuntimeWarning) as caught:
        obstacles = load_point_cloud(tmp_path / "nowhere.npy")
    np.testing.assert_array_equal(obstacles.points, np.delete(far, [9, 11], axis=0))
    (warning,) = caught
    for words in (
        "1 of 50 points are not finite and 1 of 50 points are farther than 1e+07 m (point 9 is at [",
        "1.0000e+30",
        "were dropped; 1 of 48 points are farther than 100 m: one is at [2000.",
    ):
        assert words in str(warning.message)
    with pytest.raises(ValueError, match="the first is point 9; invalid='drop' leaves them out"):
        load_point_cloud(tmp_path / "nowhere.npy", invalid="raise")
    np.save(tmp_path / "all.npy", np.full((3, 3), 1e30))
    with pytest.raises(ValueError, match="no point that can be used: 3 of 3 points are farther than 1e"):
        load_point_cloud(tmp_path / "all.npy")


def test_a_scale_that_leaves_nothing_and_zeros_of_cameras_are_warned_of(tmp_path: Path) -> None:
    np.save(tmp_path / "metres.npy", POINTS)
    with pytest.warns(RuntimeWarning, match=r"no point is farther than 0\.000.* m; is the scale meant for"):
        load_point_cloud(tmp_path / "metres.npy", scale=0.001)
    holes = np.concatenate([POINTS, np.zeros((3, 3))])
    np.save(tmp_path / "zeros.npy", holes)
    with pytest.warns(RuntimeWarning, match=r"3 of 53 points are exactly \(0, 0, 0\) and were kept"):
        np.testing.assert_array_equal(load_point_cloud(tmp_path / "zeros.npy").points, holes)


def swapped(path: Path, old: bytes, new: bytes) -> Path:
    content = path.read_bytes()
    assert old in content
    path.write_bytes(content.replace(old, new, 1))
    return path


@pytest.mark.parametrize("encoding", list(Encoding)[:3])
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"COUNT 1 1 1 1", b"COUNT 1 1 1 99999999999", r"50 points of 100000000002 numbers \(COUNT 1 1 1 9"),
        (b"COUNT 1 1 1 1", b"COUNT 99999999 1 1 1", "which is more than the .* bytes of the file hold"),
        (b"COUNT 1 1 1 1", b"COUNT 1 1 1 -1", r"COUNT is \[1, 1, 1, -1\]; it must be a positive number for"),
        (
            b"COUNT 1 1 1 1",
            b"COUNT 1",
            r"COUNT is \[1\]; it must be a positive number for each of the FIELDS",
        ),
        (b"POINTS 50", b"POINTS 99999999999", "announces 99999999999 points of 4 numbers"),
        (b"WIDTH 50", b"WIDTH 99999999999", "announces 99999999999 points of 4 numbers"),
        (b"HEIGHT 1", b"HEIGHT 999999999", "announces 49999999950 points of 4 numbers"),
        (b"POINTS 50", b"POINTS -50", "POINTS is '-50', must be a whole number"),
        (b"POINTS 50", b"POINTS 5e1", "POINTS is '5e1', must be a whole number"),
    ],
)
def test_a_pcd_file_that_announces_more_than_it_holds_is_refused_at_once(
    tmp_path: Path, encoding: Encoding, old: bytes, new: bytes, message: str
) -> None:
    pcd_writer(encoding)(tmp_path / "cloud.pcd", POINTS)
    with pytest.raises(ValueError, match=rf"point cloud '.*cloud\.pcd' cannot be read: .*{message}"):
        load_point_cloud(swapped(tmp_path / "cloud.pcd", old, new))


@pytest.mark.parametrize("writer", [write_ply_ascii, ply_binary_writer("<")])
@pytest.mark.parametrize(
    ("new", "message"),
    [
        (b"element vertex 99999999999", "99999999999 of element vertex, which is more than the .* bytes of"),
        (b"element vertex -50", "its header says 'element vertex -50'; it must be: element NAME NUMBER"),
        (b"element camera 99999999999\nproperty float f\nelement vertex 50", "99999999999 of element camera"),
        (b"element nothing 99999999999\nelement vertex 50", "99999999999 of element nothing"),
    ],
)
def test_a_ply_file_that_announces_more_than_it_holds_is_refused_at_once(
    tmp_path: Path, writer: Callable[[Path, np.ndarray], None], new: bytes, message: str
) -> None:
    writer(tmp_path / "cloud.ply", POINTS)
    with pytest.raises(ValueError, match=rf"point cloud '.*cloud\.ply' cannot be read: .*{message}"):
        load_point_cloud(swapped(tmp_path / "cloud.ply", b"element vertex 50", new))


def test_a_header_without_end_is_refused(tmp_path: Path) -> None:
    (tmp_path / "cloud.ply").write_bytes(b"ply\nformat ascii 1.0\n" + b"comment x\n" * 10)
    with pytest.raises(ValueError, match="its header has no line end_header within 65536 bytes"):
        load_point_cloud(tmp_path / "cloud.ply")


def test_an_array_that_announces_more_than_it_holds_is_refused_at_once(tmp_path: Path) -> None:
    np.save(tmp_path / "cloud.npy", POINTS)
    swapped(tmp_path / "cloud.npy", b"(50, 3), }" + b" " * 9, b"(99999999999, 3), }")
    with pytest.raises(ValueError, match=r"it is cut short: it announces an array \(99999999999, 3\)"):
        load_point_cloud(tmp_path / "cloud.npy")


def test_a_pcd_file_with_rows_left_out_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "cloud.pcd"
    pcd_writer(Encoding.ASCII)(path, POINTS)
    path.write_text("\n".join(path.read_text().splitlines()[:-5]) + "\n")
    with pytest.raises(ValueError, match="announces 50 points and holds 45"):
        load_point_cloud(path)


def test_files_that_are_no_cloud_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"absent\.ply' does not exist"):
        load_point_cloud(tmp_path / "absent.ply")
    (tmp_path / "cloud.las").write_text("0 0 0\n")
    with pytest.raises(ValueError, match=r"suffix '\.las', must be one of \.ply, \.pcd, \.npy, \.npz, \.txt"):
        load_point_cloud(tmp_path / "cloud.las")
    trimesh.creation.box().export(tmp_path / "mesh.ply")
    with pytest.raises(ValueError, match="it is a mesh of 12 faces"):
        load_point_cloud(tmp_path / "mesh.ply")
    for name in ("cloud.ply", "cloud.pcd", "cloud.npy"):
        (tmp_path / name).write_bytes(b"nonsense\n")
        with pytest.raises(ValueError, match=f"{name}' cannot be read"):
            load_point_cloud(tmp_path / name)
    for shape in ((5, 2), (3, 50), (5, 17), (3,), (2, 2, 2, 3), (3, 48, 64), ()):
        np.save(tmp_path / "odd.npy", np.zeros(shape))
        with pytest.raises(
            ValueError, match=rf"shape {re.escape(str(shape))}, expected \(N, 3\) or \(H, W, 3\)"
        ):
            load_point_cloud(tmp_path / "odd.npy")
    np.save(tmp_path / "turned.npy", POINTS.T)
    with pytest.raises(ValueError, match=r"they stand in columns: save array\.T"):
        load_point_cloud(tmp_path / "turned.npy")
    np.save(tmp_path / "text.npy", np.array([["a", "b", "c"]]))
    with pytest.raises(ValueError, match="does not hold an array of real numbers"):
        load_point_cloud(tmp_path / "text.npy")
    np.save(tmp_path / "objects.npy", np.array([[object()] * 3]), allow_pickle=True)
    with pytest.raises(ValueError, match=r"objects\.npy' cannot be read"):
        load_point_cloud(tmp_path / "objects.npy")
    np.save(tmp_path / "empty.npy", np.zeros((0, 3)))
    with pytest.raises(ValueError, match="holds no point"):
        load_point_cloud(tmp_path / "empty.npy")
    np.save(tmp_path / "good.npy", POINTS)
    with pytest.raises(ValueError, match="invalid is 'ignore', must be 'raise' or 'drop'"):
        load_point_cloud(tmp_path / "good.npy", invalid="ignore")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"radius -0\.5"):
        load_point_cloud(tmp_path / "good.npy", radius=-0.5)


def test_a_pcd_file_without_coordinates_names_its_fields(tmp_path: Path) -> None:
    cloud = PointCloud.from_points(POINTS[:, :2], ("x", "intensity"), (np.float32, np.float32))
    cloud.save(tmp_path / "flat.pcd")
    with pytest.raises(ValueError, match="it has no field y, z; its fields are x, intensity"):
        load_point_cloud(tmp_path / "flat.pcd")


def test_a_file_can_be_merged_as_it_is_read(tmp_path: Path) -> None:
    np.save(tmp_path / "cloud.npy", POINTS)
    obstacles = load_point_cloud(tmp_path / "cloud.npy", radius=0.01, voxel=0.5)
    centres, reach = merge_in_voxels(POINTS, 0.01, voxel=0.5)
    np.testing.assert_array_equal(obstacles.points, centres)
    np.testing.assert_array_equal(obstacles.radii, reach)
    with pytest.raises(ValueError, match="voxel is 0"):
        load_point_cloud(tmp_path / "cloud.npy", voxel=0.0)


@pytest.mark.parametrize("suffix", ["npy", "npz", "ply", "pcd", "csv", "xyz"])
def test_a_git_lfs_pointer_is_named_as_such(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"cloud.{suffix}"
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:aa\nsize 12345\n")
    with pytest.raises(ValueError, match=rf"'.*cloud\.{suffix}' is a Git LFS pointer, .*run `git lfs pull`"):
        load_point_cloud(path)


def test_every_cut_of_a_file_is_one_clear_error(written: Callable[[np.ndarray], Path]) -> None:
    path = written(POINTS)
    content = path.read_bytes()
    for size in range(0, len(content) - 16, 37):
        path.write_bytes(content[:size])
        with pytest.raises(ValueError, match=f"point cloud '.*{path.name}'") as caught:
            load_point_cloud(path)
        words = str(caught.value)
        assert "\n" not in words
        for foreign in ("mmap", "zip file", "pydantic", "http", "buffer", "numpy.core", "invalid literal"):
            assert foreign not in words, words
