"""Convex parts hold the solid and leave its hollows free."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from sidestep import Robot
from sidestep.distance.convex_parts import MOST_PARTS, convex_parts


def _inside(part: np.ndarray, points: np.ndarray) -> np.ndarray:
    planes = ConvexHull(part).equations
    # [m] qhull merges facets within its own rounding, 1e-9 covers it at arm size
    return np.all(points @ planes[:, :3].T + planes[:, 3] <= 1e-9, axis=1)


def _corner() -> trimesh.Trimesh:
    """An L: two boxes of 0.1 x 0.1 x 0.3 m that share a corner block."""
    upright = trimesh.creation.box(extents=(0.1, 0.1, 0.3))
    lying = trimesh.creation.box(extents=(0.3, 0.1, 0.1))
    lying.apply_translation([0.1, 0.0, -0.1])
    merged = trimesh.util.concatenate([upright, lying])
    assert isinstance(merged, trimesh.Trimesh)
    return merged


def test_corner_is_covered_and_its_notch_is_free() -> None:
    mesh = _corner()
    parts = convex_parts(mesh.triangles)
    points = mesh.sample(2000, seed=0)
    covered = np.zeros(len(points), dtype=bool)
    for part in parts:
        covered |= _inside(part, points)
    assert covered.all()
    notch = np.array([[0.12, 0.0, 0.02]])  # inside the hull of the whole, outside the L
    assert _inside(np.array(mesh.vertices), notch).all()
    assert not any(_inside(part, notch).any() for part in parts)


def test_convex_solid_stays_whole() -> None:
    (part,) = convex_parts(trimesh.creation.icosphere(radius=0.1).triangles)
    assert len(part) == 642  # every vertex of the icosphere is on its hull


@pytest.mark.parametrize("link", ["fr3_link3", "fr3_link5"])
def test_fr3_links_are_covered_more_tightly_than_by_one_hull(link: str) -> None:
    mesh = Robot.named("fr3_arm").collision_mesh(link)
    assert mesh is not None
    parts = convex_parts(mesh.triangles)
    assert 1 < len(parts) <= MOST_PARTS
    points = np.vstack([mesh.vertices, mesh.sample(2000, seed=0)])
    covered = np.zeros(len(points), dtype=bool)
    for part in parts:
        covered |= _inside(part, points)
    assert covered.all()
    assert sum(ConvexHull(part).volume for part in parts) < 0.8 * mesh.convex_hull.volume


def test_flat_surface_has_no_part() -> None:
    assert convex_parts(np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])) == ()
