"""Scene objects: what they refuse, where they are, what a camera sees of them."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

import sidestep as ss
from sidestep import SceneObject
from sidestep._core import Obstacles
from sidestep.distance import seen_obstacles
from sidestep.math.pose import pose_vector
from sidestep.obstacles import (
    Box,
    Capsule,
    Cylinder,
    MeshShape,
    Plane,
    Sphere,
    obstacles_from_shapes,
    pose_at,
)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"kind": "cone"}, "kind is 'cone', allowed: sphere, box, cylinder, capsule, plane, mesh"),
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
        "capsule": Capsule(0.1, 0.5, pose=pose),
        "plane": Plane(pose[:3, 3], [0.0, 0.0, 1.0], around=pose[:3, 3]),
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
        SceneObject("k", "capsule", size=(0.1, 0.5)),
        SceneObject("m", "mesh", mesh=trimesh.creation.cone(0.1, 0.4)),
    ):
        farthest = np.linalg.norm(item.surface().vertices, axis=1).max()
        assert farthest <= item.bounding_radius + 1e-12
        assert item.bounding_radius <= farthest * 1.01  # round surfaces are drawn with chords


def test_a_shape_says_its_velocity_once() -> None:
    moving = SceneObject.from_shape("it", Capsule(0.1, 0.2, velocity=[0.0, 0.1, 0.0]))
    assert moving.motion == "moving"
    np.testing.assert_allclose(moving.pose_at(2.0)[:3, 3], [0.0, 0.2, 0.0])
    other = SceneObject.from_shape("it", Sphere(0.1), velocity=(1.0, 0.0, 0.0))
    assert other.motion == "moving"
    assert SceneObject.from_shape("it", Sphere(0.1, velocity=[1, 0, 0]), motion="fixed").motion == "fixed"
    assert SceneObject.from_shape("it", Sphere(0.1)).motion == "fixed"


@pytest.mark.slow
def test_judge_and_controller_have_the_same_shapes(tmp_path: Path) -> None:
    """Said once: the same list goes to both, and the balls are at most the excess nearer than the exact solid."""
    robot = ss.Robot.named("planar2")
    q = np.zeros(robot.num_coordinates)
    path = tmp_path / "part.stl"
    trimesh.creation.box(extents=(0.1, 0.2, 0.3)).export(path)
    tip = robot.pose(q, robot.links[-1].name)[:3, 3]
    beside = pose_at(tip + np.array([0.0, 0.5, 0.0]))
    for shape in (
        Sphere(0.05, beside, name="it"),
        Box((0.1, 0.1, 0.1), beside, name="it"),
        Cylinder(0.05, 0.3, beside, name="it"),
        Capsule(0.05, 0.3, beside, name="it"),
        Plane([0.0, 0.5, 0.0], [0.0, -1.0, 0.0], name="it"),
        MeshShape(path, pose=beside, name="it"),
    ):
        exact = ss.ExactClearance(robot, [shape]).distance(q)
        assert exact.obstacle == "it"
        assert ss.ExactClearance(robot, shape).distance(q).distance == exact.distance
        seen = ss.ExactClearance(robot, obstacles_from_shapes(shape, excess=0.001)).distance(q)
        assert seen.obstacle.startswith("it.")
        assert exact.distance - 0.001 - 1e-6 <= seen.distance <= exact.distance + 1e-6  # Coal's iterations


def test_a_plane_is_a_half_space_for_the_judge() -> None:
    robot = ss.Robot.named("fr3")
    lowest = min(
        float(
            (robot.pose(robot.neutral, link.name) @ np.c_[mesh.vertices, np.ones(len(mesh.vertices))].T)[
                2
            ].min()
        )
        for link in robot.links
        if (mesh := robot.collision_mesh(link.name)) is not None and link.name not in ("base", "fr3_link0")
    )
    for height in (lowest - 0.07, lowest + 0.03, lowest + 2.0):  # apart, cut, wholly behind
        plane = Plane([50.0, -80.0, height], [0.0, 0.0, 1.0], extent=0.1, name="floor")
        judge = ss.ExactClearance(robot, [plane])
        found = judge.distance(robot.neutral)
        assert found.distance == pytest.approx(lowest - height, abs=1e-9)
        assert found.obstacle == "floor"
        path = np.array([robot.neutral, robot.neutral + 1e-3])
        motion = judge.minimum_over(path)
        assert motion.clearance.distance <= found.distance + 1e-9
        assert motion.clearance.distance == pytest.approx(found.distance, abs=0.01)
        assert judge.series(path)[0] == pytest.approx(found.distance, abs=1e-9)
    moving = Plane([0.0, 0.0, lowest - 0.5], [0.0, 0.0, 1.0], velocity=[0.0, 0.0, 1.0])
    item = SceneObject.from_shape("lift", moving)
    poses = np.array([[pose_vector(item.pose_at(t))] for t in (0.0, 0.4)])
    still = np.tile(robot.neutral, (2, 1))
    assert ss.ExactClearance(robot, [item]).minimum_over(still, poses).clearance.distance == pytest.approx(
        0.1, abs=1e-3
    )
    poses[1, 0, 3:] = [0.0, 1.0, 0.0, 0.0]
    with pytest.raises(ValueError, match="a plane turns between samples"):
        ss.ExactClearance(robot, [item]).minimum_over(still, poses)


def test_physics_has_the_same_shapes() -> None:
    """An arm that rests inside a thing touches it as deep as the judge says; MuJoCo's own distance is the oracle."""
    robot = ss.Robot.named("fr3")
    tip = robot.pose(robot.neutral, "fr3_link7")[:3, 3]
    shapes = [
        Capsule(0.05, 0.3, pose_at(tip + np.array([0.1, 0.0, 0.0])), name="rod"),
        Plane([9.0, 9.0, tip[2] - 0.05], [0.0, 0.0, 1.0], name="floor"),
        Plane([9.0, 0.0, 0.0], [-1.0, 0.0, 0.0], velocity=[-0.5, 0.0, 0.0], name="wall"),
    ]
    simulation = ss.Simulation(robot, shapes, visuals=False)
    model = simulation.built.model
    assert [item.name for item in simulation.objects] == ["rod", "floor", "wall"]
    kinds = {name: model.geom(f"object:{name}").type[0] for name in ("rod", "floor", "wall")}
    assert kinds == {
        "rod": mujoco.mjtGeom.mjGEOM_CAPSULE,
        "floor": mujoco.mjtGeom.mjGEOM_PLANE,
        "wall": mujoco.mjtGeom.mjGEOM_PLANE,
    }
    np.testing.assert_allclose(model.geom("object:rod").size[:2], [0.05, 0.15])
    data = mujoco.MjData(model)
    simulation.built.set_state(data, robot.neutral, np.zeros(7))
    mujoco.mj_forward(model, data)
    touched = {simulation.built.geom_owner[g][1] for c in data.contact for g in c.geom}
    assert "floor" in touched
    assert "wall" not in touched


