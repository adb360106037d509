"""Robots as a whole: named ones, configurations, geometry, fingerprints."""

import importlib.metadata
import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest

import sidestep
from sidestep.robot import Robot, planar_arm, robots
from sidestep.robot.catalogue import RECIPES

NAMES = [item.name for item in RECIPES]


def test_catalogue_lists_what_is_asked_for() -> None:
    asked = {"fr3", "fr3_arm", "panda", "ur5", "ur10", "xarm7", "z1", "iiwa", "planar2", "planar3"}
    assert asked == {entry.name for entry in robots()}
    assert sidestep.robots is robots


@pytest.mark.parametrize("name", NAMES)
def test_named_robot_is_complete(name: str) -> None:
    robot = Robot.named(name)
    entry = next(item for item in robots() if item.name == name)
    assert (robot.name, robot.num_coordinates, entry.available, entry.reason) == (
        name, entry.num_coordinates, True, "",
    )  # fmt: skip
    limits = robot.limits
    for bound in (limits.velocity, limits.acceleration, limits.effort, limits.upper - limits.lower):
        assert np.isfinite(bound).all()
    # every moving link has a surface and a mass
    moving = {frame.name for frame in robot.frames if frame.joint >= 0}
    joint_of = {frame.name: frame.joint for frame in robot.frames}
    with_mesh = {joint_of[n] for n in moving if robot.collision_mesh(n) is not None}
    with_mass = {joint_of[n] for n in moving if (i := robot.link(n).inertial) is not None and i.mass > 0}
    assert with_mesh == with_mass == set(range(len(robot.joints)))
    rng = np.random.default_rng(1)
    for _ in range(20):
        q = robot.random_configuration(rng)
        assert np.linalg.eigvalsh(robot.mass_matrix(q))[0] > 0.0
        # at rest the motors hold the arm, with margin
        assert np.abs(robot.bias(q, np.zeros_like(q)) / limits.effort).max() < 0.9


@pytest.mark.parametrize("name", NAMES)
def test_configurations_inside_the_limits(name: str) -> None:
    robot = Robot.named(name)
    rng = np.random.default_rng(2)
    for q in [robot.neutral, *(robot.random_configuration(rng) for _ in range(50))]:
        assert robot.check_configuration(q) is not None
        assert ((robot.limits.lower < q) & (q < robot.limits.upper)).all()


def test_check_configuration() -> None:
    robot = Robot.named("planar2")
    np.testing.assert_array_equal(robot.check_configuration([1, 2]), [1.0, 2.0])
    just_outside = robot.limits.upper + 0.9e-3  # as encoders and published problems have
    np.testing.assert_array_equal(robot.check_configuration(just_outside), just_outside)
    with pytest.raises(ValueError, match=re.escape("q: joint 'joint1' is 3.14")):
        robot.check_configuration(robot.limits.upper + 1.1e-3)
    with pytest.raises(ValueError, match=re.escape("goal has shape (3,), expected (2,)")):
        robot.check_configuration([1, 2, 3], "goal")
    with pytest.raises(ValueError, match=re.escape("goal: joint 'joint2' is 4.0 rad, allowed: [-3.14")):
        robot.check_configuration([0, 4], "goal")
    with pytest.raises(ValueError, match=re.escape("q: joint 'joint1' is nan rad, allowed: [-3.14")):
        robot.check_configuration([np.nan, 0])
    with pytest.raises(TypeError, match="q must be an array of real numbers"):
        robot.check_configuration(["left", "right"])
    with pytest.raises(ValueError, match="v must be finite"):
        robot.bias([0, 0], [0, np.inf])


def test_unbounded_coordinates_have_a_neutral_value() -> None:
    text = re.sub(r"upper=\"[^\"]*\"", 'upper="inf"', planar_arm(2), count=1).replace(
        'name="joint2" type="revolute"', 'name="joint2" type="continuous"'
    )
    robot = Robot.from_urdf(text)
    np.testing.assert_allclose(robot.neutral, [0.0, 0.0], atol=1e-15)  # rounding of pi
    assert np.isinf(robot.limits.upper).all()


