"""The guide "Add a kind of shape": what it says is enough is enough, and no more files name a kind."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

import sidestep as ss
from sidestep.arm.attachment import attachment
from sidestep.obstacles import Obstacles, Shape, obstacles_from_shapes, pose_at
from sidestep.robot import Geometry, Robot
from sidestep.scenario import Scenario, ScenarioError, schema_text
from sidestep.scenario.assembly import solids
from sidestep.scenario.perception import seen_at, view_of
from sidestep.shapes import KINDS
from sidestep.simulation.model import build_model

ROOT = Path(__file__).parents[2]
GUIDE = ROOT / "docs/how-to/add-a-shape.md"
USERS = ("bench", "cli", "thesis")  # rooms that put shapes into scenes; they do not define them
MOST_FILES = 4
RADIUS, HEIGHT = 0.1, 0.3  # [m]
ROUNDING = 1e-9  # [m] in double precision at the scale of a metre


@pytest.fixture
def cone(tmp_path: Path) -> Iterator[type[Shape]]:
    """The class of the guide, registered while a test runs."""
    code = "\n".join(re.findall(r"```python\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL))
    before, file = dict(KINDS), tmp_path / "cone.py"
    file.write_text(code, encoding="utf-8")
    spec = spec_from_file_location("guide_to_shapes", file)
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules["guide_to_shapes"] = module_from_spec(spec)
    spec.loader.exec_module(module)
    yield KINDS["cone"]
    del sys.modules["guide_to_shapes"]
    KINDS.clear()
    KINDS.update(before)


def listed_files() -> set[str]:
    """What the guide lists beside the file of the class."""
    return {
        name
        for name in re.findall(r"`(src/[\w/.]+)`", GUIDE.read_text(encoding="utf-8"))
        if "cone" not in name
    }


def surface_of(pose: np.ndarray, count: int = 5000) -> np.ndarray:
    """Points (count, 3) exactly on the round side and the base of the cone."""
    rng = np.random.default_rng(4)
    angle, share = rng.uniform(0.0, 2.0 * np.pi, count), rng.uniform(size=count)
    radius = RADIUS * share
    height = np.where(np.arange(count) % 2, HEIGHT * (1.0 - share), 0.0)
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
    return points @ pose[:3, :3].T + pose[:3, 3]


def test_a_kind_is_named_in_few_files() -> None:
    """A capsule, by its class or in words, in as many files as the guide lists."""
    found = {
        str(path.relative_to(ROOT))
        for folder in ("src", "bindings", "cpp")
        for path in (ROOT / folder).rglob("*.*")
        if path.suffix in (".py", ".pyi", ".cpp", ".hpp", ".inl", ".json", ".yaml")
        and not any(part in USERS for part in path.parts)
        and re.search(r"(?<!nb::)capsule", path.read_text(encoding="utf-8"), re.IGNORECASE)
    }
    found.discard("src/sidestep/_core.pyi")  # generated
    assert found == {"src/sidestep/shapes/capsule.py", *listed_files()}
    assert len(found) <= MOST_FILES


def test_balls_hold_it_and_reach_out_by_no_more_than_the_excess(cone: type[Shape]) -> None:
    pose = pose_at([0.4, -0.2, 0.7], wxyz=[0.5, 0.5, -0.5, 0.5])
    shape = cone(RADIUS, HEIGHT, pose, velocity=[0.1, 0.0, 0.0], name="hat")
    seen = obstacles_from_shapes([shape])
    apart = np.linalg.norm(surface_of(pose)[:, None] - seen.points[None], axis=2) - seen.radii
    assert apart.min(axis=1).max() <= ROUNDING
    local = (seen.points - pose[:3, 3]) @ pose[:3, :3]
    slope = np.hypot(RADIUS, HEIGHT)
    beyond_side = (HEIGHT * np.hypot(local[:, 0], local[:, 1]) + RADIUS * (local[:, 2] - HEIGHT)) / slope
    assert np.maximum(beyond_side, -local[:, 2]).max() + seen.radii.max() >= 0.0
    assert (np.maximum(beyond_side, -local[:, 2]) + seen.radii).max() <= 0.002 + ROUNDING
    assert seen.name_of(0) == "hat"
    np.testing.assert_array_equal(seen.velocities[0], [0.1, 0.0, 0.0])
    with pytest.raises(
        ValueError, match=r"excess is 0\.0001, must be more than the bulge of a cone, 0\.00012 m"
    ):
        shape.balls(1e-4)
    samples = shape.sample(0.03)
    gaps = np.linalg.norm(surface_of(pose)[:, None] - samples[None], axis=2).min(axis=1)
    assert gaps.max() <= 0.03


def test_the_judge_measures_to_it(cone: type[Shape]) -> None:
    """Its tip points at the side of the arm: the distance is one of a point."""
    robot = Robot.named("planar2")
    tip = robot.pose(np.zeros(2), robot.links[-1].name)[:3, 3]
    down = pose_at(
        tip + np.array([0.0, 0.5 + HEIGHT, 0.0]), [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
    )
    found = ss.ExactClearance(robot, [cone(RADIUS, HEIGHT, down, name="hat")]).distance(np.zeros(2))
    point = ss.ExactClearance(robot, [ss.Sphere(1e-9, pose_at(tip + np.array([0.0, 0.5, 0.0])))])
    assert found.obstacle == "hat"
    assert found.distance == pytest.approx(
        point.distance(np.zeros(2)).distance, abs=1e-6
    )  # Coal's iterations


def test_physics_has_it_as_its_hull(cone: type[Shape]) -> None:
    built = build_model(
        Robot.named("planar2"), [ss.SceneObject("hat", "cone", (RADIUS, HEIGHT), motion="free")]
    )
    geom = built.model.geom("object:hat")
    assert geom.type[0] == mujoco.mjtGeom.mjGEOM_MESH
    data = mujoco.MjData(built.model)
    mujoco.mj_forward(built.model, data)
    corners = built.model.mesh_vert[: built.model.mesh_vertnum[-1]]
    assert len(corners) >= 64
    with pytest.raises(ValueError, match=r"size of a cone is \(radius, height\), positive"):
        ss.SceneObject("hat", "cone", (RADIUS,))


def test_a_link_may_be_one(cone: type[Shape], tmp_path: Path) -> None:
    text = """<robot name="r"><link name="base"/><link name="a"><collision><geometry>
      <cone radius="0.1" height="0.3"/></geometry></collision></link>
      <joint name="j" type="continuous"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/></joint></robot>"""
    path = tmp_path / "r.urdf"
    path.write_text(text)
    (geometry,) = Robot.from_urdf(path).link("a").geometries
    assert (geometry.kind, geometry.size) == ("cone", (RADIUS, HEIGHT))
    assert geometry.mesh().volume == pytest.approx(np.pi * RADIUS**2 * HEIGHT / 3.0, rel=0.01)  # of chords
    assert isinstance(Geometry("cone", np.eye(4), size=(RADIUS, HEIGHT)).mesh(), trimesh.Trimesh)
    held = attachment("hat", cone(RADIUS, HEIGHT), link="a", mass=1.0)
    np.testing.assert_allclose(held.inertial.com, [0.0, 0.0, HEIGHT / 4.0], atol=1e-9)


def test_a_scenario_may_have_one(cone: type[Shape]) -> None:
    text = """
