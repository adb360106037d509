"""Surface samples: uniform by area, on the surface, repeatable."""

import numpy as np
import pytest
import trimesh

from sidestep import Robot
from sidestep.body import sample_link, sample_surface


def test_samples_are_spread_by_area() -> None:
    # the faces have areas 8, 4 and 2, twice each; the share of points on a face is its share of the area
    points = sample_surface(trimesh.creation.box(extents=(1.0, 2.0, 4.0)), 28000, seed=0)
    for axis, half, area in ((0, 0.5, 8.0), (1, 1.0, 4.0), (2, 2.0, 2.0)):
        for side in (-1.0, 1.0):
            share = np.mean(np.abs(points[:, axis] - side * half) < 1e-9)
            # binomial, 28000 draws: standard deviation at most 0.0027; five of them
            assert share == pytest.approx(area / 28.0, abs=0.0135)


def test_samples_depend_on_the_seed_only() -> None:
    mesh = trimesh.creation.icosphere()
    np.testing.assert_array_equal(sample_surface(mesh, 50, seed=3), sample_surface(mesh, 50, seed=3))
    assert np.abs(sample_surface(mesh, 50, seed=3) - sample_surface(mesh, 50, seed=4)).max() > 0.1


def test_a_link_is_sampled_in_its_own_frame(fr3: Robot) -> None:
    mesh = fr3.collision_mesh("fr3_link5")
    assert mesh is not None
    points = sample_link(fr3, "fr3_link5", count=100, seed=0)
    _, distances, _ = trimesh.proximity.closest_point_naive(mesh, points)
    assert distances.max() < 1e-9  # rounding of the barycentric sum
    assert np.abs(points - sample_link(fr3, "fr3_link6", count=100, seed=0)).max() > 0.01


def test_bad_requests_are_refused(fr3: Robot) -> None:
    with pytest.raises(ValueError, match="samples is 0, must be at least 1"):
        sample_surface(trimesh.creation.box(), 0, seed=0)
    flat = trimesh.Trimesh(vertices=np.zeros((3, 3)), faces=[[0, 1, 2]], process=False)
    with pytest.raises(ValueError, match=r"surface area 0\.0 m\^2"):
        sample_surface(flat, 10, seed=0)
    bare = next(link.name for link in fr3.links if not link.geometries)
    with pytest.raises(ValueError, match=f"link '{bare}' of robot 'fr3' has no geometry"):
        sample_link(fr3, bare, count=10, seed=0)
