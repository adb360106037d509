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


def test_the_place_of_a_driver_is_told_until_there_is_one() -> None:
    text = (GUIDES / "add-a-driver.md").read_text("utf-8")
    for folder in ("src/sidestep/drivers", "cpp/src/loop"):
        assert folder in text
        assert not (ROOT / folder).exists(), "there are drivers by now: the guide must tell how one is added"
