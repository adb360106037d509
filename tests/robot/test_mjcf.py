"""MJCF: every trait of the file against MuJoCo itself."""

import sys
import warnings
from pathlib import Path

import mujoco
import numpy as np
import numpy.typing as npt
import pytest
import trimesh

from sidestep._core import JointType
from sidestep.robot import Robot
from sidestep.robot.mjcf import is_mjcf

Array = npt.NDArray[np.float64]
EXACT = 1e-12  # rounding of a chain of a few poses of the order of 1 m
LIMITS = {"velocity_limits": 1.0, "effort_limits": 10.0}  # given, so that nothing warns of their absence

HINGE = '<joint name="j1" axis="0 0 1" range="-90 90"/><geom size="0.1"/>'


def model_of(body: str, rest: str = "", top: str = "") -> str:
    return f'<mujoco model="arm">{top}<worldbody>{body}</worldbody>{rest}</mujoco>'


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path / "cache"))


def positions(model: mujoco.MjModel, robot: Robot, q: Array) -> tuple[Array, Array]:
    """MuJoCo's qpos, and the motion of its velocities per coordinate, at q of the robot."""
    qpos, J = model.qpos0.copy(), np.zeros((model.nv, robot.num_coordinates))
    for joint in robot.joints:
        index = model.joint(joint.name).id
        qpos[model.jnt_qposadr[index]] = joint.multiplier * q[joint.coordinate] + joint.offset
        J[model.jnt_dofadr[index], joint.coordinate] = joint.multiplier
    return qpos, J


def check_against_mujoco(xml: str, robot: Robot, *, samples: int = 5) -> None:
    """Frames of bodies and sites, mass matrix without armature, and bias."""
    spec = mujoco.MjSpec.from_string(xml)
    for joint in spec.joints:
        joint.armature = 0.0
    model = spec.compile()
    data, rng = mujoco.MjData(model), np.random.default_rng(3)
    frames = {model.body(i).name: ("xpos", "xmat", i) for i in range(model.nbody)}
    frames |= {model.site(i).name: ("site_xpos", "site_xmat", i) for i in range(model.nsite)}
    for _ in range(samples):
        q, v = robot.random_configuration(rng), rng.normal(size=robot.num_coordinates)
        data.qpos[:], J = positions(model, robot, q)
        data.qvel[:] = J @ v
        mujoco.mj_forward(model, data)
        for frame in robot.frames:
            if frame.name in frames:
                position, rotation, index = frames[frame.name]
                X = robot.pose(q, frame.name)
                np.testing.assert_allclose(X[:3, 3], getattr(data, position)[index], atol=EXACT)
                np.testing.assert_allclose(
                    X[:3, :3], getattr(data, rotation)[index].reshape(3, 3), atol=EXACT
                )
        M = np.zeros((model.nv, model.nv))
        for column in range(model.nv):  # by unit vectors: the signature of mj_fullM depends on the version
            mujoco.mj_mulM(model, data, M[column], np.eye(model.nv)[column])
        np.testing.assert_allclose(robot.mass_matrix(q), J.T @ M @ J, rtol=1e-10, atol=EXACT)
        np.testing.assert_allclose(robot.bias(q, v), J.T @ data.qfrc_bias, rtol=1e-9, atol=1e-11)


ARM = model_of(
    """
    <geom type="plane" size="5 5 0.1"/>
    <body name="base" pos="0.1 0.2 0.3" euler="10 20 30"><geom type="box" size="0.1 0.1 0.05" mass="2"/>
      <body name="a" pos="0 0 0.1" quat="1 0.2 0.3 0.4">
        <inertial pos="0.01 0.02 0.03" quat="1 0.5 0.2 0" mass="1.5" diaginertia="0.03 0.02 0.012"/>
        <joint name="j1" axis="1 2 3" pos="0.02 -0.03 0.04" range="-100 80"/>
        <geom type="capsule" size="0.03 0.1"/>
        <body name="b" pos="0.1 0.2 0.3" euler="0 45 0">
          <joint name="j2" type="slide" axis="0 1 1" range="-0.1 0.2" pos="0.3 0.2 0.1"/>
          <joint name="j3" axis="0 0 1" pos="0.05 0 0" range="-40 40" ref="25" armature="0.3"/>
          <joint name="j4" axis="1 0 0"/>
          <geom type="cylinder" size="0.02 0.1" mass="0.7" fromto="0 0 0 0.1 0.1 0.2"/>
          <site name="tool" pos="0 0 0.2" euler="0 90 0"/>
        </body>
      </body>
    </body>""",
    '<actuator><motor joint="j1" gear="50" ctrlrange="-1 1"/></actuator>',
)


