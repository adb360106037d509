"""Meshes: what cannot be read is named, and coarse ones keep the shape."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from sidestep.robot.mesh import read_mesh, simplified


def test_files_that_are_no_mesh_are_named(tmp_path: Path) -> None:
    broken = tmp_path / "broken.stl"
    broken.write_bytes(b"solid x")
    with pytest.raises(ValueError, match=r"mesh file '.*broken\.stl' (cannot be read|holds no triangles)"):
        read_mesh(broken)
    empty = tmp_path / "points.obj"
    empty.write_text("v 0 0 0\n")
    with pytest.raises(ValueError, match=r"mesh file '.*points\.obj' (cannot be read|holds no triangles)"):
        read_mesh(empty)


def test_a_file_is_read_in_its_own_coordinates(tmp_path: Path) -> None:
    path = tmp_path / "box.stl"
    trimesh.creation.box(extents=(100.0, 200.0, 300.0)).export(path)
    np.testing.assert_allclose(read_mesh(path).extents, [100.0, 200.0, 300.0])


def test_simplified_keeps_the_shape() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=5, radius=0.1)
    coarse = simplified(sphere, 0.02)
    assert len(coarse.faces) < len(sphere.faces) / 10
    radii = np.linalg.norm(coarse.vertices, axis=1)
    # the mean of vertices in a cube of side c is off the sphere by at most its diagonal
    assert radii.max() <= 0.1 + 1e-12
    assert radii.min() >= 0.1 - 0.02 * np.sqrt(3)
    np.testing.assert_allclose(coarse.bounds, sphere.bounds, atol=0.01)
