"""Tips, locked joints, mimic joints, base poses and limits."""

import re
from pathlib import Path

import numpy as np
import pytest

from sidestep.robot import Robot, planar_arm

EVERY_JOINT = Path(__file__).parent / "every_joint.urdf"
LOCK = {"held": 0.6}


def test_coordinates_of_the_whole_tree() -> None:
    robot = Robot.from_urdf(EVERY_JOINT, locked=LOCK)
    assert robot.coordinate_names == ["turn", "slide", "elbow", "shoulder2"]
    limits = robot.limits
    np.testing.assert_array_equal(limits.lower, [-np.inf, -0.1, -2, -1])
    np.testing.assert_array_equal(limits.upper, [np.inf, 0.4, 1.5, 2])
    np.testing.assert_array_equal(limits.velocity, [2, 0.5, 3, 2])
    np.testing.assert_array_equal(limits.effort, [40, 60, 30, 20])
    np.testing.assert_array_equal(limits.acceleration, [10, 10, 10, 10])


def test_mimic_chains_keep_the_source_coordinate() -> None:
    robot = Robot.from_urdf(EVERY_JOINT, locked=LOCK)
    joints = {joint.name: joint for joint in robot.joints}
    assert joints["wrist"].coordinate == joints["finger"].coordinate == robot.coordinate_names.index("elbow")
    assert (joints["wrist"].multiplier, joints["wrist"].offset) == (-0.7, 0.2)
    assert joints["finger"].multiplier == pytest.approx(0.05 * -0.7)
    assert joints["finger"].offset == pytest.approx(0.05 * 0.2 + 0.01)
    assert "follower" not in joints  # it mimics the locked joint, so it is locked too


LED = """<robot name="led"><link name="base"/><link name="a"/><link name="b"/><link name="c"/>
<joint name="leader" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/>
  <limit lower="-1" upper="1" velocity="2" effort="50"/></joint>
<joint name="follower" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
  <limit {limit} effort="7"/><mimic joint="leader" {mimic}/></joint>
<joint name="last" type="{last}"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/>
  <limit lower="-0.2" upper="0.2" velocity="3" effort="7"/><mimic joint="follower" multiplier="0.5"/></joint></robot>"""


@pytest.mark.parametrize(
    ("limit", "mimic", "last", "bounds", "velocity"),
    [
        ('lower="-0.6" upper="0.9" velocity="3"', 'multiplier="3"', "fixed", (-0.2, 0.3), 1.0),
        ('lower="-0.6" upper="0.9" velocity="3"', 'multiplier="-3" offset="0.3"', "fixed", (-0.2, 0.3), 1.0),
        ('lower="-0.6" upper="0.9"', 'multiplier="0.1"', "fixed", (-1.0, 1.0), 2.0),
        ('lower="0" upper="0" velocity="9"', 'multiplier="3"', "fixed", (-1.0, 1.0), 2.0),
        # through a chain: last = 1.5 leader
        ('lower="-9" upper="9"', 'multiplier="3"', "prismatic", (-0.2 / 1.5, 0.2 / 1.5), 2.0),
        ('lower="-9" upper="9" velocity="9"', 'multiplier="0"', "fixed", (-1.0, 1.0), 2.0),
    ],
)
def test_the_limits_of_a_mimic_joint_bound_the_one_that_it_follows(
    limit: str, mimic: str, last: str, bounds: tuple[float, float], velocity: float
) -> None:
    limits = Robot.from_urdf(LED.format(limit=limit, mimic=mimic, last=last)).limits
    np.testing.assert_allclose([limits.lower[0], limits.upper[0]], bounds, atol=1e-15)  # rounding
    np.testing.assert_allclose(limits.velocity, [velocity], rtol=1e-15)  # rounding
    assert limits.effort[0] == 50.0  # the one that follows has no drive


def test_a_velocity_that_is_passed_keeps_to_the_limit_of_a_mimic_joint() -> None:
    text = LED.format(limit='lower="-9" upper="9" velocity="3"', mimic='multiplier="-3"', last="fixed")
    assert Robot.from_urdf(text, velocity_limits=5.0).limits.velocity[0] == 1.0
    assert Robot.from_urdf(text, velocity_limits=0.5).limits.velocity[0] == 0.5