def test_anchors_references_chains_and_inertias_are_those_of_mujoco() -> None:
    robot = Robot.from_mjcf(ARM, **LIMITS)
    assert (robot.name, robot.coordinate_names) == ("arm", ["j1", "j2", "j3", "j4"])
    assert [joint.type for joint in robot.joints] == [
        JointType.revolute, JointType.prismatic, JointType.revolute, JointType.revolute,
    ]  # fmt: skip
    np.testing.assert_allclose(robot.limits.lower[:3], [np.radians(-100), -0.1, np.radians(-40)])
    assert np.isinf(robot.limits.upper[3])  # a hinge without limits is continuous
    assert {"world", "base", "a", "b", "tool"} <= {link.name for link in robot.links}
    check_against_mujoco(ARM, robot)


def test_base_pose_and_tip_and_locks_are_as_of_urdf() -> None:
    lifted = np.eye(4)
    lifted[2, 3] = 1.0
    robot = Robot.from_mjcf(ARM, base_pose=lifted, tip="a", **LIMITS)
    assert robot.coordinate_names == ["j1"]
    assert Robot.from_mjcf(ARM, locked={"j2": 0.1}, **LIMITS).held == {"j2": 0.1}
    q = np.zeros(1)
    np.testing.assert_allclose(
        robot.pose(q, "a"), lifted @ Robot.from_mjcf(ARM, tip="a", **LIMITS).pose(q, "a")
    )


def test_content_decides_not_the_suffix(tmp_path: Path) -> None:
    for suffix in ("xml", "mjcf", "urdf"):
        path = tmp_path / f"arm.{suffix}"
        path.write_text(f'<?xml version="1.0"?>\n<!-- <robot> -->\n{ARM}')
        assert is_mjcf(path)
        assert Robot.from_urdf(path, **LIMITS).coordinate_names == ["j1", "j2", "j3", "j4"]
    (tmp_path / "scene.mjcf").write_text('<mujoco><include file="arm.xml"/></mujoco>')
    assert Robot.from_urdf(tmp_path / "scene.mjcf", **LIMITS).num_coordinates == 4
    assert not is_mjcf(tmp_path / "missing.xml")
    assert not is_mjcf('<robot name="mujoco"/>')
    with pytest.raises(ValueError, match="package_dirs, xacro_arguments and srdf are of URDF"):
        Robot.from_urdf(ARM, package_dirs=[tmp_path])


def test_errors_say_what_is_wrong(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="does not exist"):
        Robot.from_mjcf(tmp_path / "none.xml")
    with pytest.raises(ValueError, match="root element must be <mujoco>"):
        Robot.from_mjcf("<robot/>")
    with pytest.raises(ValueError, match=r"MJCF string is refused by MuJoCo: .*unrecognized element"):
        Robot.from_mjcf("<mujoco><nonsense/></mujoco>")
    with pytest.raises(ValueError, match="no body that moves by a hinge or slide joint"):
        Robot.from_mjcf(model_of('<body><freejoint/><geom size="1"/></body>'))
    mesh = '<asset><mesh name="m" file="gone.stl"/></asset>'
    with pytest.raises(FileNotFoundError, match=r"gone\.stl"):
        Robot.from_mjcf(model_of(f'<body>{HINGE}<geom type="mesh" mesh="m"/></body>', mesh))


def test_without_mujoco_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(ModuleNotFoundError, match="mujoco"):
        Robot.from_mjcf(ARM)