format: 1
name: t
method: controller
robot: {name: planar2}
start: {unit: deg, position: [0, 0]}
goal: {unit: deg, position: [10, 10]}
obstacles:
  - {shape: {type: cone, radius: 0.1, height: 0.3}, position: [0, 3, 0], name: hat}
"""
    scenario = Scenario.from_text(text)
    (item,) = scenario.obstacles
    assert item.shape == cone(RADIUS, HEIGHT)
    assert scenario.to_document()["obstacles"][0]["shape"] == {"type": "cone", "radius": 0.1, "height": 0.3}
    (solid,) = solids(scenario, item, "hat")
    seen = seen_at((view_of(item, solid, bare=False),), 0.0)
    expected = obstacles_from_shapes(cone(RADIUS, HEIGHT, pose_at([0.0, 3.0, 0.0])))
    assert isinstance(seen, Obstacles)
    np.testing.assert_allclose(seen.points, expected.points, atol=ROUNDING)
    assert '"Of the base [m]."' in schema_text()
    with pytest.raises(ScenarioError, match="the key 'height' is missing; required: radius, height"):
        Scenario.from_text(text.replace(", height: 0.3", ""))


def test_a_kind_is_known_only_while_it_is_registered() -> None:
    assert "cone" not in schema_text()
    with pytest.raises(ValueError, match="kind is 'cone', allowed: sphere, box"):
        ss.SceneObject("hat", "cone", (RADIUS, HEIGHT))