@pytest.mark.parametrize("mimic", ['offset="2.5"', 'multiplier="0" offset="2.5"'])
def test_limits_that_a_mimic_joint_leaves_no_place_are_named(mimic: str) -> None:
    text = LED.format(limit='lower="-0.6" upper="0.9" velocity="3"', mimic=mimic, last="fixed")
    with pytest.warns(
        RuntimeWarning,
        match=r"'leader' .* its own alone count: .*\[-1, 1\], \[-0.6, 0.9\] of 'follower' = [01] q \+ 2.5",
    ):
        robot = Robot.from_urdf(text)
    np.testing.assert_array_equal((robot.limits.lower[0], robot.limits.upper[0]), (-1.0, 1.0))
    assert Robot.from_urdf(text.replace("</robot>", MORE), locked={"leader": 0.0}).coordinate_names == [
        "more"
    ]


MORE = """<link name="d"/><joint name="more" type="revolute"><parent link="base"/><child link="d"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="2" effort="5"/></joint></robot>"""


def test_tip_keeps_the_way_and_what_is_rigid_on_it() -> None:
    robot = Robot.from_urdf(EVERY_JOINT, tip="palm")
    assert [link.name for link in robot.links] == [
        "ground", "pedestal", "turret", "carriage", "camera", "forearm", "palm",
    ]  # fmt: skip
    assert robot.coordinate_names == ["turn", "slide", "elbow"]
    at_carriage = Robot.from_urdf(EVERY_JOINT, tip="carriage")
    assert "camera" not in [link.name for link in at_carriage.links]  # it hangs on the tip itself


def test_tip_does_not_change_poses() -> None:
    whole = Robot.from_urdf(EVERY_JOINT, locked=LOCK)
    part = Robot.from_urdf(EVERY_JOINT, tip="palm")
    q = np.array([0.3, 0.2, -0.9])
    for link in part.links:
        np.testing.assert_array_equal(part.pose(q, link.name), whole.pose([*q, 0.5], link.name))


def test_tip_behind_a_mimic_joint_whose_source_is_elsewhere() -> None:
    text = EVERY_JOINT.read_text().replace('mimic joint="elbow"', 'mimic joint="shoulder2"')
    with pytest.raises(
        ValueError, match="'wrist' mimics 'shoulder2', which is not on the way to the tip 'palm'"
    ):
        Robot.from_urdf(text, tip="palm")
    held = Robot.from_urdf(text, tip="palm", locked={"shoulder2": 1.0})
    assert held.coordinate_names == ["turn", "slide", "elbow"]


def test_fr3_arm_has_no_hand() -> None:
    arm, whole = Robot.named("fr3_arm"), Robot.named("fr3")
    assert [link.name for link in arm.links] == ["world", *(f"fr3_link{i}" for i in range(9))]
    left, right = whole.pose(whole.neutral, "fr3_leftfinger"), whole.pose(whole.neutral, "fr3_rightfinger")
    # both fingers stand 0.04 m from the middle, so 0.08 m apart
    assert np.linalg.norm(left[:3, 3] - right[:3, 3]) == pytest.approx(0.08)