def test_limits_of_the_actuators() -> None:
    joints = "".join(
        f'<body name="b{i}"><joint name="j{i}" {extra}/><geom size="0.1"/></body>'
        for i, extra in enumerate(["", "", "", "", "", "", 'actuatorfrcrange="-3 2"', 'type="slide"'])
    )
    xml = model_of(
        joints,
        """<tendon><fixed name="t"><joint joint="j5" coef="-0.5"/></fixed></tendon><actuator>
        <motor joint="j0" gear="-50" ctrlrange="-1 2"/>
        <motor joint="j1" gear="2" forcerange="-30 20"/>
        <position joint="j2" kp="100" ctrlrange="-3 3" forcerange="-87 87"/>
        <position joint="j3" kp="100" ctrlrange="-3 3"/>
        <velocity joint="j4" kv="10" gear="2" ctrlrange="-3 1" forcerange="-5 5"/>
        <general tendon="t" biastype="affine" gainprm="9" biasprm="0 -9 -1" ctrlrange="0 255" forcerange="-8 8"/>
        <motor joint="j6" gear="10" ctrlrange="-1 1"/><motor joint="j7"/></actuator>""",
    )
    with pytest.warns(RuntimeWarning) as caught:
        robot = Robot.from_mjcf(xml)
    np.testing.assert_allclose(robot.limits.effort, [100, 60, 87, np.inf, 10, 4, 3, np.inf])
    np.testing.assert_allclose(robot.limits.velocity, [2, 2, 2, 2, 1.5, 2, 2, 0.2])
    (warning,) = caught
    text = str(warning.message)
    assert "no velocity limits for j0, j1, j2, j3, j5, j6 and 1 more (taken as 2.0 rad/s, 0.2 m/s" in text
    assert "no effort limits for j3, j7 (taken as unlimited; give effort_limits)" in text
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert Robot.from_mjcf(xml, **LIMITS).limits.velocity.tolist() == [1.0] * 8


FINGERS = """<body name="hand"><geom size="0.05"/>
    <body name="left"><joint name="left" type="slide" axis="0 1 0" range="0 0.04" ref="0.01"/><geom size="0.01"/></body>
    <body name="right"><joint name="right" type="slide" axis="0 -1 0" range="0 0.1"/><geom size="0.01"/></body>
    <body name="thumb"><joint name="thumb" axis="0 0 1" range="-90 90" ref="20"/>
    <geom size="0.01" pos="0.1 0 0"/></body>
    </body>"""


@pytest.mark.parametrize(("actuated", "leader"), [("right", "right"), ("left", "left")])
def test_joint_equalities_are_mimics_of_the_actuated_joint(actuated: str, leader: str) -> None:
    xml = model_of(
        FINGERS,
        f"""<equality><joint joint1="left" joint2="right" polycoef="0.002 0.5 0 0 0"/>
        <joint joint1="thumb" polycoef="0.1 0 0 0 0"/></equality>
        <actuator><motor joint="{actuated}" ctrlrange="-1 1"/></actuator>""",
    )
    robot = Robot.from_mjcf(xml, **LIMITS)
    assert robot.coordinate_names == [leader]
    # 0 <= left <= 0.04 and 0 <= right <= 0.1 both hold
    bounds = {"right": (0.0, 0.056), "left": (0.012, 0.04)}[leader]
    np.testing.assert_allclose([robot.limits.lower[0], robot.limits.upper[0]], bounds, atol=EXACT)
    q = np.array([0.02])
    at = {joint.name: joint.multiplier * q[joint.coordinate] + joint.offset for joint in robot.joints}
    # MuJoCo: left - 0.01 = 0.002 + 0.5 (right - 0)
    assert at["left"] == pytest.approx(0.012 + 0.5 * at["right"], abs=EXACT)
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    data.qpos[:] = [at["left"], at["right"], np.radians(20) + 0.1]
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.efc_pos[:2], 0.0, atol=EXACT)  # MuJoCo's own residuals of both equations
    for name in ("left", "right", "thumb"):
        np.testing.assert_allclose(robot.pose(q, name)[:3, 3], data.body(name).xpos, atol=EXACT)
        np.testing.assert_allclose(robot.pose(q, name)[:3, :3].ravel(), data.body(name).xmat, atol=EXACT)