def test_unknown_name_and_missing_package(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(
        ValueError, match=r"no robot is named 'pandas' \(did you mean 'panda'\?\); known: fr3, fr3_arm"
    ):
        Robot.named("pandas")

    def no_distribution(name: str) -> importlib.metadata.Distribution:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "distribution", no_distribution)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    for name in ("fr3", "panda", "iiwa"):
        with pytest.raises(FileNotFoundError, match=re.escape("pip install 'sidestep[robots]'")):
            Robot.named(name)
    assert {entry.name for entry in robots() if entry.available} == {"planar2", "planar3"}
    assert all("sidestep[robots]" in entry.reason for entry in robots() if not entry.available)


def test_links_without_collision_use_their_visual() -> None:
    robot = Robot.named("z1")
    link = robot.link("link01")  # Unitree gives it no collision element
    assert link.collisions == ()
    mesh = robot.collision_mesh("link01")
    assert mesh is not None
    np.testing.assert_allclose(
        mesh.bounds, [[-0.0325, -0.066, 0], [0.0325, 0.066, 0.066]], atol=2e-4
    )  # drawing


def test_several_shapes_are_merged_in_the_link_frame() -> None:
    mesh = Robot.named("panda").collision_mesh("panda_leftfinger")  # four boxes
    assert mesh is not None
    volume = 1e-9 * (22 * 15 * 20 + 22 * 8.8 * 3.8 + 17.5 * 7 * 23.5 + 17.5 * 15.2 * 18.5)
    assert mesh.volume == pytest.approx(volume, rel=1e-9)  # exact but for rounding
    robot = Robot.from_urdf(Path(__file__).parent / "every_joint.urdf", tip="forearm")
    cylinder = robot.collision_mesh("turret")
    assert cylinder is not None
    np.testing.assert_allclose(
        cylinder.bounds, [[-0.04, -0.04, 0], [0.04, 0.04, 0.2]], atol=1e-12
    )  # rounding
    assert robot.collision_mesh("turret") is cylinder
    assert robot.collision_mesh("camera") is None
    with pytest.raises(ValueError, match="has no link 'nose'; its links are: ground, pedestal"):
        robot.collision_mesh("nose")


def test_curved_primitives_are_close_to_their_surface() -> None:
    for shape in ('<sphere radius="1"/>', '<cylinder radius="1" length="2"/>'):
        text = re.sub(r"<box [^>]*/>", shape, planar_arm(1)).replace(
            '<collision>\n      <origin xyz="0.25 0 0"/>', "<collision>"
        )
        mesh = Robot.from_urdf(text).collision_mesh("link1")
        assert mesh is not None
        side = (
            np.abs(mesh.face_normals[:, 2]) < 0.999 if "cylinder" in shape else np.ones(len(mesh.faces), bool)
        )
        distance = np.einsum("ij,ij->i", mesh.triangles_center, mesh.face_normals)[side]
        assert 1.0 - 0.0015 < distance.min() < distance.max() < 1.0  # what Geometry.mesh promises


def test_robot_without_geometry_moves_but_has_no_mesh() -> None:
    robot = Robot.from_urdf(re.sub(r"<collision>.*?</collision>", "", planar_arm(2), flags=re.DOTALL))
    np.testing.assert_allclose(robot.pose([0, 0], "tip")[:3, 3], [1, 0, 0])
    with pytest.raises(
        ValueError, match="has no geometry: no link of its URDF has a <collision> or <visual>"
    ):
        robot.collision_mesh("link1")


