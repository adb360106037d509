"""Balls that cover shapes: no point of a surface is left out, and no ball reaches farther out than promised.

The oracle for points of the surface is trimesh's sampling of triangles, pushed out to what is round; that for the
distance of a ball from the solid is a closed form, or Coal on the exact solid.
"""

from __future__ import annotations

from pathlib import Path
from time import process_time

import coal
import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from sidestep import SceneObject
from sidestep._core import distance_to_triangles
from sidestep.distance.solid import object_solid
from sidestep.obstacles import Box, Capsule, Cylinder, MeshShape, Plane, Shape, Sphere, pose_at
from sidestep.shapes.ball_cover import EXCESS

ROUNDING = 1e-9  # [m] poses are applied in double precision at the scale of ten metres
SOLVER = 2e-6  # [m] to which Coal's iterations find distances of convex solids


def random_pose(rng: np.random.Generator) -> np.ndarray:
    return pose_at(rng.uniform(-1.0, 1.0, 3), Rotation.random(random_state=rng).as_matrix())


def surface_points(shape: Shape, rng: np.random.Generator, count: int = 20_000) -> np.ndarray:
    """Random points exactly on the shape, and the corners of its triangles."""
    mesh = shape.mesh()
    points = np.vstack([trimesh.sample.sample_surface(mesh, count, seed=rng)[0], mesh.vertices])
    local = (points - shape.pose[:3, 3]) @ shape.pose[:3, :3]
    match shape:
        case Sphere(radius=radius):
            local *= (radius / np.linalg.norm(local, axis=1))[:, None]
        case Cylinder(radius=radius, length=length):
            side = np.abs(local[:, 2]) < 0.5 * length * (1.0 - 1e-9)
            local[side, :2] *= (radius / np.linalg.norm(local[side, :2], axis=1))[:, None]
            angle = rng.uniform(0.0, 2.0 * np.pi, 2000)  # and the rims, where balls are smallest
            rim = np.column_stack(
                [radius * np.cos(angle), radius * np.sin(angle), np.full(2000, 0.5 * length)]
            )
            local = np.vstack([local, rim, -rim])
        case Capsule(radius=radius, length=length):
            axis = np.clip(local[:, 2], -0.5 * length, 0.5 * length)
            out = local - np.column_stack([np.zeros((len(local), 2)), axis])
            local += out * (radius / np.linalg.norm(out, axis=1) - 1.0)[:, None]
        case Plane(extent=extent):
            local[:, 2] = 0.0
            local[:, :2] = np.clip(local[:, :2], -extent, extent)
        case Box(size=size):  # edges: two coordinates at their ends
            on = rng.uniform(-0.5, 0.5, (3000, 3))
            free = rng.integers(0, 3, 3000)
            on[np.arange(3) != free[:, None]] = rng.choice([-0.5, 0.5], 6000)
            local = np.vstack([local, on * size])
    return local @ shape.pose[:3, :3].T + shape.pose[:3, 3]


def distance_outside(shape: Shape, points: np.ndarray) -> np.ndarray:
    """Signed distances (N,) of points from the solid: below zero inside."""
    local = (points - shape.pose[:3, 3]) @ shape.pose[:3, :3]
    match shape:
        case Sphere(radius=radius):
            return np.linalg.norm(local, axis=1) - radius
        case Box(size=size):
            past = np.abs(local) - 0.5 * np.asarray(size)
        case Cylinder(radius=radius, length=length):
            past = np.column_stack(
                [np.linalg.norm(local[:, :2], axis=1) - radius, np.abs(local[:, 2]) - 0.5 * length]
            )
        case Capsule(radius=radius, length=length):
            local[:, 2] -= np.clip(local[:, 2], -0.5 * length, 0.5 * length)
            return np.linalg.norm(local, axis=1) - radius
        case Plane():
            return local[:, 2]
        case _:
            return np.array([signed_distance(shape.mesh(), p) for p in points])
    return np.linalg.norm(np.maximum(past, 0.0), axis=1) + np.minimum(past.max(axis=1), 0.0)


def signed_distance(mesh: trimesh.Trimesh, point: np.ndarray) -> float:
    """Of a point from a closed mesh: the nearest point of all triangles, and the winding number."""
    triangles = np.array(mesh.triangles)
    nearest = trimesh.triangles.closest_point(triangles, np.tile(point, (len(triangles), 1)))
    a, b, c = (triangles[:, k] - point for k in range(3))
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    dots = [np.einsum("ij,ij->i", u, w) for u, w in ((a, b), (b, c), (c, a))]
    angles = 2.0 * np.arctan2(
        np.einsum("ij,ij->i", a, np.cross(b, c)), la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb
    )
    inside = abs(angles.sum()) > 2.0 * np.pi
    apart = float(np.linalg.norm(nearest - point, axis=1).min())
    return -apart if inside else apart