def test_couplings_by_a_curve_and_loops_are_left_open() -> None:
    curve = '<equality><joint joint1="left" joint2="right" polycoef="0 1 2 0 0"/>{}</equality>'
    with pytest.warns(RuntimeWarning, match="joints left and right are coupled by a curve, not a line"):
        robot = Robot.from_mjcf(model_of(FINGERS, curve.format("")), **LIMITS)
    assert robot.coordinate_names == ["left", "right", "thumb"]
    loop = '<equality><connect body1="left" body2="right" anchor="0 0 0"/></equality>'
    with pytest.warns(RuntimeWarning, match="links left and right close loops"):
        Robot.from_mjcf(model_of(FINGERS, loop), **LIMITS)


def test_of_joints_alike_the_first_leads_all() -> None:
    both = (
        """<equality><joint joint1="left" joint2="thumb"/><joint joint1="right" joint2="thumb"/></equality>"""
    )
    robot = Robot.from_mjcf(model_of(FINGERS, both), **LIMITS)
    assert robot.coordinate_names == ["left"]


def test_a_coupling_in_a_circle_is_left_out() -> None:
    twice = (
        """<equality><joint joint1="left" joint2="right"/><joint joint1="right" joint2="left"/></equality>"""
    )
    with pytest.warns(RuntimeWarning, match="coupled once more than they can be"):
        assert Robot.from_mjcf(model_of(FINGERS, twice), **LIMITS).num_coordinates == 2


def test_ball_and_free_joints_are_held_with_a_warning() -> None:
    xml = model_of(
        f"""<body name="trunk" pos="0 0 1" euler="0 0 90"><freejoint name="float"/><geom size="0.1"/>
        <body name="neck" pos="0 0 0.1"><joint name="ball" type="ball"/><geom size="0.1"/>
        <body name="arm" pos="0.3 0 0">{HINGE}</body></body></body>"""
    )
    with pytest.warns(RuntimeWarning, match=r"joints float, ball \(ball or free\) are held"):
        robot = Robot.from_mjcf(xml, **LIMITS)
    assert robot.coordinate_names == ["j1"]
    check_frames_alone = robot.pose(np.zeros(1), "arm")
    np.testing.assert_allclose(check_frames_alone[:3, 3], [0.0, 0.3, 1.1], atol=EXACT)


def test_objects_furniture_and_the_floor_are_left_out() -> None:
    xml = model_of(
        f"""<geom type="plane" size="1 1 1"/><geom type="box" size="1 1 0.01" pos="0 0 -1"/>
        <body name="arm">{HINGE}</body>
        <body name="cube"><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body>
        <body name="table"><geom type="box" size="0.1 0.1 0.1"/></body>
        <body name="door"><joint name="door"/><geom size="0.1"/></body>
        <body name="mark"/>""",
        '<actuator><motor joint="j1" ctrlrange="-1 1"/></actuator>',
    )
    text = "bodies cube, table, door, 1 shapes of the world itself left out: not part of the robot"
    with pytest.warns(RuntimeWarning, match=text):
        robot = Robot.from_mjcf(xml, **LIMITS)
    assert [link.name for link in robot.links] == ["world", "arm"]
    assert robot.coordinate_names == ["j1"]


def test_two_arms_of_one_file_are_one_robot() -> None:
    xml = model_of(
        f'<body name="l">{HINGE}</body><body name="r" pos="1 0 0">{HINGE.replace("j1", "j2")}</body>'
    )
    robot = Robot.from_mjcf(xml, **LIMITS)
    assert robot.coordinate_names == ["j1", "j2"]
    check_against_mujoco(xml, robot)


def test_unnamed_bodies_and_joints_get_names_and_clashes_are_told_apart() -> None:
    xml = model_of(
        """<body><joint axis="0 0 1"/><geom size="0.1"/><body name="x"><joint/><joint type="slide"/><geom size="0.1"/>
        <site name="x" pos="1 0 0"/><site/></body></body>"""
    )
    robot = Robot.from_mjcf(xml, **LIMITS)
    assert robot.coordinate_names == ["body1_joint", "x_joint1", "x_joint2"]
    assert {"body1", "x", "x_site"} <= {link.name for link in robot.links}


