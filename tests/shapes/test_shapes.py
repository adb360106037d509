"""Shapes: poses, exact samples, and the covering radius that is promised."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from sidestep.obstacles import Box, Capsule, Cylinder, MeshShape, Plane, Shape, Sphere, pose_at

ROUNDING = 1e-9  # [m] samples are computed in double precision at the scale of a metre


def tilted_pose() -> np.ndarray:
    pose = pose_at([0.4, -0.2, 0.7])
    pose[:3, :3] = Rotation.from_euler("xyz", [0.3, -0.8, 1.1]).as_matrix()
    return pose


@pytest.fixture
def l_shape(tmp_path: Path) -> Path:
    """A mesh file in millimetres with long thin triangles: a plate and a post side by side."""
    plate = trimesh.creation.box(extents=[400.0, 10.0, 300.0])
    post = trimesh.creation.cylinder(radius=20.0, height=250.0, sections=16)
    post.apply_translation([0.0, 120.0, 0.0])
    path = tmp_path / "l.stl"
    trimesh.util.concatenate([plate, post]).export(path)
    return path


def shape_named(name: str, l_shape: Path) -> Shape:
    pose = tilted_pose()
    return {
        "sphere": Sphere(0.13, pose=pose),
        "box": Box((0.31, 0.02, 0.17), pose=pose),
        "cylinder": Cylinder(0.06, 0.4, pose=pose),
        "thin cylinder": Cylinder(0.004, 0.4, pose=pose),
        "capsule": Capsule(0.05, 0.3, pose=pose),
        "plane": Plane([0.4, -0.2, 0.7], [0.3, -0.8, -0.5], extent=0.3),
        "mesh": MeshShape(l_shape, scale=0.001, pose=pose),
    }[name]


NAMES = ["sphere", "box", "cylinder", "thin cylinder", "capsule", "plane", "mesh"]


def dense_surface(shape: Shape, count: int = 20000) -> np.ndarray:
    """Random points exactly on the shape, by a second route: triangles pushed out to the curved surface."""
    points = np.asarray(trimesh.sample.sample_surface(shape.mesh(), count, seed=3)[0])
    local = (points - shape.pose[:3, 3]) @ shape.pose[:3, :3]
    if isinstance(shape, Sphere):
        local *= (shape.radius / np.linalg.norm(local, axis=1))[:, None]
    if isinstance(shape, Cylinder):
        on_side = np.abs(local[:, 2]) < 0.5 * shape.length - ROUNDING
        local[on_side, :2] *= (shape.radius / np.linalg.norm(local[on_side, :2], axis=1))[:, None]
    if isinstance(shape, Capsule):
        out = local.copy()
        out[:, 2] -= np.clip(local[:, 2], -0.5 * shape.length, 0.5 * shape.length)
        local += out * (shape.radius / np.linalg.norm(out, axis=1) - 1.0)[:, None]
    if isinstance(shape, Plane):  # its face alone
        local = local[np.abs(local[:, 2]) < ROUNDING]
    return local @ shape.pose[:3, :3].T + shape.pose[:3, 3]


@pytest.mark.parametrize("spacing", [0.05, 0.02, 0.008])
@pytest.mark.parametrize("name", NAMES)
def test_every_surface_point_is_within_the_spacing_of_a_sample(
    name: str, spacing: float, l_shape: Path
) -> None:
    shape = shape_named(name, l_shape)
    distances, _ = cKDTree(shape.sample(spacing)).query(dense_surface(shape))
    assert distances.max() <= spacing + ROUNDING
    # the samples are not wastefully dense either: some surface point uses at least a third of the spacing
    # (a thin part smaller than the spacing needs points closer than that, so it is left out)
    if name != "thin cylinder":
        assert distances.max() >= spacing / 3.0


@pytest.mark.parametrize("name", NAMES)
def test_samples_lie_on_the_surface(name: str, l_shape: Path) -> None:
    shape = shape_named(name, l_shape)
    samples = (shape.sample(0.02) - shape.pose[:3, 3]) @ shape.pose[:3, :3]
    match shape:
        case Sphere(radius=radius):
            off = np.abs(np.linalg.norm(samples, axis=1) - radius)
        case Box(size=size):
            off = np.abs((np.abs(samples) - 0.5 * np.asarray(size)).max(axis=1))
        case Cylinder(radius=radius, length=length):
            radial = np.linalg.norm(samples[:, :2], axis=1) - radius
            off = np.abs(np.maximum(radial, np.abs(samples[:, 2]) - 0.5 * length))
        case Capsule(radius=radius, length=length):
            samples[:, 2] -= np.clip(samples[:, 2], -0.5 * length, 0.5 * length)
            off = np.abs(np.linalg.norm(samples, axis=1) - radius)
        case Plane(extent=extent):
            off = np.maximum(np.abs(samples[:, 2]), np.abs(samples).max(axis=1) - extent)
        case _:
            off = np.abs(trimesh.proximity.closest_point_naive(shape.mesh(), shape.sample(0.02)[:200])[1])
    assert off.max() < ROUNDING


def test_a_box_has_its_corners_among_the_samples() -> None:
    samples = Box((0.3, 0.2, 0.1)).sample(0.05)
    for corner in np.array(np.meshgrid([-0.15, 0.15], [-0.1, 0.1], [-0.05, 0.05])).reshape(3, -1).T:
        assert np.linalg.norm(samples - corner, axis=1).min() < ROUNDING
    assert len(np.unique(samples, axis=0)) == len(samples)


def test_a_scale_below_zero_mirrors_as_in_urdf(l_shape: Path) -> None:
    plain, mirrored = MeshShape(l_shape, 0.001).mesh(), MeshShape(l_shape, (0.001, -0.001, 0.001)).mesh()
    np.testing.assert_allclose(mirrored.bounds[:, 1], -plain.bounds[::-1, 1], atol=ROUNDING)
    np.testing.assert_allclose(mirrored.bounds[:, [0, 2]], plain.bounds[:, [0, 2]], atol=ROUNDING)
    assert mirrored.volume == pytest.approx(plain.volume)  # its triangles look outwards still
    centres, radii = MeshShape(l_shape, (0.001, -0.001, 0.001)).balls()
    assert (centres[:, 1] - radii).min() >= mirrored.bounds[0, 1] - 0.002 - ROUNDING  # the excess


def test_a_mesh_is_scaled_and_placed(l_shape: Path) -> None:
    mesh = MeshShape(l_shape, scale=0.001, pose=pose_at([1.0, 2.0, 3.0])).mesh()
    np.testing.assert_allclose(
        mesh.bounds[0], [1.0 - 0.2, 2.0 - 0.005, 3.0 - 0.15], atol=1e-6
    )  # STL is float32
    np.testing.assert_allclose(mesh.bounds[1], [1.0 + 0.2, 2.0 + 0.14, 3.0 + 0.15], atol=1e-6)


def test_bad_shapes_are_refused_with_the_value(tmp_path: Path, l_shape: Path) -> None:
    with pytest.raises(ValueError, match=r"sphere: radius is -0\.1, must be positive"):
        Sphere(-0.1)
    with pytest.raises(ValueError, match=r"sphere: radius is \(0, 0, 0\), must be positive"):
        Sphere((0, 0, 0))  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="box: size must be an array of real numbers"):
        Box("abc")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="box: size y is nan"):
        Box((1.0, np.nan, 1.0))
    with pytest.raises(ValueError, match=r"box: size is \(1\.0, 1\.0\), must be three lengths"):
        Box((1.0, 1.0))
    with pytest.raises(ValueError, match=r"cylinder: length is 0\.0"):
        Cylinder(0.1, 0.0)
    with pytest.raises(ValueError, match=r"pose has shape \(3,\), expected \(4, 4\)"):
        Sphere(0.1, pose=np.zeros(3))
    with pytest.raises(ValueError, match="pose is not a rigid transform"):
        Box((1.0, 1.0, 1.0), pose=np.diag([2.0, 1.0, 1.0, 1.0]))
    with pytest.raises(FileNotFoundError, match=r"absent\.stl' does not exist"):
        MeshShape(tmp_path / "absent.stl")
    with pytest.raises(ValueError, match="scale is 0, must be"):
        MeshShape(l_shape, scale=0)
    (tmp_path / "broken.obj").write_text("no mesh in here")
    with pytest.raises(ValueError, match=r"broken\.obj"):
        MeshShape(tmp_path / "broken.obj").mesh()


def test_errors_say_which_shape_it_is(l_shape: Path) -> None:
    with pytest.raises(ValueError, match=r"box 'table': size z is -1\.0, must be positive"):
        Box((1.0, 1.0, -1.0), name="table")
    with pytest.raises(
        ValueError, match=r"sphere: velocity is \[0\.0, nan, 0\.0\], must be three finite numbers"
    ):
        Sphere(0.1, velocity=[0.0, np.nan, 0.0])
    with pytest.raises(ValueError, match=r"capsule 'rod': length is 0, must be positive"):
        Capsule(0.1, 0, name="rod")
    with pytest.raises(ValueError, match=r"plane 'floor': normal is zero"):
        Plane([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], name="floor")
    with pytest.raises(ValueError, match=r"plane: point is \[0\.0, 0\.0\], must be three"):
        Plane([0.0, 0.0], [0.0, 0.0, 1.0])
    with pytest.raises(ValueError, match="plane: extent is inf"):
        Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], extent=np.inf)
    with pytest.raises(ValueError, match=r"mesh 'part': velocity is 1\.0"):
        MeshShape(l_shape, velocity=1.0, name="part")


@pytest.mark.parametrize("normal", [[0, 0, 1], [0, 0, -2], [3, 0, 0], [0.1, -0.5, 0.2], [1e-9, 0.0, -1.0]])
def test_a_plane_is_solid_against_its_normal(normal: list[float]) -> None:
    plane = Plane([0.1, 0.2, 0.3], normal, extent=2.0)
    unit = np.array(normal) / np.linalg.norm(normal)
    np.testing.assert_allclose(plane.pose[:3, 2], unit, atol=1e-12)  # rounding
    np.testing.assert_allclose((plane.mesh().vertices - plane.point) @ unit, 0.0, atol=1e-12)
    centres, radii = plane.balls(0.004)
    assert ((centres - plane.point) @ unit + radii).max() <= 0.004 + 1e-12
    assert ((centres - plane.point) @ unit).max() < -1.9


def test_the_square_of_a_plane_is_where_the_arm_is_not_where_the_point_is() -> None:
    far = Plane([0.0, 30.0, -0.1], [0.0, 0.0, 1.0], extent=1.0)
    np.testing.assert_allclose(far.pose[:3, 3], [0.0, 0.0, -0.1], atol=1e-12)
    other = Plane([0.0, 30.0, -0.1], [0.0, 0.0, 1.0], around=[2.0, 3.0, 4.0])
    np.testing.assert_allclose(other.pose[:3, 3], [2.0, 3.0, -0.1], atol=1e-12)
    np.testing.assert_allclose(far.mesh().bounds, [[-1.0, -1.0, -0.1], [1.0, 1.0, -0.1]], atol=1e-12)
    with pytest.raises(ValueError, match="plane 'floor': around is"):
        Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], around=[0.0], name="floor")


def test_a_spacing_that_would_fill_the_memory_is_refused(l_shape: Path) -> None:
    with pytest.raises(ValueError, match="is the shape in metres"):
        MeshShape(l_shape).sample(0.02)  # a file in millimetres without its scale
    with pytest.raises(ValueError, match="spacing is 0"):
        Sphere(0.1).sample(0.0)


def test_a_shape_cannot_be_moved_behind_its_back() -> None:
    pose = np.eye(4)
    sphere = Sphere(0.1, pose=pose)
    pose[0, 3] = 5.0
    np.testing.assert_array_equal(sphere.centre, [0.0, 0.0, 0.0])
    with pytest.raises(ValueError, match="read-only"):
        sphere.pose[0, 3] = 1.0