def left_out(points: np.ndarray, centres: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Those of points (N, 3) that are outside of the union of balls by more than rounding."""
    held = np.zeros(len(points), dtype=bool)
    for inside in cKDTree(points).query_ball_point(centres, radii + ROUNDING):
        held[inside] = True
    return points[~held]


def random_shape(kind: str, rng: np.random.Generator) -> Shape:
    """Lengths from a millimetre to metres, thin ones among them; large ones are thick or the balls are too many."""

    def length() -> float:
        return float(10.0 ** rng.uniform(-3.0, -0.3))

    pose = random_pose(rng)
    return {
        "sphere": lambda: Sphere(length(), pose),
        "box": lambda: Box((length(), length(), length()), pose),
        "cylinder": lambda: Cylinder(length(), length(), pose),
        "capsule": lambda: Capsule(length(), length(), pose),
        "plane": lambda: Plane(rng.normal(size=3), rng.normal(size=3), extent=5.0 * length()),
    }[kind]()


@pytest.mark.parametrize("kind", ["sphere", "box", "cylinder", "capsule", "plane"])
def test_random_shapes_are_covered_and_not_exceeded(kind: str) -> None:
    rng = np.random.default_rng(11)
    for _ in range(6):
        shape = random_shape(kind, rng)
        excess = float(10.0 ** rng.uniform(-2.5, -1.5))
        centres, radii = shape.balls(excess)
        assert len(left_out(surface_points(shape, rng), centres, radii)) == 0, shape
        assert (distance_outside(shape, centres) + radii).max() <= excess + ROUNDING, shape


def inner_points(shape: Shape, rng: np.random.Generator, count: int = 4000) -> np.ndarray:
    points = rng.uniform(*shape.mesh().bounds, (count, 3))
    return points[distance_outside(shape, points) < 0.0]


@pytest.mark.parametrize("kind", ["sphere", "box", "cylinder", "capsule"])
def test_the_inside_of_a_convex_solid_is_covered_too(kind: str) -> None:
    """Else a goal in the middle of a table, or a shape that appears around an arm, would go unseen."""
    rng = np.random.default_rng(7)
    sampled = 0
    for _ in range(12):
        shape = random_shape(kind, rng)
        inside = inner_points(shape, rng)
        sampled += len(inside)
        assert len(left_out(inside, *shape.balls(0.004))) == 0, shape
    assert sampled > 5000


# Numbers of balls with the default excess, 2 mm: a regression in them would cost control steps.
COUNTS = {
    "table": (Box((1.0, 0.6, 0.04)), 9000),
    "box": (Box((0.3, 0.3, 0.3)), 3000),
    "plate": (Box((0.3, 0.2, 0.001)), 5500),
    "crumb": (Box((0.001, 0.001, 0.001)), 1),
    "hall": (Box((4.0, 3.0, 2.5)), 55000),
    "post": (Cylinder(0.1, 0.4), 1700),
    "rod": (Cylinder(0.004, 0.4), 80),
    "coin": (Cylinder(0.05, 0.001), 850),
    "link": (Capsule(0.05, 0.4), 17),
    "floor": (Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]), 1296),
    "ball": (Sphere(5.0), 1),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", COUNTS)
def test_few_balls_suffice(name: str) -> None:
    shape, at_most = COUNTS[name]
    centres, radii = shape.balls()
    assert len(centres) == len(radii) <= at_most
    assert len(left_out(surface_points(shape, np.random.default_rng(1)), centres, radii)) == 0
    assert (distance_outside(shape, centres) + radii).max() <= EXCESS + ROUNDING


def mesh_of(name: str) -> trimesh.Trimesh:
    if name == "torus":
        return trimesh.creation.torus(0.1, 0.03, major_sections=24, minor_sections=12)
    if name == "angle":  # not convex, with long thin triangles
        outline = np.array([[0, 0], [0.3, 0], [0.3, 0.02], [0.02, 0.02], [0.02, 0.2], [0, 0.2]])
        faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])
        return trimesh.creation.extrude_triangulation(outline, faces, 0.1)
    sheet = trimesh.creation.box((0.1, 0.08, 0.02))  # open: no inside
    sheet.update_faces(np.arange(len(sheet.faces)) != 3)
    return sheet


@pytest.mark.parametrize(("name", "at_most"), [("torus", 900), ("angle", 2300), ("open box", 5500)])
def test_meshes_are_covered_and_not_exceeded(name: str, at_most: int, tmp_path: Path) -> None:
    rng, excess, scale = np.random.default_rng(5), 0.004, (0.5, 1.0, 1.5)
    mesh_of(name).export(tmp_path / "thing.stl")
    shape = MeshShape(tmp_path / "thing.stl", scale, random_pose(rng))
    centres, radii = shape.balls(excess)
    assert len(radii) <= at_most
    assert len(left_out(surface_points(shape, rng), centres, radii)) == 0
    few = rng.permutation(len(radii))[:300]
    if shape.mesh().is_watertight:
        assert radii.max() > 2.0 * excess  # they lie inside
        assert (distance_outside(shape, centres[few]) + radii[few]).max() <= excess + ROUNDING
    else:
        assert radii.max() <= excess


def test_a_changed_mesh_file_is_read_again(tmp_path: Path) -> None:
    path = tmp_path / "thing.stl"
    trimesh.creation.icosphere(2, 0.02).export(path)
    shape = MeshShape(path)
    first = shape.balls(0.005)
    again = shape.balls(0.005)
    np.testing.assert_array_equal(first[0], again[0])
    trimesh.creation.icosphere(2, 0.04).export(path)
    other = shape.balls(0.005)
    assert (np.linalg.norm(other[0], axis=1) + other[1]).max() > 0.039


@pytest.mark.parametrize("kind", ["sphere", "box", "cylinder", "capsule", "plane"])
def test_balls_are_no_farther_from_a_probe_than_the_judge_says(kind: str) -> None:
    """Coal's distance of a probe from the exact solid is that from the balls, less at most the excess."""
    rng = np.random.default_rng(3)
    shape = random_shape(kind, rng)
    centres, radii = shape.balls()
    solid = object_solid(SceneObject.from_shape("it", shape))
    pose = SceneObject.from_shape("it", shape).pose
    placed, request = coal.Transform3s(pose[:3, :3], pose[:3, 3]), coal.DistanceRequest()
    for point in surface_points(shape, rng, 100)[:100]:
        away = shape.pose[:3, 2] if kind == "plane" else point - shape.pose[:3, 3]
        probe = point + rng.uniform(0.01, 0.3) * away / np.linalg.norm(away)
        at = coal.Transform3s(np.eye(3), probe)
        exact = coal.distance(solid.shape, placed, coal.Sphere(1e-9), at, request, coal.DistanceResult())
        exact -= solid.radius
        seen = (np.linalg.norm(centres - probe, axis=1) - radii).min()
        assert exact - EXCESS - SOLVER <= seen <= exact + SOLVER


def test_what_asks_for_too_many_balls_is_refused() -> None:
    for shape in (
        Box((400.0, 10.0, 300.0)),
        Cylinder(20.0, 2500.0),
        Capsule(1e-5, 1e4),
        Plane([0, 0, 0], [0, 0, 1], extent=1e4),
    ):
        with pytest.raises(ValueError, match=r"more than 300000 balls; .* is the shape in metres"):
            shape.balls(1e-5)
    for excess in (0.0, -0.001, np.nan, np.inf):
        for shape in (Box((0.1, 0.1, 0.1)), Sphere(0.1), Capsule(0.1, 0.1)):
            with pytest.raises(ValueError, match=f"excess is {excess}, must be positive"):
                shape.balls(excess)


def tote(wall: float) -> trimesh.Trimesh:
    """A box without a lid, 0.6 x 0.4 x 0.3 m, whose walls are solid."""
    x, y, z = 0.3, 0.2, 0.3

    def ring(x: float, y: float, z: float) -> list[list[float]]:
        return [[-x, -y, z], [x, -y, z], [x, y, z], [-x, y, z]]

    corners = [
        *ring(x, y, 0.0),
        *ring(x, y, z),
        *ring(x - wall, y - wall, z),
        *ring(x - wall, y - wall, wall),
    ]
    faces = [[0, 2, 1], [0, 3, 2], [12, 13, 14], [12, 14, 15]]
    for low, high in ((0, 4), (4, 8), (8, 12)):
        for i in range(4):
            j = (i + 1) % 4
            faces += [[low + i, low + j, high + j], [low + i, high + j, high + i]]
    return trimesh.Trimesh(corners, faces)


def tote_of_parts(wall: float) -> trimesh.Trimesh:
    """The same as five overlapping boxes in one file."""
    x, y, z = 0.6, 0.4, 0.3
    sides = [((x, y, wall), (0.0, 0.0, wall / 2))]
    sides += [((wall, y, z), (s * (x - wall) / 2, 0.0, z / 2)) for s in (1, -1)]
    sides += [((x, wall, z), (0.0, s * (y - wall) / 2, z / 2)) for s in (1, -1)]
    parts = [trimesh.creation.box(size) for size, _ in sides]
    for part, (_, middle) in zip(parts, sides, strict=True):
        part.apply_translation(middle)
    return trimesh.util.concatenate(parts)


def sheet(x: float, y: float) -> trimesh.Trimesh:
    corners = [[-x / 2, -y / 2, 0.0], [x / 2, -y / 2, 0.0], [x / 2, y / 2, 0.0], [-x / 2, y / 2, 0.0]]
    return trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]])