def test_every_kind_of_shape_lies_where_mujoco_has_it(tmp_path: Path) -> None:
    wedge = trimesh.Trimesh(
        [[1, 2, 3], [2, 2, 3], [1, 4, 3], [1, 2, 4]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    )
    wedge.export(tmp_path / "wedge.stl")  # off its centre and axes, so that MuJoCo moves and turns it
    (tmp_path / "arm.xml").write_text(
        model_of(
            """<body name="m" pos="0 0 1"><joint name="j1"/>
            <geom type="mesh" mesh="wedge" pos="0.1 0 0" euler="0 0 90"/></body>
            <body name="s"><joint name="j2"/><geom type="capsule" size="0.1 0.3" pos="1 0 0" euler="90 0 0"/></body>
            <body name="e"><joint name="j3"/><geom type="ellipsoid" size="0.1 0.2 0.3" pos="0 1 0"/></body>
            <body name="c"><joint name="j4"/><geom type="cylinder" size="0.1 0.3"/></body>
            <body name="b"><joint name="j5"/><geom type="box" size="0.1 0.2 0.3"/></body>
            <body name="o"><joint name="j6"/><geom size="0.1" pos="0 0 1"/></body>""",
            '<asset><mesh name="wedge" file="wedge.stl" scale="0.1 0.1 0.1"/></asset>',
        )
    )
    robot = Robot.from_mjcf(tmp_path / "arm.xml", **LIMITS)

    def bounds(link: str) -> Array:
        mesh = robot.collision_mesh(link)
        assert mesh is not None
        assert mesh.volume > 0.0
        return np.asarray(mesh.bounds)

    turned = np.array(wedge.vertices) @ [[0, 0.1, 0], [-0.1, 0, 0], [0, 0, 0.1]] + [0.1, 0, 0]
    # MuJoCo keeps vertices as float32
    np.testing.assert_allclose(bounds("m"), [turned.min(axis=0), turned.max(axis=0)], atol=1e-6)
    inscribed = 0.0015 * 0.3  # `Geometry.mesh` of round shapes is that much inside
    np.testing.assert_allclose(bounds("s"), [[0.9, -0.4, -0.1], [1.1, 0.4, 0.1]], atol=inscribed)
    np.testing.assert_allclose(bounds("e"), [[-0.1, 0.8, -0.3], [0.1, 1.2, 0.3]], atol=inscribed)
    np.testing.assert_allclose(bounds("c"), [[-0.1, -0.1, -0.3], [0.1, 0.1, 0.3]], atol=inscribed)
    np.testing.assert_allclose(bounds("b"), [[-0.1, -0.2, -0.3], [0.1, 0.2, 0.3]], atol=EXACT)
    np.testing.assert_allclose(bounds("o"), [[-0.1, -0.1, 0.9], [0.1, 0.1, 1.1]], atol=inscribed)
    again = Robot.from_mjcf(tmp_path / "arm.xml", **LIMITS)
    assert again.fingerprint == robot.fingerprint


def test_visual_shapes_stand_in_for_missing_collision_shapes_alone() -> None:
    unseen = '<geom size="0.2" contype="0" conaffinity="0"/>'
    xml = model_of(
        f"""<body name="base">{unseen}<geom type="plane" size="1 1 1"/><body name="a">{HINGE}{unseen}
        <body name="b"><joint name="j2"/>{unseen}</body></body></body>"""
    )
    with pytest.warns(RuntimeWarning) as caught:
        robot = Robot.from_mjcf(xml, **LIMITS)
    texts = [str(warning.message) for warning in caught]
    assert any(
        "bodies base, b have no collision shapes; their visual ones are used" in text for text in texts
    )
    assert any("shapes without volume are left out: base (plane)" in text for text in texts)
    assert [len(robot.link("a").collisions), len(robot.link("a").visuals)] == [1, 1]
    assert robot.link("b").geometries == robot.link("b").visuals


def test_keyframes_are_postures_and_excludes_allowed_pairs() -> None:
    xml = model_of(
        f"""<body name="cube"><freejoint/><geom size="0.1"/></body>
        <body name="a">{HINGE}<body name="b"><joint name="j2"/><geom size="0.1"/></body></body>""",
        """<contact><exclude body1="a" body2="b"/><exclude body1="cube" body2="b"/></contact>
        <keyframe><key name="home" qpos="0 0 0 1 0 0 0 0.5 -0.25"/><key qpos="0 0 0 1 0 0 0 0.1 0.2"/></keyframe>""",
    )
    with pytest.warns(RuntimeWarning, match="bodies cube left out"):
        robot = Robot.from_mjcf(xml, **LIMITS)
    assert robot.allowed_pairs == (("a", "b"),)
    assert {name: q.tolist() for name, q in robot.postures.items()} == {
        "home": [0.5, -0.25], "key1": [0.1, 0.2],
    }  # fmt: skip
    with pytest.warns(RuntimeWarning, match="bodies cube left out"):
        held = Robot.from_mjcf(xml, locked={"j1": 0.0}, **LIMITS)
    assert held.postures["home"].tolist() == [-0.25]
    robot.postures["home"][:] = 9.0  # a copy
    assert robot.postures["home"].tolist() == [0.5, -0.25]


def limited(joint: str, *, unit: str = "radian", top: str = "") -> str:
    """An arm of two hinges, of which the first is written as given."""
    body = f"""<body name="a"><joint name="j1" {joint}/><geom size="0.1"/>
        <body name="b" pos="1 0 0"><joint name="j2" range="-1 1"/><geom size="0.1"/></body></body>"""
    return model_of(body, top=f'<compiler angle="{unit}"/>{top}')


def said_of(xml: str | Path) -> tuple[Robot, list[str]]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        robot = Robot.from_urdf(xml, **LIMITS)
    assert all(item.filename == __file__ for item in caught)
    return robot, [str(item.message) for item in caught]


@pytest.mark.parametrize("top", ["", '<default><joint range="1 -1"/></default>'])
def test_inverted_limits_are_refused(top: str) -> None:
    xml = limited("" if top else 'range="1 -1"', top=top)
    assert not mujoco.MjModel.from_xml_string(xml).jnt_limited[0]  # MuJoCo takes it as none
    with pytest.raises(ValueError, match=r"joint 'j1': lower limit 1.0 must be below upper -1.0"):
        Robot.from_mjcf(xml, **LIMITS)
    with pytest.raises(ValueError, match=r"lower limit 0\.5 must be below upper 0\.0"):
        Robot.from_mjcf(limited('type="slide" range="0.5 0"'), **LIMITS)
    free = said_of(limited('range="1 -1" limited="false"'))[0]
    assert np.isinf(free.limits.lower[0])


@pytest.mark.parametrize(("unit", "written"), [("radian", "0.5"), ("degree", str(np.degrees(0.5)))])
def test_a_joint_with_one_place_is_held_there(unit: str, written: str) -> None:
    robot, said = said_of(limited(f'range="{written} {written}"', unit=unit))
    assert robot.held == {"j1": pytest.approx(0.5)}
    assert said == [
        "MJCF string: joint 'j1' (0.5): lower and upper limit are the same, so that it is held there"
    ]
    np.testing.assert_allclose(robot.pose([0.0], "b")[:2, 3], [np.cos(0.5), np.sin(0.5)], atol=EXACT)


@pytest.mark.parametrize("written", ["", 'range="0 0"', 'range="0 0" limited="false"'])
def test_no_range_is_no_limit(written: str) -> None:
    robot, said = said_of(limited(written))
    assert (said, robot.limits.lower.tolist()) == ([], [-np.inf, -1.0])


@pytest.mark.parametrize(
    ("joint", "drive", "what"),
    [
        ('actuatorfrcrange="3 -3"', "", "joint 'j1': actuatorfrcrange"),
        ("", '<motor name="m" joint="j1" forcerange="3 -3"/>', "actuator 'm': forcerange"),
        ("", '<motor name="m" joint="j1" ctrlrange="3 -3"/>', "actuator 'm': ctrlrange"),
    ],
)
def test_inverted_efforts_are_refused(joint: str, drive: str, what: str) -> None:
    xml = limited(joint).replace("</mujoco>", f"<actuator>{drive}</actuator></mujoco>")
    with pytest.raises(ValueError, match=f"MJCF string: {what}: lower limit 3.0 must be below upper -3.0"):
        Robot.from_mjcf(xml)


def test_angles_that_look_like_degrees_are_named() -> None:
    robot, said = said_of(limited('range="-90 45" ref="30"').replace('pos="1 0 0"', 'euler="0 90 0"'))
    np.testing.assert_array_equal(robot.limits.upper, [45.0, 1.0])
    assert said == [
        "MJCF string: lower limit -90 of joint 'j1', upper limit 45 of joint 'j1', ref 30 of joint 'j1' and 1 more "
        "looks like degrees; radians are expected"
    ]
    assert said_of(limited('range="-90 45" ref="30"', unit="degree").replace('"-1 1"', '"-9 9"'))[1] == []


def test_millimetres_are_named() -> None:
    said = said_of(limited('type="slide" range="0 800"').replace('pos="1 0 0"', 'pos="300 0 0"'))[1]
    assert said == [
        "MJCF string: upper limit 800 of joint 'j1', origin 300 0 0 of joint 'j2': looks like millimetres; metres are "
        "expected"
    ]


SEEN = '<geom type="mesh" mesh="m" contype="0" conaffinity="0"{}/><geom size="0.1"/>'


def seen(file: str, geoms: str, **texture: str) -> str:
    images = "".join(f'<texture name="t" type="2d" file="{name}"/>' for name in texture.values())
    return model_of(
        f'<body name="a"><joint name="j1" range="-90 90"/>{geoms}</body>',
        f'<asset><mesh name="m" file="{file}"/>{images}</asset>',
        '<compiler meshdir="parts"/>',
    )


def test_visual_files_that_are_missing_are_left_out(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "lfs.stl").write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\n")
    path = tmp_path / "arm.xml"
    for file, fault in (("gone.stl", "does not exist"), ("lfs.stl", "is a Git LFS pointer, not the mesh")):
        for mass, rest in (("", "; masses that come from the shapes lack theirs"), (' mass="0"', "")):
            path.write_text(seen(file, SEEN.format(mass)))
            robot, said = said_of(path)
            assert [shape.kind for shape in robot.link("a").geometries] == ["sphere"]
            assert robot.link("a").visuals == ()
            assert said == [
                f"{path}: visual files that cannot be used are left out: '{file}' ({fault}); collision shapes are "
                f"shown in place of the meshes{rest}"
            ]
    trimesh.creation.box().export(tmp_path / "parts" / "box.stl")
    path.write_text(seen("box.stl", SEEN.format(""), texture="gone.png"))
    robot, said = said_of(path)
    assert len(robot.link("a").visuals) == 1
    assert said == [f"{path}: visual files that cannot be used are left out: 'gone.png' (does not exist)"]


def test_collision_meshes_that_cannot_be_used_are_named(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    path, mesh = tmp_path / "arm.xml", tmp_path / "parts" / "m.stl"
    for geoms in ('<geom type="mesh" mesh="m"/>', SEEN.partition("/>")[0].format("") + "/>"):
        path.write_text(seen("m.stl", geoms))  # a visual mesh alone stands for a collision shape
        mesh.unlink(missing_ok=True)
        with pytest.raises(FileNotFoundError) as gone:
            Robot.from_urdf(path)
        assert f"body 'a' refers to 'm.stl', which does not exist; looked for at {mesh}" in str(gone.value)
        mesh.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\n")
        with pytest.raises(ValueError, match=r"'m\.stl', which is a Git LFS pointer, .*`git lfs pull`"):
            Robot.from_urdf(path)
        box = trimesh.creation.box()
        corners = np.where(np.arange(8)[:, None] == 3, np.nan, box.vertices)
        trimesh.Trimesh(corners, box.faces, process=False).export(mesh)
        with pytest.raises(ValueError, match=r"mesh file '.*m\.stl' holds vertices that are not finite"):
            Robot.from_urdf(path)


def test_a_fragment_says_what_to_load(tmp_path: Path) -> None:
    (tmp_path / "part.xml").write_text("<mujocoinclude><worldbody/></mujocoinclude>")
    for read in (Robot.from_urdf, Robot.from_mjcf):
        with pytest.raises(ValueError, match="part of an MJCF: load the file that includes it"):
            read(tmp_path / "part.xml")
