"""What is prepared is kept link by link and pair by pair: an arm with another gripper costs what is new of it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import sidestep as ss
from sidestep import Body, Robot
from sidestep.arm import clearance_tables, link_pairs
from sidestep.body.cover_problem import LinkProblem

LINK = """
  <link name="{name}"><collision><origin xyz="{length} 0 0"/><geometry>{shape}</geometry></collision></link>"""
JOINT = """
  <joint name="j{k}" type="revolute"><origin xyz="{offset} 0 0"/><parent link="{parent}"/><child link="{child}"/>
    <axis xyz="0 0 1"/><limit lower="-2.8" upper="2.8" velocity="2" effort="50"/></joint>"""


def arm(*tools: str, name: str = "arm", links: str = "abc", limit: str = "2.8") -> str:
    """A planar chain of three links that touch when folded; a tool on the last, that fits no other."""
    shapes = [f'<box size="0.3 0.0{5 + k} 0.05"/>' for k in range(3)]
    text, parent = f'<robot name="{name}"><link name="base"/>', "base"
    for k, (link, shape) in enumerate(zip(links, shapes, strict=False)):
        text += LINK.format(name=link, length=0.15, shape=shape)
        text += JOINT.format(k=k, offset=0.0 if k == 0 else 0.3, parent=parent, child=link)
        parent = link
    for tool in tools:
        text += LINK.format(name="tool", length=0.05, shape=tool)
        text += JOINT.format(k=3, offset=0.3, parent=parent, child="tool")
    return text.replace('upper="2.8"', f'upper="{limit}"') + "</robot>"


BALL, BOX = '<sphere radius="0.04"/>', '<box size="0.1 0.06 0.06"/>'


@pytest.fixture(autouse=True)
def cache_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def fitted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The number of triangles of every link that is fitted."""
    found: list[int] = []
    search = LinkProblem._search

    def counted(problem: LinkProblem, number: int, starts: range) -> object:
        found.append(len(problem.triangles))
        return search(problem, number, starts)

    monkeypatch.setattr(LinkProblem, "_search", counted)
    return found


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, str]]:
    """The pairs whose contact or table is measured."""
    found: list[tuple[str, str]] = []
    contact, table = link_pairs._Samples.contact, clearance_tables._measure

    def counted_contact(samples: link_pairs._Samples, k: int) -> float | None:
        found.append(samples._pairs[k])
        return contact(samples, k)

    def counted_table(robot, check, pair, effort):  # type: ignore[no-untyped-def]
        found.append(pair.links)
        return table(robot, check, pair, effort)

    monkeypatch.setattr(link_pairs._Samples, "contact", counted_contact)
    monkeypatch.setattr(clearance_tables, "_measure", counted_table)
    return found


def test_another_gripper_costs_one_link_and_its_pairs(
    fitted: list[int], measured: list[tuple[str, str]]
) -> None:
    first = ss.Arm.load(arm(BALL), draft=True)
    assert sorted(fitted) == [12, 12, 12, 5120]  # three boxes and a ball
    assert {frozenset(pair) for pair in measured} == {
        frozenset("ac"),
        frozenset(("a", "tool")),
        frozenset(("b", "tool")),
    }
    fitted.clear()
    measured.clear()
    second = ss.Arm.load(arm(BOX), draft=True)
    assert set(fitted) == {12}  # of the box
    assert len(fitted) == 1
    assert measured
    assert all("tool" in pair for pair in measured)
    own = [np.asarray(each.body.links) != "tool" for each in (first, second)]
    for name in ("means", "covariances", "levels"):
        one, other = (
            np.asarray(getattr(each.body, name))[mine]
            for each, mine in zip((first, second), own, strict=True)
        )
        np.testing.assert_array_equal(one, other)
    assert [pair for pair in first.pairs if "tool" not in pair] == [
        pair for pair in second.pairs if "tool" not in pair
    ]


