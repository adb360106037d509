"""Scene objects: what they refuse, where they are, what a camera sees of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from sidestep import SceneObject
from sidestep._core import Obstacles
from sidestep.obstacles import Box, Cylinder, MeshShape, Sphere, pose_at
from sidestep.simulation import seen_obstacles


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"kind": "cone"}, "kind is 'cone', allowed: sphere, box, cylinder, mesh"),
        ({"motion": "flying"}, "motion is 'flying', allowed: fixed, free, moving"),
        ({"size": (-0.1,)}, r"size of a sphere is \(radius,\), positive"),
        ({"size": (0.1, 0.2)}, r"size of a sphere is \(radius,\)"),
        ({"size": (float("nan"),)}, "positive"),
        ({"mass": 0.0}, "mass must be positive, got 0"),
        ({"pose": np.zeros((4, 4))}, "rigid transform"),
        ({"pose": np.eye(3)}, "rigid transform"),
        ({"velocity": np.array([0.0, np.inf, 0.0])}, "finite"),
        ({"moves_during": (2.0, 1.0)}, "from <= until"),
        ({"mesh": trimesh.creation.box()}, "needs `mesh`, and only it"),
    ],
)
def test_bad_values(changes: dict, message: str) -> None:
    with pytest.raises(ValueError, match=rf"object 'thing': .*{message}"):
        SceneObject(**({"name": "thing", "kind": "sphere", "size": (0.1,)} | changes))


def test_scripted_pose() -> None:
    ball = SceneObject.ball(
        "b", [0, 0, 1], radius=0.1, motion="moving", velocity=(0, 0, -0.5), moves_during=(1.0, 2.0)
    )
    heights = [ball.pose_at(t)[2, 3] for t in (0.0, 1.0, 1.5, 2.0, 9.0)]
    np.testing.assert_allclose(heights, [1.0, 1.0, 0.75, 0.5, 0.5])
    assert SceneObject.ball("c", [0, 0, 1], radius=0.1, velocity=(0, 0, 1)).pose_at(5.0)[2, 3] == 1.0


def test_seen_obstacles_move_only_while_they_move() -> None:
    ball = SceneObject.ball(
        "b", [0, 0, 1], radius=0.1, motion="moving", velocity=(0, 0, -0.5), moves_during=(1.0, 2.0)
    )
    during, after = seen_obstacles([ball], 1.5), seen_obstacles([ball], 3.0, point_radius=0.0)
    np.testing.assert_allclose(during.points, [[0, 0, 0.75]])
    np.testing.assert_allclose(during.velocities, [[0, 0, -0.5]])
    np.testing.assert_allclose(during.radii, [0.1])
    np.testing.assert_allclose(after.points, [[0, 0, 0.5]])
    np.testing.assert_allclose(after.velocities, [[0, 0, 0]])
    np.testing.assert_allclose(after.radii, [0.0])
    assert len(seen_obstacles([], 0.0)) == 0
    with pytest.raises(ValueError, match="'box' is a box; only spheres"):
        seen_obstacles([SceneObject("box", "box", size=(1, 1, 1))], 0.0)


def test_balls_of_points() -> None:
    points = Obstacles([[0.1, 0.2, 0.3], [1, 1, 1]], [0.02, 0.03], [[0, 0, 0], [0, 0.1, 0]])
    first, second = SceneObject.balls(points)
    assert (first.name, first.size, first.motion) == ("obstacle_0", (0.02,), "fixed")
    assert (second.name, second.size, second.motion) == ("obstacle_1", (0.03,), "moving")
    np.testing.assert_array_equal(second.pose[:3, 3], [1, 1, 1])
    assert {b.motion for b in SceneObject.balls(points, radius=0.05, motion="free")} == {"free"}


def test_from_shapes(tmp_path: Path) -> None:
    path = tmp_path / "part.stl"
    trimesh.creation.box(extents=(0.2, 0.4, 0.6)).export(path)
    pose = pose_at([1.0, 2.0, 3.0])
    shapes = {
        "sphere": Sphere(0.1, pose=pose),
        "box": Box((0.1, 0.2, 0.3), pose=pose),
        "cylinder": Cylinder(0.1, 0.5, pose=pose),
        "mesh": MeshShape(path, pose=pose),
    }
    for kind, shape in shapes.items():
        item = SceneObject.from_shape("it", shape)
        assert item.kind == kind
        np.testing.assert_allclose(item.pose, pose)
        world = item.surface().copy().apply_transform(item.pose)
        # coarser triangles of round shapes lie inside by less than a tenth of their radius
        np.testing.assert_allclose(world.bounds, shape.mesh().bounds, atol=0.01)


def test_bounding_radius_holds_the_surface() -> None:
    for item in (
        SceneObject("s", "sphere", size=(0.3,)),
        SceneObject("b", "box", size=(0.1, 0.2, 0.3)),
        SceneObject("c", "cylinder", size=(0.1, 0.5)),
        SceneObject("m", "mesh", mesh=trimesh.creation.cone(0.1, 0.4)),
    ):
        farthest = np.linalg.norm(item.surface().vertices, axis=1).max()
        assert farthest <= item.bounding_radius + 1e-12
        assert item.bounding_radius <= farthest * 1.01  # round surfaces are drawn with chords
