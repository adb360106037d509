"""Nearest points of meshes against Coal, and without it in the process of a controller."""

import subprocess
import sys
from pathlib import Path

import coal
import numpy as np
import pytest
import trimesh

from sidestep.shapes.mesh_reader import mesh_model
from sidestep.shapes.nearest_on_mesh import MAX_PAIRS, NearestOnMesh

MESHES = {
    "round": trimesh.creation.icosphere(subdivisions=3, radius=0.2),
    "box": trimesh.creation.box((0.3, 0.2, 0.1)),
    "long triangles": trimesh.creation.annulus(0.1, 0.2, 0.3),
    "ring": trimesh.creation.torus(0.3, 0.1),
}


def distances_by_coal(mesh: trimesh.Trimesh, points: np.ndarray) -> np.ndarray:
    model, ball = mesh_model(mesh), coal.Sphere(1e-9)
    request, here = coal.DistanceRequest(), coal.Transform3s()
    nearest = np.empty_like(points)
    for index, point in enumerate(points):
        result = coal.DistanceResult()
        coal.distance(model, here, ball, coal.Transform3s(np.eye(3), point), request, result)
        nearest[index] = result.getNearestPoint1()
    return np.linalg.norm(nearest - points, axis=1)


@pytest.mark.parametrize("name", MESHES)
def test_distances_are_those_of_coal(name: str) -> None:
    mesh, rng = MESHES[name], np.random.default_rng(0)
    points = np.concatenate(
        [rng.uniform(-0.4, 0.4, (300, 3)), mesh.vertices[:50], mesh.triangles_center[:50]]
    )
    nearest, distance = NearestOnMesh(np.array(mesh.triangles)).of(points)
    np.testing.assert_allclose(distance, distances_by_coal(mesh, points), rtol=0.0, atol=1e-14)  # rounding
    np.testing.assert_array_equal(distance, np.linalg.norm(nearest - points, axis=1))
    on_mesh = distances_by_coal(mesh, nearest)
    assert on_mesh.max() < 1e-9 + 1e-14  # within the ball that stands for a point


def test_triangles_may_be_of_any_size_and_degenerate() -> None:
    rng = np.random.default_rng(1)
    triangles = rng.normal(size=(400, 3, 3)) * 10.0 ** rng.uniform(-4.0, 0.0, (400, 1, 1))
    triangles += rng.uniform(-0.5, 0.5, (400, 1, 3))
    triangles[:20, 2] = 0.5 * (triangles[:20, 0] + triangles[:20, 1])
    triangles[20:40, 1:] = triangles[20:40, :1]
    points = rng.uniform(-1.0, 1.0, (200, 3))
    _, distance = NearestOnMesh(triangles).of(points)
    # the slow way: points of a fine grid on every triangle are never nearer than the distance
    shares = np.array([(i, j, 12 - i - j) for i in range(13) for j in range(13 - i)]) / 12.0
    grid = np.einsum("sk,tkx->tsx", shares, triangles).reshape(-1, 3)
    by_grid = np.array([np.linalg.norm(grid - point, axis=1).min() for point in points])
    assert (distance <= by_grid + 1e-14).all()
    edge = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max() / 12.0
    assert (by_grid <= distance + edge).all()


def test_many_points_are_taken_in_parts() -> None:
    triangles = np.array(MESHES["ring"].triangles)
    points = np.random.default_rng(2).uniform(-0.4, 0.4, (MAX_PAIRS // len(triangles) + 10, 3))
    finder = NearestOnMesh(triangles)
    _, together = finder.of(points)
    np.testing.assert_array_equal(together[-20:], finder.of(points[-20:])[1])
    assert finder.of(np.zeros((0, 3)))[0].shape == (0, 3)


def test_the_balls_of_a_closed_mesh_need_no_robot_library(tmp_path: Path) -> None:
    MESHES["box"].export(tmp_path / "box.stl")
    code = (
        "import sys, sidestep as ss; "
        f"print(len(ss.MeshShape({str(tmp_path / 'box.stl')!r}).balls(0.01)[1])); "
        "print([name for name in ('coal', 'pinocchio', 'mujoco') if name in sys.modules])"
    )
    out = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    )
    count, loaded = out.stdout.split("\n")[:2]
    assert int(count) > 6
    assert loaded == "[]"