def test_the_same_links_of_another_robot_cost_nothing(fitted: list[int]) -> None:
    made = Body.cover(Robot.from_urdf(arm()), effort="draft")
    assert fitted
    fitted.clear()
    other = Body.cover(Robot.from_urdf(arm(name="other", links="xyz", limit="1.5")), effort="draft")
    assert fitted == []
    assert other.links == [{"a": "x", "b": "y", "c": "z"}[link] for link in made.links]
    np.testing.assert_array_equal(other.covariances, made.covariances)
    for one, twin in zip(made.link_covers, other.link_covers, strict=True):
        assert (one.max_overshoot, one.volume_ratio, one.trade_off) == (
            twin.max_overshoot,
            twin.volume_ratio,
            twin.trade_off,
        )
    again = Body.cover(Robot.from_urdf(arm(name="third")), effort="draft", cache=False)
    assert fitted  # without the cache
    np.testing.assert_array_equal(again.covariances, made.covariances)  # by which the result does not change
    fitted.clear()
    Body.cover(Robot.from_urdf(arm(name="fourth")), effort="draft", seed=1)
    assert fitted  # other settings


def test_shared_numbers_of_ellipsoids_are_found_without_a_fit(fitted: list[int]) -> None:
    made = Body.cover(Robot.from_urdf(arm(links="ab")), max_components=3)
    fitted.clear()
    again = Body.cover(Robot.from_urdf(arm(name="other", links="ab")), max_components=3)
    assert fitted == []
    assert again.links == made.links
    assert [cover.trade_off for cover in again.link_covers] == [cover.trade_off for cover in made.link_covers]


def test_pairs_are_measured_again_where_limits_change(measured: list[tuple[str, str]]) -> None:
    robot = Robot.from_urdf(arm())
    body = Body.cover(robot, effort="draft")
    made = link_pairs.tables_and_pairs(robot, body)
    assert measured
    measured.clear()
    again = link_pairs.tables_and_pairs(robot, body)
    assert measured == []
    assert again[1] == made[1]
    for one, other in zip(made[0], again[0], strict=True):
        np.testing.assert_array_equal(one.control, other.control)
    narrow = Robot.from_urdf(arm(limit="1.5"))
    link_pairs.tables_and_pairs(narrow, Body.cover(narrow, effort="draft"))
    assert measured
    measured.clear()
    link_pairs.tables_and_pairs(robot, body, cached=False)
    assert measured


@pytest.mark.parametrize("folder", ["links", "pairs", "tables"])
def test_a_truncated_file_is_made_again(cache_folder: Path, folder: str) -> None:
    robot = Robot.from_urdf(arm())

    def prepared() -> tuple[object, ...]:
        body = Body.cover(robot, effort="draft")
        tables, pairs = link_pairs.tables_and_pairs(robot, body)
        return np.asarray(body.covariances).tolist(), [table.control.tolist() for table in tables], pairs

    made = prepared()
    for file in (cache_folder / "bodies").iterdir():
        file.unlink()
    files = list((cache_folder / folder).glob("*.json"))
    assert files
    for file in files:
        file.write_bytes(file.read_bytes()[:-20])
    with pytest.warns(RuntimeWarning, match="is unreadable and is made again"):
        assert prepared() == made
    for file in files:
        file.write_text("{}")
    for file in (cache_folder / "bodies").iterdir():
        file.unlink()
    with pytest.warns(RuntimeWarning, match="KeyError"):
        assert prepared() == made
    assert not list((cache_folder / folder).glob(".*"))  # nothing half written is left


def test_a_folder_that_cannot_be_written_is_told_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("not a folder")
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path / "file"))
    with pytest.warns(RuntimeWarning, match="not cached") as said:
        made = ss.Arm.load(arm(BALL), draft=True)
    assert made.num_coordinates == 4
    assert sum("the cover of a link is not cached" in str(each.message) for each in said) == 1


def test_two_programs_may_prepare_at_once(cache_folder: Path, tmp_path: Path) -> None:
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(arm(BALL))
    program = (
        "import sys, warnings; warnings.simplefilter('error', RuntimeWarning); import sidestep as ss; "
        "print(ss.Arm.load(sys.argv[1], draft=True).content_hash)"
    )
    running = [
        subprocess.Popen([sys.executable, "-c", program, str(urdf)], stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    hashes = {process.communicate(timeout=300)[0].strip() for process in running}
    assert [process.returncode for process in running] == [0, 0]
    assert hashes == {ss.Arm.load(urdf, draft=True).content_hash}
    assert all(file.suffix in (".json", ".arm") for file in cache_folder.rglob("*") if file.is_file())
