"""Joints that something else drives: their links are covered wherever they may be."""

import numpy as np
import pytest

import sidestep as ss
from sidestep.cli.limit_options import locked_by_joint

GRIPPER = """
<robot name="gripper_on_a_wheel">
  <link name="base"/>
  <link name="hand">
    <collision><geometry><box size="0.1 0.1 0.02"/></geometry></collision></link>
  <link name="finger">
    <collision><geometry><box size="0.01 0.02 0.06"/></geometry></collision></link>
  <link name="pad">
    <collision><origin xyz="0 0 0.05"/><geometry><box size="0.02 0.02 0.02"/></geometry></collision></link>
  <link name="lever">
    <collision><origin xyz="0 0.08 0"/><geometry><box size="0.01 0.04 0.01"/></geometry></collision></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="hand"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" velocity="1" effort="10"/></joint>
  <joint name="slide" type="prismatic"><parent link="hand"/><child link="finger"/>
    <origin xyz="0.02 0 0.04"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.04" velocity="1" effort="10"/></joint>
  <joint name="bolt" type="fixed"><parent link="finger"/><child link="pad"/></joint>
  <joint name="swing" type="revolute"><parent link="pad"/><child link="lever"/>
    <origin xyz="0 0 0.1"/><axis xyz="0 0 1"/>
    <mimic joint="slide" multiplier="25"/><limit lower="0" upper="1" velocity="1" effort="10"/></joint>
</robot>
"""


def corners(geometry_of, link):
    return np.asarray(geometry_of.collision_mesh(link).convex_hull.vertices)


def test_links_are_covered_wherever_another_drive_may_put_them():
    driven = ss.Robot.from_urdf(GRIPPER, locked={"slide": [0.0, 0.04]})
    assert driven.coordinate_names == ["turn"]
    assert driven.held == {"slide": pytest.approx(0.02), "swing": pytest.approx(0.5)}
    q = np.zeros(1)
    for value in np.linspace(0.0, 0.04, 23):
        held = ss.Robot.from_urdf(GRIPPER, locked={"slide": value})
        for link in ("finger", "pad", "lever"):
            X = np.linalg.inv(driven.pose(q, link)) @ held.pose(q, link)
            points = corners(held, link) @ X[:3, :3].T + X[:3, 3]
            hulls = driven.collision_mesh(link).split()  # a sweep is a union of convex hulls
            planes = [(hull.face_normals, hull.triangles[:, 0]) for hull in hulls]
            depth = max(min(float(np.sum((p - at) * n, axis=1).max()) for n, at in planes) for p in points)
            assert depth < 1e-4, (link, value)
    extents = driven.collision_mesh("finger").extents
    assert extents == pytest.approx([0.05, 0.02, 0.06])
    assert driven.fingerprint != ss.Robot.from_urdf(GRIPPER, locked={"slide": 0.02}).fingerprint


def test_what_a_driven_gripper_may_reach_keeps_off_obstacles():
    arm = ss.Arm.load(GRIPPER, locked={"slide": (0.0, 0.04)})
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True))
    # The pad is at 0.04 to 0.06 m along x where the gripper is closed, and at 0.08 where it is open.
    controller.set_obstacles(ss.Obstacles([[0.085, 0.0, 0.1]], radii=0.005))
    command = controller.step(np.zeros(1), np.zeros(1))
    assert command.clearance < 0.012


@pytest.mark.parametrize(
    ("locked", "words"),
    [
        ({"slide": (0.04, 0.0)}, "must be a range that ascends"),
        ({"slide": (0.0, 0.05)}, r"\[0.0, 0.05\] is outside its limits \[0.0, 0.04\]"),
        ({"slide": (0.0, 0.01, 0.02)}, "must be one number, or two: a range"),
        (
            {"slide": (0.0, 0.04), "swing": (0.0, 1.0)},
            "'swing' mimics another joint; give the range of that one",
        ),
        ({"slide": (np.nan, 0.04)}, "range that ascends"),
        ({"slide": (0.0, 0.04), "swing": 0.5}, "'swing' = 0.5 mimics 'slide', which something else drives"),
    ],
)
def test_ranges_that_are_none_are_named(locked, words):
    with pytest.raises(ValueError, match=words):
        ss.Robot.from_urdf(GRIPPER, locked=locked)


def test_more_than_can_be_swept_is_refused_with_numbers():
    rail = """<link name="floor"/><link name="base"/>
      <joint name="rail" type="prismatic"><parent link="floor"/><child link="base"/><axis xyz="1 0 0"/>
        <limit lower="0" upper="1" velocity="1" effort="10"/></joint>"""
    on_a_rail = GRIPPER.replace('<link name="base"/>', rail)
    words = r"link 'finger' is swept through 2400 cells by the ranges of 'turn', 'slide', allowed: 2000"
    with pytest.raises(ValueError, match=words):
        ss.Robot.from_urdf(on_a_rail, locked={"turn": (-3.0, 3.0), "slide": (0.0, 0.04)})


def test_ranges_are_of_mjcf_too():
    text = """
    <mujoco><worldbody><body name="hand"><joint name="turn" axis="0 0 1" range="-90 90" limited="true"/>
      <geom type="box" size=".05 .05 .01"/>
      <body name="left" pos=".02 0 .04"><geom type="box" size=".005 .01 .03"/>
        <joint name="slide" type="slide" axis="1 0 0" range="0 .04" limited="true"/></body>
      <body name="right" pos="-.02 0 .04"><geom type="box" size=".005 .01 .03"/>
        <joint name="follow" type="slide" axis="-1 0 0" range="0 .04" limited="true"/></body>
    </body></worldbody><equality><joint joint1="follow" joint2="slide"/></equality></mujoco>"""
    limits = {"velocity_limits": {"turn": 1.0}, "effort_limits": {"turn": 1.0}}
    robot = ss.Robot.from_urdf(text, locked={"slide": (0.0, 0.04)}, **limits)
    assert robot.held == {"slide": pytest.approx(0.02), "follow": pytest.approx(0.02)}
    for finger in ("left", "right"):
        assert robot.collision_mesh(finger).extents == pytest.approx([0.05, 0.02, 0.06])


def test_ranges_on_the_command_line():
    given = ["a=0..0.04", "b=-1e-3..-.5", "c=open", "d=0.1"]
    assert locked_by_joint(given) == {"a": (0.0, 0.04), "b": (-0.001, -0.5), "c": "open", "d": 0.1}
    for wrong in ("a=0..", "a=..1", "a=0..x", "a=", "0..1"):
        with pytest.raises(ValueError, match=r"JOINT=LOW\.\.HIGH"):
            locked_by_joint([wrong])
