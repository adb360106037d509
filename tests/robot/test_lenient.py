"""What other readers of URDF accept loads: with the values that they take, and one warning of each kind."""

import re
import warnings
from collections.abc import Callable

import numpy as np
import pytest

from sidestep.robot import Robot, planar_arm

TWO = planar_arm(2)
Edit = Callable[[str], str]


def load(text: str, **options: object) -> tuple[Robot, list[str]]:
    """The robot and its warnings, which name the caller's file."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        robot = Robot.from_urdf(text, **options)  # type: ignore[arg-type]
    assert all(item.filename == __file__ and item.category is RuntimeWarning for item in caught)
    return robot, [str(item.message) for item in caught]


def same_kinematics(robot: Robot, text: str) -> None:
    """Poses of every link at 20 configurations are those of Pinocchio's own reader, to rounding."""
    pin = pytest.importorskip("pinocchio")
    model = pin.buildModelFromXML(text)
    data = model.createData()
    rng = np.random.default_rng(5)
    assert model.nq == robot.num_coordinates
    for _ in range(20):
        q = rng.uniform(-1.0, 1.0, model.nq)
        pin.framesForwardKinematics(model, data, q)
        for link in robot.links:
            expected = data.oMf[model.getFrameId(link.name)].homogeneous
            np.testing.assert_allclose(robot.pose(q, link.name), expected, atol=1e-12)


@pytest.mark.parametrize("limit", ["effort", "velocity"])
@pytest.mark.parametrize("written", ["0", "0.0", "-1", "", None])
def test_a_limit_of_zero_or_none_counts_as_not_given(limit: str, written: str | None) -> None:
    attribute = "" if written is None else f' {limit}="{written}"'
    text = re.sub(rf' {limit}="[^"]*"', attribute, TWO)
    robot, said = load(text)
    assert np.isinf(getattr(robot.limits, limit)).all()
    other = "velocity" if limit == "effort" else "effort"
    np.testing.assert_array_equal(getattr(robot.limits, other), getattr(Robot.from_urdf(TWO).limits, other))
    assert len(said) == 1
    assert said[0].startswith(f"URDF string: joint 'joint1', joint 'joint2': no {limit} limit is given")
    assert f"{limit}_limits={{'joint1': " in said[0]
    if written and float(written) == 0.0:  # Pinocchio refuses negative ones
        same_kinematics(robot, text)


def test_only_joints_that_lack_a_limit_are_named() -> None:
    text = re.sub(r'effort="[^"]*"', 'effort="0"', TWO, count=1)
    assert "joint 'joint1': no effort" in load(text)[1][0]
    assert load(text, locked={"joint1": 0.2})[1] == []
    robot, said = load(text, effort_limits={"joint1": 87})
    assert said == []
    np.testing.assert_array_equal(robot.limits.effort, [87.0, Robot.from_urdf(TWO).limits.effort[1]])


@pytest.mark.parametrize(
    "name", ["effort_limits", "velocity_limits", "acceleration_limits", "jerk_limits", "effort_rate_limits"]
)
def test_limits_by_joint(name: str) -> None:
    field = name.removesuffix("_limits")
    usual = getattr(Robot.from_urdf(TWO).limits, field)
    robot = Robot.from_urdf(TWO, **{name: {"joint2": 3.5}})  # type: ignore[arg-type]
    np.testing.assert_array_equal(getattr(robot.limits, field), [usual[0], 3.5])
    with pytest.raises(
        ValueError, match=f"{name}: the robot has no coordinate 'elbow'; its joints are: joint1, joint2"
    ):
        Robot.from_urdf(TWO, **{name: {"elbow": 1.0}})  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=rf"{name}: -1.0 for 'joint2', must be positive"):
        Robot.from_urdf(TWO, **{name: {"joint2": -1.0}})  # type: ignore[arg-type]


def test_implausible_limits_are_said_with_their_value_and_cause() -> None:
    fast = re.sub(r'velocity="[^"]*"', 'velocity="180"', TWO)
    robot, said = load(fast)
    np.testing.assert_array_equal(robot.limits.velocity, [180.0, 180.0])
    assert len(said) == 1
    assert "velocity limit 180 of joint 'joint1', velocity limit 180 of joint 'joint2'" in said[0]
    assert "deg/s in place of rad/s" in said[0]
    assert load(fast, velocity_limits=3.0)[1] == []
    assert "effort limit 1e+09" in load(re.sub(r'effort="[^"]*"', 'effort="1e9"', TWO))[1][0]


