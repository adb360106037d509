"""What each kind of shape says of itself: lengths, boxes, balls around it, MuJoCo and Coal."""

from __future__ import annotations

import pickle
from pathlib import Path

import coal
import mujoco
import numpy as np
import pytest
import trimesh

from sidestep.obstacles import Box, Capsule, Cylinder, MeshShape, Plane, Shape, Sphere, pose_at
from sidestep.shapes import KINDS, Triangles, kind_of

SOLIDS = [Sphere(0.1), Box((0.1, 0.2, 0.3)), Cylinder(0.1, 0.4), Capsule(0.1, 0.4)]
BULGE = 0.0013  # of a radius, at most: what inscribed triangles cut off


def test_kinds_stand_in_the_order_of_files_and_messages() -> None:
    assert list(KINDS) == ["sphere", "box", "cylinder", "capsule", "plane", "mesh"]
    with pytest.raises(ValueError, match="link 'a': kind is 'torus', allowed: sphere, box, cylinder"):
        kind_of("torus", "link 'a'")


@pytest.mark.parametrize("shape", [*SOLIDS, Plane([0, 0, 0], [0, 0, 1], extent=0.5)], ids=lambda s: s.kind)
def test_a_shape_is_made_by_its_lengths(shape: Shape) -> None:
    assert type(shape).of_lengths(shape.lengths) == shape
    assert kind_of(shape.kind, "it") is type(shape)


def test_lengths_are_in_the_order_of_the_fields() -> None:
    assert Box((0.1, 0.2, 0.3)).lengths == (0.1, 0.2, 0.3)
    assert Cylinder(radius=1, length=2).lengths == (1.0, 2.0)
    assert Plane([1, 2, 3], [1, 0, 0]).lengths == (2.5,)
    (size,) = Box.length_fields()
    assert (size.name, size.number, size.about, size.default) == ("size", 3, "Full edge lengths [m].", None)
    assert Plane.length_fields()[0].default == 2.5


def test_shapes_are_equal_by_value() -> None:
    at = pose_at([1.0, 2.0, 3.0])
    assert Sphere(0.1, at, name="a") == Sphere(0.1, at.copy(), name="a")
    assert hash(Sphere(0.1, at, name="a")) == hash(Sphere(0.1, at.copy(), name="a"))
    for other in (
        Sphere(0.2, at),
        Sphere(0.1),
        Sphere(0.1, at, velocity=[0, 0, 1]),
        Sphere(0.1, at, name="b"),
    ):
        assert Sphere(0.1, at) != other
    assert Cylinder(0.1, 0.2) != Capsule(0.1, 0.2)
    assert pickle.loads(pickle.dumps(Box((1, 2, 3), at))) == Box((1, 2, 3), at)


def test_a_mesh_file_is_not_another(tmp_path: Path) -> None:
    for name in ("a.stl", "b.stl"):
        trimesh.creation.box().export(tmp_path / name)
    assert MeshShape(tmp_path / "a.stl") == MeshShape(tmp_path / "a.stl")
    assert MeshShape(tmp_path / "a.stl") != MeshShape(tmp_path / "b.stl")
    assert MeshShape(tmp_path / "a.stl").lengths == ()


@pytest.mark.parametrize("shape", SOLIDS, ids=lambda s: s.kind)
def test_triangles_are_inside_by_no_more_than_the_bulge(shape: Shape) -> None:
    surface = shape.surface()
    np.testing.assert_allclose(surface.extents, shape.extents, atol=2.0 * BULGE * 0.1)
    farthest = np.linalg.norm(surface.vertices, axis=1).max()
    assert farthest <= shape.bounding_radius + 1e-12  # rounding
    assert shape.bounding_radius == pytest.approx(farthest, abs=1e-3)
    assert shape.bulge <= 2.0 * BULGE * 0.1 + 1e-12
    if shape.kind == "sphere":
        nearest = np.linalg.norm(surface.triangles_center, axis=1).min()
        assert 0.9 * shape.bulge < shape.bounding_radius - nearest <= shape.bulge
    shape.mesh().apply_translation([1.0, 0.0, 0.0])  # of a copy
    np.testing.assert_array_equal(shape.surface().vertices, surface.vertices)


@pytest.mark.parametrize("shape", SOLIDS, ids=lambda s: s.kind)
def test_mujoco_and_coal_have_it_exactly(shape: Shape) -> None:
    """Both measure from it to a far point; the point is a ball of a tenth of a micrometre for MuJoCo."""
    spec = mujoco.MjSpec()
    kind = getattr(mujoco.mjtGeom, f"mjGEOM_{shape.kind.upper()}")
    spec.worldbody.add_geom(type=kind, size=shape.mujoco_size())
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[1e-7, 0, 0], pos=[0.3, 0.5, 0.7])
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    by_mujoco = mujoco.mj_geomDistance(model, data, 0, 1, 10.0, np.zeros(6))
    result, there = coal.DistanceResult(), coal.Transform3s(np.eye(3), np.array([0.3, 0.5, 0.7]))
    solid = shape.coal()
    assert solid is not None
    by_coal = coal.distance(
        solid, coal.Transform3s.Identity(), coal.Sphere(1e-9), there, coal.DistanceRequest(), result
    )
    assert by_coal == pytest.approx(by_mujoco, abs=1e-5)  # of the iterations of both
    assert type(shape).of_mujoco(shape.mujoco_size()) == shape


def test_what_has_no_end_and_no_solid_says_so() -> None:
    floor = Plane([0, 0, 0], [0, 0, 1], extent=0.5)
    assert not floor.bounded
    assert floor.bounding_radius == np.inf
    assert floor.mujoco_size() == (0.5, 0.5, 0.5)
    triangles = Triangles(trimesh.creation.box())
    assert triangles.coal() is None
    assert triangles.mujoco_factors == ()
    np.testing.assert_allclose(triangles.extents, 1.0)
    assert triangles.bounding_radius == pytest.approx(np.sqrt(0.75))


def test_a_capsule_in_parts_and_without_a_segment() -> None:
    parts = list(Capsule(0.1, 0.4).parts())
    assert [part for part, _ in parts] == [Cylinder(0.1, 0.4), Sphere(0.1), Sphere(0.1)]
    np.testing.assert_array_equal([X[2, 3] for _, X in parts], [0.0, -0.2, 0.2])
    assert Capsule.where_flat((0.1, 0.0)) == Sphere(0.1)
    assert Capsule.where_flat((0.0, 0.1)) is None
    assert Box.where_flat((0.1, 0.1, 0.0)) is None
    ((part, X),) = Box((1, 2, 3)).parts()
    assert part == Box((1, 2, 3))
    np.testing.assert_array_equal(X, np.eye(4))