def test_inertia_is_rotated_into_link_axes() -> None:
    text = planar_arm(1).replace(
        '<origin xyz="0.25 0 0"/>', '<origin xyz="0.25 0 0" rpy="0 0 1.5707963267948966"/>'
    )
    turned, plain = (Robot.from_urdf(t).link("link1").inertial for t in (text, planar_arm(1)))
    assert turned is not None
    assert plain is not None
    np.testing.assert_allclose(
        np.diag(turned.inertia), np.diag(plain.inertia)[[1, 0, 2]], rtol=1e-12
    )  # rounding


def test_fingerprint_follows_content(tmp_path: Path) -> None:
    plain = Robot.from_urdf(planar_arm(2))
    assert re.fullmatch("[0-9a-f]{64}", plain.fingerprint)
    assert (
        plain.fingerprint == Robot.from_urdf(planar_arm(2), acceleration_limits=1, name="other").fingerprint
    )
    others = [
        Robot.from_urdf(planar_arm(3)),
        Robot.from_urdf(planar_arm(2, link_length=0.5001)),
        Robot.from_urdf(planar_arm(2).replace("0.08 0.08", "0.08 0.0801", 1)),
        Robot.from_urdf(planar_arm(3), locked={"joint3": 0.1}),
        Robot.from_urdf(planar_arm(3), locked={"joint3": 0.2}),
    ]
    assert len({plain.fingerprint, *(robot.fingerprint for robot in others)}) == 6
    mesh = tmp_path / "link.stl"
    text = re.sub(r"<box [^>]*/>", f'<mesh filename="{mesh}"/>', planar_arm(1), count=1)
    prints = []
    for length in (1.0, 1.0, 2.0):
        sidestep.Robot.from_urdf(planar_arm(1, link_length=length)).collision_mesh("link1").export(mesh)
        prints.append(Robot.from_urdf(text).fingerprint)
    assert prints[0] == prints[1] != prints[2]


def test_planar_arm() -> None:
    robot = Robot.from_urdf(planar_arm(3, link_length=0.2))
    a, b, c = q = np.array([0.3, -0.5, 0.8])
    expected = [0.2 * (np.cos(a) + np.cos(a + b) + np.cos(a + b + c)),
                0.2 * (np.sin(a) + np.sin(a + b) + np.sin(a + b + c)), 0.0]  # fmt: skip
    np.testing.assert_allclose(robot.pose(q, "tip")[:3, 3], expected, atol=1e-15)  # rounding
    np.testing.assert_array_equal(robot.bias(q, np.zeros(3)), 0.0)  # gravity does not load it
    # stretched, the effort limit gives the first joint 10 rad/s^2
    stretched = Robot.named("planar2")
    inertia = stretched.mass_matrix([0, 0])[0, 0]
    assert stretched.limits.effort[0] / inertia == pytest.approx(10.0, rel=0.05)  # the links have a width
    for count, length in ((0, 0.5), (2, 0.0), (2, np.nan)):
        with pytest.raises(ValueError, match="must be"):
            planar_arm(count, link_length=length)


def test_limits_of_jerk_and_torque_rate_are_given_beside_the_description() -> None:
    robot = Robot.from_urdf(planar_arm(2), acceleration_limits=[3.0, 4.0])
    np.testing.assert_array_equal(robot.limits.jerk, [300.0, 400.0])
    assert np.isinf(robot.limits.effort_rate).all()
    given = Robot.from_urdf(
        planar_arm(2), acceleration_limits=[3.0, 4.0], jerk_limits=[50.0, 60.0], effort_rate_limits=700.0
    )
    np.testing.assert_array_equal(given.limits.jerk, [50.0, 60.0])
    np.testing.assert_array_equal(given.limits.effort_rate, [700.0, 700.0])
    with pytest.raises(ValueError, match="jerk_limits"):
        Robot.from_urdf(planar_arm(2), jerk_limits=[1.0, 2.0, 3.0])
    for name in ("jerk_limits", "effort_rate_limits"):
        with pytest.raises(ValueError, match=r"-1\.0"):
            Robot.from_urdf(planar_arm(2), **{name: -1.0})