MILLIMETRES = ": looks like millimetres; metres are expected"


def boxed(shape: str) -> Edit:
    return lambda text: re.sub(r'<box size="[^"]*"/>', shape, text, count=1)


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (lambda t: t.replace('xyz="0.5 0 0"', 'xyz="500 0 0"', 1), "origin 500 0 0 of joint 'joint2'"),
        (boxed('<box size="40 30 25"/>'), "box (40 30 25) of link 'link1'"),
        (boxed('<box size="0.04 0.04 250"/>'), "box (0.04 0.04 250) of link 'link1'"),
        (boxed('<sphere radius="40"/>'), "sphere (40) of link 'link1'"),
        (boxed('<cylinder radius="40" length="250"/>'), "cylinder (40 250) of link 'link1'"),
        (boxed('<capsule radius="4" length="25"/>'), "capsule (4 25) of link 'link1'"),
        (lambda t: t.replace('<inertial><origin xyz="0.25', '<inertial><origin xyz="250', 1),
         "<inertial> of link 'link1' at 250 0 0"),
        (lambda t: t.replace('<collision><origin xyz="0.25', '<collision><origin xyz="250', 1),
         "origin 250 0 0 of a shape of link 'link1'"),
    ],
)  # fmt: skip
def test_lengths_in_millimetres_are_named(edit: Edit, said: str) -> None:
    flat = re.sub(r">\s+<", "><", TWO)
    assert edit(flat) != flat
    assert load(edit(flat))[1] == [f"URDF string: {said}{MILLIMETRES}"]


def test_strokes_in_millimetres_are_named() -> None:
    text = TWO.replace("revolute", "prismatic", 1)
    text = re.sub(
        r"<limit [^>]*>", '<limit lower="-0.1" upper="800" velocity="500" effort="9"/>', text, count=1
    )
    assert load(text)[1] == [
        "URDF string: velocity limit 500 of joint 'joint1': so fast is no slide joint; the likely cause is mm/s in "
        "place of m/s, or a placeholder: pass velocity_limits",
        f"URDF string: upper limit 800 of joint 'joint1'{MILLIMETRES}",
    ]
    assert load(text.replace('"800"', '"1e9"').replace('"500"', '"1"'))[1] == []  # no limit is meant


def test_floors_and_walls_are_no_millimetres() -> None:
    for size in ("100 100 0.2", "30 0.1 4"):
        assert load(boxed(f'<box size="{size}"/>')(TWO))[1] == []


def test_limits_of_zero_to_zero_are_not_given() -> None:
    text = re.sub(r'lower="[^"]*" upper="[^"]*"', 'lower="0" upper="0"', TWO)
    for written in (text, text.replace('lower="0" upper="0" ', "")):
        robot, said = load(written)
        assert np.isinf(robot.limits.lower).all()
        assert np.isinf(robot.limits.upper).all()
        assert len(said) == 1
        assert "joint 'joint1', joint 'joint2': lower and upper limit are both 0" in said[0]
        same_kinematics(robot, written)


def test_a_joint_with_one_place_is_held_there() -> None:
    text = re.sub(r'lower="[^"]*" upper="[^"]*"', 'lower="0.5" upper="0.5"', TWO, count=1)
    robot, said = load(text)
    assert robot.held == {"joint1": 0.5}
    assert said == [
        "URDF string: joint 'joint1' (0.5): lower and upper limit are the same, so that it is held there"
    ]
    np.testing.assert_allclose(
        robot.pose([0.3], "tip"), Robot.from_urdf(TWO).pose([0.5, 0.3], "tip"), atol=1e-15
    )
    assert load(text, locked={"joint1": 0.5})[1] == []


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_a_free_base_is_held_at_a_pose(kind: str) -> None:
    joint = f'<joint name="free" type="{kind}"><parent link="world"/><child link="base"/>'
    joint += '<origin xyz="0 0 0.4"/></joint>'
    text = TWO.replace("</robot>", f'<link name="world"/>{joint}</robot>')
    robot, said = load(text)
    assert robot.num_coordinates == 2
    assert said == [
        f"URDF string: {kind} joint 'free': has several coordinates, and is held where it is written; pass its pose "
        "in locked to hold it elsewhere"
    ]
    np.testing.assert_allclose(robot.pose([0, 0], "tip")[:3, 3], [1.0, 0.0, 0.4], atol=1e-15)
    for pose in (
        [0.1, 0.2, 0.3, 0.0, 0.0, np.pi / 2],
        [[0, -1, 0, 0.1], [1, 0, 0, 0.2], [0, 0, 1, 0.3], [0, 0, 0, 1]],
    ):
        robot, said = load(text, locked={"free": pose})
        assert said == []
        np.testing.assert_allclose(robot.pose([0, 0], "tip")[:3, 3], [0.1, 1.2, 0.7], atol=1e-15)
    with pytest.raises(ValueError, match=r"'free' has shape \(\); allowed: a pose \(4, 4\), or x, y, z"):
        Robot.from_urdf(text, locked={"free": 0.0})
    with pytest.raises(ValueError, match="can be locked: joint1, joint2, free"):
        Robot.from_urdf(text, locked={"nothing": 0.0})


