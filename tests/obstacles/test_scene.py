"""Obstacles from shapes."""

import numpy as np
import pytest

from sidestep.obstacles import Box, Cylinder, Obstacles, Sphere, obstacles_from_shapes, pose_at


def test_a_sphere_is_one_point_with_its_radius() -> None:
    obstacles = obstacles_from_shapes([Sphere(0.07, pose=pose_at([0.1, 0.2, 0.3]))])
    np.testing.assert_array_equal(obstacles.points, [[0.1, 0.2, 0.3]])
    np.testing.assert_array_equal(obstacles.radii, [0.07])
    np.testing.assert_array_equal(obstacles.velocities, [[0.0, 0.0, 0.0]])


def test_shapes_keep_their_order_radii_and_velocities() -> None:
    shapes = [Box((0.2, 0.2, 0.2)), Sphere(0.05, pose=pose_at([1.0, 0.0, 0.0])), Cylinder(0.05, 0.2)]
    velocities = [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]]
    obstacles = obstacles_from_shapes(shapes, spacing=0.05, radius=0.01, velocities=velocities)
    num_box, num_cylinder = len(shapes[0].sample(0.05)), len(shapes[2].sample(0.05))
    assert len(obstacles) == num_box + 1 + num_cylinder
    np.testing.assert_array_equal(obstacles.points[:num_box], shapes[0].sample(0.05))
    assert obstacles.radii[num_box] == 0.05
    assert set(obstacles.radii[:num_box]) == {0.01}
    np.testing.assert_array_equal(
        obstacles.velocities, np.repeat(velocities, [num_box, 1, num_cylinder], axis=0)
    )


def test_bad_scenes_are_refused() -> None:
    with pytest.raises(ValueError, match="there is no shape"):
        obstacles_from_shapes([])
    with pytest.raises(ValueError, match=r"spacing is -0\.1"):
        obstacles_from_shapes([Sphere(0.1)], spacing=-0.1)
    with pytest.raises(ValueError, match="radius is nan"):
        obstacles_from_shapes([Sphere(0.1)], radius=float("nan"))
    with pytest.raises(ValueError, match=r"velocities have shape \(2, 3\), expected finite \(1, 3\)"):
        obstacles_from_shapes([Sphere(0.1)], velocities=np.zeros((2, 3)))


def test_arrays_are_checked_by_the_core() -> None:
    with pytest.raises(ValueError, match="point 1 is not finite"):
        Obstacles([[0.0, 0.0, 0.0], [0.0, np.nan, 0.0]])
    with pytest.raises(ValueError, match=r"points has shape \(2,\), expected \(N, 3\)"):
        Obstacles([0.0, 1.0])
    with pytest.raises(ValueError, match="radius -1"):
        Obstacles([[0.0, 0.0, 0.0]], radii=-1.0)
    with pytest.raises(ValueError, match="the cloud is empty"):
        Obstacles(np.zeros((0, 3)))
    assert len(Obstacles.none()) == 0
