"""SRDF: which links may touch."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

from sidestep import Robot
from sidestep.distance import SelfCollision
from sidestep.robot import catalogue, read_srdf

TEXT = """<robot name="arm">
  <disable_default_collisions link="d"/>
  <enable_collisions link1="c" link2="d"/>
  <disable_collisions link1="b" link2="a" reason="Adjacent"/>
  <disable_collisions link1="a" link2="elsewhere" reason="Never"/>
</robot>"""


def test_pairs_among_the_links_asked_for() -> None:
    assert read_srdf(TEXT, ["a", "b", "c", "d"]) == (("a", "b"), ("a", "d"), ("b", "d"))
    assert read_srdf(TEXT, ["a", "c"]) == ()


def test_the_pairs_of_a_published_file_are_not_checked() -> None:
    """The Panda's own SRDF lets the hand touch link 5, which sampling alone keeps."""
    source = catalogue.recipe("panda").source()
    assert isinstance(source, Path)
    robot = Robot.named("panda")
    own, from_file = (
        SelfCollision(robot, samples=20),
        SelfCollision.from_srdf(robot, source.parents[1] / "srdf" / "panda.srdf", samples=20),
    )
    assert ("panda_link5", "panda_hand") in own.pairs
    assert ("panda_link5", "panda_hand") not in from_file.pairs
    assert ("panda_link0", "panda_hand") in from_file.pairs
    assert set(from_file.pairs) < set(own.pairs)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<robot><disable_collisions link1='a'/></robot>", "must name link1 and link2"),
        ("<robot>", "is not well-formed XML"),
        ("<arm/>", "root element is <arm>"),
    ],
)
def test_a_wrong_file_is_refused(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read_srdf(text, ["a"])
    with pytest.raises(FileNotFoundError, match="does not exist"):
        read_srdf("nowhere.srdf", ["a"])


URDF = """<robot name="arm"><link name="a"/><link name="b"/><link name="c"/>
  <joint name="x" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
    <limit velocity="1" effort="1"/></joint>
  <joint name="y" type="continuous"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/>
    <limit velocity="1" effort="1"/></joint></robot>"""
STATES = """<group_state name="home" group="arm"><joint name="x" value="0.5"/><joint name="y" value="-1"/></group_state>
  <group_state name="half" group="arm"><joint name="x" value="0.5"/></group_state></robot>"""


def test_the_file_beside_a_urdf_is_found_and_another_can_be_given(tmp_path: Path) -> None:
    (tmp_path / "urdf").mkdir()
    (tmp_path / "config").mkdir()
    urdf = tmp_path / "urdf" / "my.urdf"
    urdf.write_text(URDF)
    assert Robot.from_urdf(urdf).allowed_pairs == ()
    (tmp_path / "config" / "other.srdf").write_text(TEXT.replace('name="arm"', 'name="leg"'))
    assert Robot.from_urdf(urdf).allowed_pairs == ()  # of another robot
    (tmp_path / "config" / "arm.srdf").write_text(TEXT.replace("</robot>", STATES))
    robot = Robot.from_urdf(urdf)
    assert robot.allowed_pairs == (("a", "b"),)
    assert {name: q.tolist() for name, q in robot.postures.items()} == {"home": [0.5, -1.0]}
    held = Robot.from_urdf(urdf, locked={"x": "half"})
    assert (held.held, held.coordinate_names) == ({"x": 0.5}, ["y"])
    with pytest.raises(
        ValueError,
        match=r"'x' is 'up', and no posture .*; allowed: a number, two: a range, or one of: home, half",
    ):
        Robot.from_urdf(urdf, locked={"x": "up"})
    given = tmp_path / "given.srdf"
    given.write_text('<robot name="any"><disable_collisions link1="a" link2="c"/></robot>')
    assert Robot.from_urdf(urdf, srdf=given).allowed_pairs == (("a", "c"),)
    assert Robot.from_urdf(URDF, srdf=given).allowed_pairs == (("a", "c"),)
    given.write_text(TEXT.replace("</robot>", STATES).replace('value="-1"', 'value="up"'))
    with pytest.raises(ValueError, match=r"'home' has a joint without a number"):
        Robot.from_urdf(urdf, srdf=given)
    with pytest.raises(FileNotFoundError, match=r"gone\.srdf does not exist"):
        Robot.from_urdf(urdf, srdf=tmp_path / "gone.srdf")


def test_a_file_beside_a_urdf_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    urdf = tmp_path / "my.urdf"
    urdf.write_text(URDF)
    broken = tmp_path / "any.srdf"
    broken.write_text(TEXT.replace("</robot>", "<group>"))
    with pytest.warns(RuntimeWarning) as said:
        assert Robot.from_urdf(urdf).allowed_pairs == ()
    (only,) = said
    assert only.filename == __file__
    assert str(only.message).startswith(f"{broken} is not well-formed XML: ")
    assert str(only.message).endswith(
        "; the SRDF was not read: postures and pairs that may touch are missing"
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        broken.write_text(broken.read_text().replace('name="arm"', 'name="leg"'))  # of another robot
        Robot.from_urdf(urdf)
        (tmp_path / "my.srdf").write_text(TEXT)  # one is read, and the other does not matter
        broken.write_text(TEXT.replace("</robot>", "<group>"))
        assert Robot.from_urdf(urdf).allowed_pairs == (("a", "b"),)


def test_the_robots_of_the_list_check_every_pair() -> None:
    assert Robot.named("panda").allowed_pairs == ()