def test_base_pose_moves_everything_rigidly() -> None:
    base = np.eye(4)
    base[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    base[:3, 3] = [1, 2, 3]
    q = [0.3, -0.4]
    moved, plain = Robot.from_urdf(planar_arm(2), base_pose=base), Robot.from_urdf(planar_arm(2))
    np.testing.assert_allclose(moved.pose(q, "tip"), base @ plain.pose(q, "tip"), atol=1e-15)  # rounding
    assert moved.fingerprint == plain.fingerprint


@pytest.mark.parametrize(
    ("locked", "message"),
    [
        ({"nobody": 0.0}, "joint 'nobody' does not exist; joints that can be locked: turn, slide, elbow"),
        ({"mount": 0.0}, "joint 'mount' is fixed already"),
        ({"wrist": 0.0}, "joint 'wrist' mimics another; lock that one"),
        ({"elbow": 2.0}, "'elbow' = 2.0 is outside its limits [-2.0, 1.5]"),
        ({"turn": np.nan}, "'turn' = nan is outside its limits"),
    ],
)
def test_wrong_lock(locked: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        Robot.from_urdf(EVERY_JOINT, locked=LOCK | locked)


def test_a_lock_beyond_the_limits_has_to_be_asked_for() -> None:
    beyond = Robot.from_urdf(EVERY_JOINT, locked=LOCK | {"elbow": 2.0}, locked_beyond_limits=True)
    assert "elbow" not in beyond.coordinate_names
    with pytest.raises(ValueError, match=re.escape("'elbow' = inf is outside its limits")):
        Robot.from_urdf(EVERY_JOINT, locked=LOCK | {"elbow": np.inf}, locked_beyond_limits=True)


def test_the_fingers_of_a_named_robot_open_as_asked() -> None:
    """Each finger's frame lies the opening away from the hand's middle, along the hand's y."""
    robot = Robot.named("panda", locked={"panda_finger_joint1": 0.01, "panda_finger_joint2": 0.01})
    at = {side: robot.pose(robot.neutral, f"panda_{side}finger") for side in ("left", "right")}
    apart = at["left"][:3, 3] - at["right"][:3, 3]
    np.testing.assert_allclose(np.linalg.norm(apart), 0.02, atol=1e-12)  # rounding
    assert robot.num_coordinates == 7
    assert robot.held == {"panda_finger_joint1": 0.01, "panda_finger_joint2": 0.01}
    with pytest.raises(ValueError, match=re.escape("'panda_finger_joint1' = 0.065 is outside its limits")):
        Robot.named("panda", locked={"panda_finger_joint1": 0.065})
    with pytest.raises(ValueError, match=r"'panda_finger_joint2' = 0.02 mimics another .* puts it at 0.01"):
        Robot.named("panda", locked={"panda_finger_joint1": 0.01, "panda_finger_joint2": 0.02})


def test_wrong_tip_and_base_pose() -> None:
    with pytest.raises(ValueError, match=r"tip 'nose' is no link of .*; its links are: ground, pedestal"):
        Robot.from_urdf(EVERY_JOINT, tip="nose")
    with pytest.raises(ValueError, match=r"base_pose has shape \(3, 3\), expected \(4, 4\)"):
        Robot.from_urdf(EVERY_JOINT, base_pose=np.eye(3))
    with pytest.raises(ValueError, match="base_pose is not a rigid transform"):
        Robot.from_urdf(EVERY_JOINT, base_pose=np.diag([1, 1, -1, 1]))


def test_limits_can_be_given() -> None:
    robot = Robot.from_urdf(
        planar_arm(2), acceleration_limits=[3, 4], velocity_limits=2, effort_limits=[5, 6]
    )
    np.testing.assert_array_equal(robot.limits.acceleration, [3, 4])
    np.testing.assert_array_equal(robot.limits.velocity, [2, 2])
    np.testing.assert_array_equal(robot.limits.effort, [5, 6])
    with pytest.raises(
        ValueError, match=r"acceleration_limits has shape \(3,\), expected a number or \(2,\)"
    ):
        Robot.from_urdf(planar_arm(2), acceleration_limits=[1, 2, 3])
    with pytest.raises(ValueError, match=r"acceleration_limits: -1.0 for 'joint2', must be positive"):
        Robot.from_urdf(planar_arm(2), acceleration_limits=[1, -1])


def test_limits_that_the_file_lacks_can_be_given(recwarn: pytest.WarningsRecorder) -> None:
    assert Robot.from_urdf(EVERY_JOINT, velocity_limits=1, effort_limits=1).num_coordinates == 5
    given = Robot.from_urdf(EVERY_JOINT, velocity_limits={"held": 0.5}, effort_limits={"held": 7})
    assert not recwarn.list
    held = given.coordinate_names.index("held")
    assert (given.limits.velocity[held], given.limits.effort[held]) == (0.5, 7.0)