def test_points_are_solids_where_they_have_a_radius() -> None:
    cloud = Obstacles([[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], 0.1)
    objects = ss.ExactClearance(
        ss.Robot.named("planar2"), [cloud, Sphere(0.1), cloud.named(["cup"], [2])]
    ).objects
    assert [item.name for item in objects] == ["obstacle0.0", "obstacle0.1", "obstacle1", "cup.0", "cup.1"]
    with pytest.raises(ValueError, match="obstacle1: point 1 has no radius"):
        ss.ExactClearance(
            ss.Robot.named("planar2"), [Sphere(0.1), Obstacles([[1, 0, 0], [2, 0, 0]], [0.1, 0.0])]
        )
    with pytest.raises(
        TypeError, match="obstacle1 is of type str, must be a SceneObject, a shape or Obstacles"
    ):
        ss.ExactClearance(ss.Robot.named("planar2"), [Sphere(0.1), "table"])
    with pytest.raises(ValueError, match="two objects of the scene are named 'it'"):
        ss.ExactClearance(ss.Robot.named("planar2"), [Sphere(0.1, name="it"), Box((1, 1, 1), name="it")])
    with pytest.raises(ValueError, match="a plane has no mass"):
        SceneObject.from_shape("floor", Plane([0, 0, 0], [0, 0, 1]), motion="free")
