"""The guides for who adds something count right."""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / ".ci" / "structure"))

from files import Checkout  # noqa: E402

GUIDES = ROOT / "docs" / "how-to"


def first_table(page: str) -> list[str]:
    """The files that a guide lists."""
    text = (GUIDES / page).read_text(encoding="utf-8")
    return [
        name
        for row in re.findall(r"^\| (`.+?) \|", text, re.MULTILINE)
        for name in re.findall(r"`([^`]+)`", row)
    ]


def test_a_setting_is_in_the_two_tables_and_where_it_is_used() -> None:
    tables = first_table("add-a-setting.md")
    assert len(tables) == 2
    assert all((ROOT / name).exists() for name in tables)
    found = Checkout(ROOT).that_know(r"\bdrift_gain\b")
    assert set(tables) < set(found)
    assert len(found) == 3


def test_the_places_of_a_driver_are_there() -> None:
    text = (GUIDES / "add-a-driver.md").read_text("utf-8")
    for place in (
        "src/sidestep/drivers",
        "cpp/src/loop",
        "tests/drivers/",
        "src/sidestep/extras",
        "examples/13_a_driver_of_your_own.py",
        "examples/cpp/13_a_driver_of_your_own.cpp",
    ):
        assert place in text
        assert (ROOT / place).exists(), place