FLAT = {  # meshes of large flat faces, and the most balls that they may take
    "tote": (tote(0.004), 72_000),
    "tote of parts": (tote_of_parts(0.004), 78_000),
    "plate": (trimesh.creation.box((0.003, 1.0, 0.6)), 38_000),
    "table": (trimesh.creation.box((1.2, 0.8, 0.04)), 22_500),
    "guard": (sheet(1.0, 1.0), 130_000),
}


@pytest.mark.parametrize("name", FLAT)
def test_large_flat_faces_are_covered_at_once_and_hollow_stays_hollow(name: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    mesh, at_most = FLAT[name]
    mesh.export(tmp_path / "thing.stl")
    shape = MeshShape(tmp_path / "thing.stl", pose=random_pose(rng))
    start = process_time()
    centres, radii = shape.balls()
    assert process_time() - start < 5.0  # 0.2 to 0.9 s were measured; 10 to 25 s, or refused, before
    assert len(radii) <= at_most
    assert len(left_out(surface_points(shape, rng), centres, radii)) == 0
    # The distance of a ball's centre from the surface is its depth: it reaches out by no more than the excess.
    few = rng.permutation(len(radii))[:500]
    triangles = np.array(shape.mesh().triangles)
    every = np.tile(np.arange(len(triangles)), (len(few), 1))
    depth = distance_to_triangles(centres[few], triangles, every)
    assert (radii[few] - depth).max() <= EXCESS + ROUNDING
    if name.startswith("tote"):
        middle = shape.pose[:3, :3] @ [0.0, 0.0, 0.15] + shape.pose[:3, 3]
        assert (np.linalg.norm(centres - middle, axis=1) - radii).min() > 0.146 - EXCESS - ROUNDING


def test_a_box_of_triangles_is_solid(tmp_path: Path) -> None:
    trimesh.creation.box((0.2, 0.2, 0.2)).export(tmp_path / "cube.stl")
    centres, radii = MeshShape(tmp_path / "cube.stl").balls()
    points = np.random.default_rng(0).uniform(-0.05, 0.05, (2000, 3))
    assert len(left_out(points, centres, radii)) == 0


def test_an_excess_that_asks_for_too_many_balls_is_refused_with_one_that_does_not(tmp_path: Path) -> None:
    sheet(3.0, 2.0).export(tmp_path / "guard.stl")
    shape = MeshShape(tmp_path / "guard.stl")
    with pytest.raises(
        ValueError, match=r"the excess of 2 mm asks for about 7.5e\+05 balls, .* 3.5 mm needs few"
    ):
        shape.balls()
    assert len(shape.balls(0.0035)[0]) < 300_000


def test_a_large_plate_is_covered_at_once_and_without_gaps() -> None:
    """A guard of 1 mm took seconds: a search for the fewest balls."""
    size, excess = (0.001, 1.0, 0.6), 0.002
    centres, radii = Box(size).cover(excess)
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.5, 0.5, (2000, 3)) * size
    sides = rng.integers(3, size=2000)
    points[np.arange(2000), sides] = 0.5 * np.sign(points[np.arange(2000), sides]) * np.array(size)[sides]

    # each point of the surface is in one of the balls whose centres are nearest; rounding of a sum
    near = cKDTree(centres).query(points, k=8)
    assert (near[0] - radii[near[1]]).min(axis=1).max() <= 1e-9
    outside = np.linalg.norm(np.maximum(np.abs(centres) - 0.5 * np.array(size), 0.0), axis=1)
    inside = np.clip(0.5 * np.array(size) - np.abs(centres), 0.0, None).min(axis=1)
    assert (radii - inside + outside).max() <= excess * (1.0 + 1e-6)  # how far balls reach out
    assert len(centres) < 1.25 * 50_286  # the fewest that the search found, which takes ten times as long
