"""Rooms of the Python package: each imports only those before it, and no file is in a circle."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / ".ci" / "structure"))

from graph import circles  # noqa: E402
from python_code import Imports, room  # noqa: E402

# As in CONTRIBUTING.md, "Layout". The thesis is beside them: it may use all, and none uses it.
ORDER = (
    *("extras", "plugins", "storage", "math"),
    *("shapes", "robot", "shipped_arms", "obstacles", "drawing", "body", "distance", "arm"),
    *("control", "controller", "perception", "planning", "system"),
    *("loop", "drivers", "link"),
    *("simulation", "scenario", "report", "bench", "studio", "cli", "__main__"),
    "thesis",
)


def against_the_order(edges: dict[str, set[str]]) -> list[tuple[str, str]]:
    """Imports of a room that comes later."""
    return [
        (module, target)
        for module, targets in sorted(edges.items())
        for target in sorted(targets)
        if room(module) and room(target) and ORDER.index(room(target)) > ORDER.index(room(module))
    ]


@pytest.fixture(scope="module")
def edges() -> dict[str, set[str]]:
    found = Imports(ROOT / "src").edges()
    assert len(found) > 250
    return found


def test_every_room_has_its_place(edges: dict[str, set[str]]) -> None:
    assert {room(module) for module in edges} - {""} == set(ORDER)


def test_rooms_import_only_those_before_them(edges: dict[str, set[str]]) -> None:
    assert against_the_order(edges) == []


def test_no_files_import_each_other(edges: dict[str, set[str]]) -> None:
    assert circles(edges) == []


def test_an_import_of_a_later_room_is_found() -> None:
    edges = {
        "sidestep.robot.model": {"sidestep.body.cover", "sidestep.storage"},
        "sidestep.body.cover": set(),
    }
    assert against_the_order(edges) == [("sidestep.robot.model", "sidestep.body.cover")]
    assert against_the_order({"sidestep.cli.app": {"sidestep.thesis.command"}}) != []
