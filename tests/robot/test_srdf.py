"""SRDF: which links may touch."""

from __future__ import annotations

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