def shape_of(shapes: str) -> tuple[Robot, list[str]]:
    """An arm whose last link has these shapes in its <geometry>."""
    head, _, last = TWO.rpartition("<geometry>")
    return load(head + re.sub(r"^.*?</geometry>", f"<geometry>{shapes}</geometry>", last, flags=re.DOTALL))


def bounds(robot: Robot) -> np.ndarray:
    mesh = robot.collision_mesh("link2")
    assert mesh is not None
    return np.asarray(mesh.bounds) - [0.25, 0.0, 0.0]  # the origin of the collision element


def test_a_capsule_is_read() -> None:
    robot, said = shape_of('<capsule radius="0.05" length="0.3"/>')
    assert said == []
    np.testing.assert_allclose(bounds(robot), [[-0.05, -0.05, -0.2], [0.05, 0.05, 0.2]], atol=1e-12)
    mesh = robot.collision_mesh("link2")
    assert mesh is not None
    volume = np.pi * 0.05**2 * 0.3 + 4 / 3 * np.pi * 0.05**3
    assert mesh.volume == pytest.approx(volume, rel=3e-3)  # an inscribed polyhedron


@pytest.mark.parametrize(
    "shape",
    ['<box size="0 0 0"/>', '<sphere radius="0"/>', '<cylinder radius="0" length="0"/>',
     '<capsule radius="0" length="0"/>'],
)  # fmt: skip
def test_a_shape_without_size_is_left_out(shape: str) -> None:
    robot, said = shape_of(shape)
    assert robot.link("link2").collisions == ()
    assert len(said) == 1
    assert re.search(r"link 'link2': <collision> \w+ \(.*\): has the size zero, and is left out", said[0])


def test_a_flat_shape_keeps_its_surface() -> None:
    robot, said = shape_of('<box size="0.4 0 0.2"/>')
    np.testing.assert_allclose(bounds(robot), [[-0.2, -0.0005, -0.1], [0.2, 0.0005, 0.1]], atol=1e-15)
    assert said == [
        "URDF string: link 'link2': <collision> box (0.4, 0.0, 0.2): has a size of zero in some direction; 1 mm are "
        "taken there"
    ]


def test_elements_beside_a_shape_do_not_hide_it() -> None:
    for shapes in ('<box size="1 2 3"/><material name="x"/>', '<material name="x"/><box size="1 2 3"/>'):
        robot, said = shape_of(shapes)
        np.testing.assert_allclose(bounds(robot), [[-0.5, -1, -1.5], [0.5, 1, 1.5]])
        assert len(said) == 1
        assert "<material>: stands in <geometry> and is no shape" in said[0]
    robot, said = shape_of('<box size="1 1 1"/><sphere radius="2"/>')
    assert [item.kind for item in robot.link("link2").collisions] == ["box", "sphere"]
    assert "several shapes, where one is allowed; all are kept" in said[0]
    robot, said = shape_of("")
    assert robot.link("link2").collisions == ()
    assert "link 'link2': <collision>: holds no <geometry>, and is left out" in said[0]


