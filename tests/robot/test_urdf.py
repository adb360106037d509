"""Every way a description can be wrong gives one error that names what is wrong and what is allowed."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from sidestep.robot import Robot, planar_arm

GOOD = planar_arm(2)
Edit = Callable[[str], str]


def swap(old: str, new: str) -> Edit:
    assert old in GOOD
    return lambda text: text.replace(old, new, 1)


def add(element: str) -> Edit:
    return lambda text: text.replace("</robot>", element + "</robot>")


def without_limit(text: str) -> str:
    return re.sub(r"<limit[^>]*/>", "", text, count=1)


FIXED = '<joint name="{}" type="fixed"><parent link="{}"/><child link="{}"/></joint>'
LIMIT = '<limit lower="-1" upper="1" velocity="1" effort="1"/>'
REVOLUTE = '<joint name="{}" type="revolute"><parent link="{}"/><child link="{}"/>' + LIMIT + "{}</joint>"

BAD: dict[str, tuple[Edit, str]] = {
    "unknown joint type": (
        swap('type="revolute"', 'type="ball"'),
        "joint 'joint1' has type 'ball'; allowed: revolute, continuous, prismatic, fixed, floating, planar",
    ),
    "misspelt joint type": (
        swap('type="fixed"', 'type="fix"'),
        "joint 'tip_joint' has type 'fix'; allowed: revo",
    ),
    "no parent link": (
        swap('<parent link="link1"/>', '<parent link="arm"/>'),
        "'joint2': parent link 'arm' does not",
    ),
    "no child link": (
        swap('<child link="tip"/>', '<child link="hand"/>'),
        "'tip_joint': child link 'hand' does not",
    ),
    "no parent element": (swap('<parent link="link1"/>', ""), "joint 'joint2' has no <parent>"),
    "no limit": (
        without_limit,
        "joint 'joint1' is revolute and has no <limit>; give lower, upper, velocity and eff",
    ),
    "limit is no number": (
        swap('velocity="5.0"', 'velocity="fast"'),
        "'joint1': <limit>: velocity is 'fast', must",
    ),
    "empty interval": (swap('upper="3.14', 'upper="-4.14'), "must be below upper -4.14"),
    "zero axis": (swap('xyz="0 0 1"', 'xyz="0 0 0"'), "joint 'joint1': axis is zero"),
    "axis of two": (
        swap('xyz="0 0 1"', 'xyz="0 1"'),
        "joint 'joint1': xyz is '0 1', must be 3 finite numbers",
    ),
    "origin not finite": (
        swap('xyz="0.5 0 0"', 'xyz="nan 0 0"'),
        "xyz is 'nan 0 0', must be 3 finite numbers",
    ),
    "negative mass": (
        lambda text: text.replace('mass value="', 'mass value="-', 1),
        "link 'link1': <inertial>: mass",
    ),
    "unknown shape": (
        swap("<box size=", "<torus size="),
        "holds <torus>; allowed: one of mesh, box, cylinder, capsule, sph",
    ),
    "negative box": (
        swap('0.08 0.08"/>', '0.08 -0.08"/>'),
        "box dimensions (0.5, 0.08, -0.08) must not be negative",
    ),
    "link twice": (add('<link name="link1"/>'), "link 'link1' is defined twice"),
    "joint twice": (
        add('<link name="x"/>' + FIXED.format("joint1", "tip", "x")),
        "joint 'joint1' is defined twice",
    ),
    "two parents": (
        add(FIXED.format("again", "base", "tip")),
        "link 'tip' is the child of joints 'tip_joint' and 'a",
    ),
    "several roots": (add('<link name="island"/>'), "several root links ['base', 'island']"),
    "loop through the root": (add(FIXED.format("back", "tip", "base")), "hang on a loop of joints"),
    "loop beside the tree": (
        add('<link name="a"/><link name="b"/>' + FIXED.format("ab", "a", "b") + FIXED.format("ba", "b", "a")),
        "links ['a', 'b'] hang on a loop",
    ),
    "unknown mimic source": (
        add('<link name="x"/>' + REVOLUTE.format("jx", "tip", "x", '<mimic joint="nobody"/>')),
        "joint 'jx' mimics 'nobody', which does not exist; the joints are: joint1, joint2",
    ),
    "mimic loop": (
        add('<link name="x"/>' + REVOLUTE.format("jx", "tip", "x", '<mimic joint="jx"/>')),
        "mimic joints form a loop: jx -> jx",
    ),
    "mimic of a fixed joint": (
        add('<link name="x"/>' + REVOLUTE.format("jx", "tip", "x", '<mimic joint="tip_joint"/>')),
        "joint 'jx' mimics 'tip_joint', which is fixed",
    ),
    "malformed XML": (swap("</robot>", ""), "URDF string is not well-formed XML"),
    "another format": (lambda text: "<sdf/>", "the root element is <sdf>, must be <robot>"),
    "no link": (lambda text: "<robot/>", "has no link"),
    "nothing moves": (lambda text: '<robot><link name="a"/></robot>', "has no movable joint left"),
}


@pytest.mark.parametrize("case", BAD)
def test_error_names_what_is_wrong(case: str) -> None:
    edit, message = BAD[case]
    text = edit(GOOD)
    assert text != GOOD
    with pytest.raises(ValueError, match=re.escape(message)):
        Robot.from_urdf(text)


def test_missing_mesh_names_link_reference_and_folders(tmp_path: Path) -> None:
    text = re.sub(r"<box [^>]*/>", '<mesh filename="package://arm/meshes/link.stl"/>', GOOD, count=1)
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    with pytest.raises(FileNotFoundError) as caught:
        Robot.from_urdf(path)
    assert "link 'link1' refers to 'package://arm/meshes/link.stl'" in str(caught.value)
    assert str(tmp_path.resolve()) in str(caught.value)
    with pytest.raises(FileNotFoundError, match=r"no folder \(pass package_dirs\)"):
        Robot.from_urdf(text)


def test_missing_description_and_folder(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=re.escape("nothing.urdf does not exist")):
        Robot.from_urdf(tmp_path / "nothing.urdf")
    with pytest.raises(FileNotFoundError, match=r"package_dirs: .*nowhere is not a folder"):
        Robot.from_urdf(GOOD, package_dirs=[tmp_path / "nowhere"])


def test_angles_in_degrees_are_said_to_look_like_degrees(recwarn: pytest.WarningsRecorder) -> None:
    text = re.sub(r'lower="[^"]*" upper="[^"]*"', 'lower="-170" upper="172.5"', planar_arm(2), count=1)
    with pytest.warns(
        RuntimeWarning,
        match=r"URDF string: lower limit -170 of joint 'joint1', upper limit 172\.5 of joint 'joint1' looks like "
        "degrees; radians are expected",
    ):
        robot = Robot.from_urdf(text)
    assert robot.limits.upper[0] == 172.5
    turned = planar_arm(2).replace("<origin ", '<origin rpy="0 0 90" ', 1)
    with pytest.warns(RuntimeWarning, match="rpy '0 0 90' of .* looks like degrees; radians are expected"):
        Robot.from_urdf(turned)
    with pytest.raises(ValueError, match=r"locked: 'joint1' = 90 is outside .*; 90 looks like degrees; rad"):
        Robot.from_urdf(planar_arm(2), locked={"joint1": 90})
    with pytest.warns(
        RuntimeWarning, match="locked: 'joint1' = -45 looks like degrees; radians are expected"
    ):
        Robot.from_urdf(planar_arm(2).replace('type="revolute"', 'type="continuous"'), locked={"joint1": -45})


@pytest.mark.parametrize("limit", ["3.1416", "6.2832", "9.42", "12.566", "18.85", "47.1239", "1e16", "inf"])
def test_limits_of_whole_turns_and_of_no_end_are_radians(
    limit: str, recwarn: pytest.WarningsRecorder
) -> None:
    Robot.from_urdf(
        re.sub(r'lower="[^"]*" upper="[^"]*"', f'lower="-{limit}" upper="{limit}"', planar_arm(2))
    )
    assert not recwarn.list


def test_an_error_about_a_configuration_says_that_it_looks_like_degrees() -> None:
    robot = Robot.from_urdf(planar_arm(2))
    with pytest.raises(
        ValueError, match=r"joint 'joint1' is 4\.0 rad, .*; 90 looks like degrees; radians are"
    ):
        robot.check_configuration([4.0, 90.0])
    with pytest.raises(ValueError, match=r"allowed: \[[^;]*\] rad$"):
        robot.check_configuration([4.0, 0.0])
