"""Obstacles from shapes."""

import numpy as np
import pytest
import trimesh

from sidestep.obstacles import Box, Cylinder, Obstacles, Sphere, obstacles_from_shapes, pose_at


def test_a_sphere_is_one_point_with_its_radius() -> None:
    obstacles = obstacles_from_shapes([Sphere(0.07, pose=pose_at([0.1, 0.2, 0.3]))])
    np.testing.assert_array_equal(obstacles.points, [[0.1, 0.2, 0.3]])
    np.testing.assert_array_equal(obstacles.radii, [0.07])
    np.testing.assert_array_equal(obstacles.velocities, [[0.0, 0.0, 0.0]])


def test_shapes_keep_their_order_radii_and_velocities() -> None:
    velocities = [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]]
    shapes = [
        Box((0.2, 0.2, 0.2), velocity=velocities[0]),
        Sphere(0.05, pose=pose_at([1.0, 0.0, 0.0]), velocity=velocities[1]),
        Cylinder(0.05, 0.2, velocity=velocities[2]),
    ]
    obstacles = obstacles_from_shapes(shapes, spacing=0.05, radius=0.01, gaps_allowed=True)
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
        obstacles_from_shapes([Sphere(0.1)], spacing=0.02, radius=float("nan"))
    with pytest.raises(
        ValueError, match=r"radius is 0\.01, which leaves gaps .* from 0\.02 m on there are none"
    ):
        obstacles_from_shapes([Sphere(0.1)], spacing=0.02, radius=0.01)
    with pytest.raises(ValueError, match=r"radius is 0\.0, which goes with a spacing"):
        obstacles_from_shapes([Sphere(0.1)], radius=0.0)
    with pytest.raises(ValueError, match=r"excess is 0\.01, which goes without spacing and radius"):
        obstacles_from_shapes([Sphere(0.1)], excess=0.01, spacing=0.02)
    with pytest.raises(ValueError, match="excess is 0, must be positive"):
        obstacles_from_shapes([Obstacles([[0.0, 0.0, 0.0]])], excess=0)
    with pytest.raises(ValueError, match=r"Box 'hall': the excess asks for more than 300000 balls"):
        obstacles_from_shapes([Sphere(0.1), Box((300.0, 300.0, 0.1), name="hall")])
    with pytest.raises(
        TypeError, match=r"item 1 of the obstacles is of type ndarray.* Obstacles\(points, radii\)"
    ):
        obstacles_from_shapes([Sphere(0.1), np.zeros((2, 3))])
    with pytest.raises(
        TypeError, match=r"item 1 of the obstacles is of type str, must be a shape or Obstacles"
    ):
        obstacles_from_shapes([Sphere(0.1), "table"])
    with pytest.raises(TypeError, match="obstacles are of type float, must be a shape, Obstacles or a list"):
        obstacles_from_shapes(0.1)


def test_one_shape_and_obstacles_are_taken_alone() -> None:
    ball = obstacles_from_shapes(Sphere(0.1, name="ball"))
    assert ball.groups == [("ball", 1)]
    cloud = Obstacles([[0.0, 0.0, 1.0]])
    assert obstacles_from_shapes(cloud) is cloud
    assert cloud.groups == [(None, 1)]
    assert Obstacles.none().groups == []


def test_by_default_there_is_no_gap() -> None:
    box = Box((0.2, 0.1, 0.3), pose=pose_at([0.5, 0.0, 0.1]))
    surface = trimesh.sample.sample_surface(box.mesh(), 5000, seed=1)[0]
    for obstacles in (obstacles_from_shapes([box]), obstacles_from_shapes([box], spacing=0.03)):
        apart = np.linalg.norm(surface[:, None] - obstacles.points, axis=2) - obstacles.radii
        assert apart.min(axis=1).max() <= 1e-9  # rounding


def test_points_and_shapes_mix_and_keep_their_names() -> None:
    points = np.array([[0.0, 0.0, 1.0], [0.0, 0.1, 1.0]])
    cloud = Obstacles(points)
    seen = Obstacles([[2.0, 0.0, 0.0]], 0.02, [[0.0, 0.0, -1.0]])
    table = Box((0.1, 0.1, 0.1), velocity=[0.1, 0.0, 0.0], name="table")
    mixed = obstacles_from_shapes([cloud, table, seen, Sphere(0.1, name="ball")], excess=0.01)
    num_box = len(table.balls(0.01)[0])
    assert len(mixed) == 2 + num_box + 1 + 1
    np.testing.assert_array_equal(mixed.points[:2], points)
    np.testing.assert_array_equal(mixed.radii[:2], 0.0)
    np.testing.assert_array_equal(mixed.velocities[2:-2], np.tile([0.1, 0.0, 0.0], (num_box, 1)))
    np.testing.assert_array_equal(mixed.velocities[-2:], [[0.0, 0.0, -1.0], [0.0, 0.0, 0.0]])
    np.testing.assert_array_equal(mixed.radii[-2:], [0.02, 0.1])
    names = [mixed.name_of(point) for point in range(len(mixed))]
    assert names == ["obstacle0"] * 2 + ["table"] * num_box + ["obstacle2", "ball"]
    assert mixed.groups == [("obstacle0", 2), ("table", num_box), ("obstacle2", 1), ("ball", 1)]
    again = obstacles_from_shapes([Sphere(0.3), mixed])
    assert [again.name_of(point) for point in range(len(again))] == ["obstacle0", *names[:2], *names[2:]]
    assert len(obstacles_from_shapes([Obstacles.none()])) == 0


def test_names_of_points() -> None:
    points = Obstacles([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    assert points.name_of(0) is None
    named = points.named(["a", "none", "b"], [1, 0, 2])
    assert [named.name_of(k) for k in range(3)] == ["a", "b", "b"]
    named.advance(0.1)
    assert named.name_of(2) == "b"
    assert points.name_of(2) is None
    for index in (-1, 3):
        with pytest.raises(IndexError, match=f"point is {index}, there are 3 points"):
            named.name_of(index)
    with pytest.raises(ValueError, match="2 names and 1 counts"):
        points.named(["a", "b"], [3])
    with pytest.raises(ValueError, match="'b' has count 3, must be between 0 and 2"):
        points.named(["a", "b"], [1, 3])
    with pytest.raises(ValueError, match="counts are of 2 points, there are 3"):
        points.named(["a"], [2])


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