def test_angles_that_are_left_out_are_zero() -> None:
    text = TWO.replace('<origin xyz="0.5 0 0"/>', '<origin xyz="0.5 0 0" rpy="0.1 0.2"/>', 1)
    robot, said = load(text)
    assert said == [
        "URDF string: joint 'joint2': rpy '0.1 0.2': rpy has fewer than 3 numbers; those that are left out count as 0"
    ]
    whole = Robot.from_urdf(text.replace('rpy="0.1 0.2"', 'rpy="0.1 0.2 0"'))
    np.testing.assert_array_equal(robot.pose([0.3, 0.4], "tip"), whole.pose([0.3, 0.4], "tip"))
    with pytest.raises(ValueError, match="rpy is '0 0 0 0', must be 3 finite numbers"):
        Robot.from_urdf(text.replace('rpy="0.1 0.2"', 'rpy="0 0 0 0"'))


def test_commas_between_numbers_are_left_out() -> None:
    text = TWO.replace('<origin xyz="0.5 0 0"/>', '<origin xyz="0.5, 0, 0" rpy="0.1, 0.2 0.3"/>', 1)
    robot, said = load(text)
    assert said == [
        "URDF string: joint 'joint2': <origin>: rpy '0.1, 0.2 0.3', joint 'joint2': <origin>: xyz '0.5, 0, 0': there "
        "are commas between numbers, where spaces are asked for; they are left out"
    ]
    same_kinematics(robot, text.replace(",", ""))
    with pytest.raises(ValueError, match="xyz is '0,5 0 0 0', must be 3 finite numbers"):
        Robot.from_urdf(TWO.replace('xyz="0.5 0 0"', 'xyz="0,5 0 0 0"', 1))  # a decimal comma is none of them


def test_prefixes_that_nothing_declares_are_read_over() -> None:
    """Drake's limits in files of robots, and Gazebo's plugins."""
    extra = '<gazebo><controller:plugin name="p"><!-- é --></controller:plugin></gazebo></robot>'
    text = TWO.replace("<limit ", '<limit drake:acceleration="2.5" ').replace("</robot>", extra)
    robot, said = load(text)
    assert "drake" in text
    assert said == []
    same_kinematics(robot, TWO)
    np.testing.assert_array_equal(robot.limits.upper, Robot.from_urdf(TWO).limits.upper)
    with pytest.raises(ValueError, match="unbound prefix"):
        Robot.from_urdf(TWO.replace("</robot>", '<xacro:include filename="hand.xacro"/></robot>'))
    with pytest.raises(ValueError, match="not well-formed XML: mismatched tag"):
        Robot.from_urdf(text.replace("</gazebo>", ""))


@pytest.mark.parametrize(
    ("edit", "said", "inertia"),
    [
        (lambda t: re.sub(r"<inertia .*/>", "", t, count=1), "link 'link1': <inertial> has no whole <inertia>", 0.0),
        (lambda t: re.sub(r' izz="[^"]*"', "", t, count=1), "link 'link1': <inertial> has no whole <inertia>", 0.0),
        (lambda t: re.sub(r"<mass .*/>", "", t, count=1), "link 'link1': <inertial> has no <mass>", None),
        (lambda t: t.replace('ixx="', 'ixx="-', 1), r"link 'link1' (-0.000922, 0.0185, 0.0185 kg m^2 at 0.864 kg): no "
         "rigid body has such an inertia", -0.00091),
        (lambda t: re.sub(r'ixx="[^"]*"', 'ixx="1"', t, count=1), "(0.0185, 0.0185, 1 kg m^2 at 0.864 kg): no", 1),
        (lambda t: re.sub(r'i(xx|yy|zz)="[^"]*"', r'i\1="18500"', t, count=3), "kg mm^2 or g mm^2 in place", 18500),
    ],
)  # fmt: skip
def test_inertias_that_are_not_whole_or_impossible(edit: Edit, said: str, inertia: float | None) -> None:
    robot, warned = load(edit(TWO))
    assert len(warned) == 1
    assert said in warned[0]
    inertial = robot.link("link1").inertial
    assert (inertial is None) == (inertia is None)
    if inertial is not None and inertia is not None:
        assert inertial.mass == pytest.approx(0.864)
        assert inertial.inertia[0, 0] == pytest.approx(inertia, rel=0.02)
        np.testing.assert_array_equal(inertial.com, [0.25, 0, 0])


def test_many_items_of_a_kind_are_one_warning() -> None:
    text = re.sub(r'effort="[^"]*"', 'effort="0"', planar_arm(20))
    (said,) = load(text)[1]
    assert "joint 'joint12' and 8 more: no effort" in said


def test_a_whole_file_has_no_remarks() -> None:
    for name in ("fr3", "panda", "ur5", "xarm7", "z1", "planar2"):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            Robot.named(name)
