"""Every row of the guarantees has an identifier of its own, says all that it must, and names tests that there are."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "concepts" / "guarantees.md"
CELLS = ("identifier", "promise", "assumption", "how it breaks", "what then happens", "test", "last result")


def rows(text: str) -> list[list[str]]:
    """The cells of each row of the table."""
    return [
        [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        for line in text.splitlines()
        if re.match(r"\| G\d+ \|", line)
    ]


def named_tests(cell: str) -> list[str]:
    return re.findall(r"`([^`]+::[^`]+)`", cell)


def exists(test: str) -> bool:
    """Whether a file has a test, as `path::name`: a function in Python, a test case in C++."""
    path, name = test.split("::")
    file = ROOT / path
    pattern = rf"^def {name}\(" if file.suffix == ".py" else rf"^BOOST_(AUTO|FIXTURE)_TEST_CASE\({name}\b"
    return file.is_file() and re.search(pattern, file.read_text(encoding="utf-8"), re.MULTILINE) is not None


def faults(text: str) -> list[str]:
    """What is wrong with a table, in words."""
    found = []
    seen: set[str] = set()
    for row in rows(text):
        name = row[0]
        if name in seen:
            found.append(f"{name} is there twice")
        seen.add(name)
        if len(row) != len(CELLS):
            found.append(f"{name} has {len(row)} cells")
            continue
        found += [f"{name} has no {kind}" for kind, cell in zip(CELLS, row, strict=True) if not cell]
        if not named_tests(row[5]):
            found.append(f"{name} names no test")
        found += [f"{name}: there is no {test}" for test in named_tests(row[5]) if not exists(test)]
    return found


def test_the_table_is_whole_and_its_tests_exist() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert len(rows(text)) > 20
    assert faults(text) == []


def test_identifiers_that_the_page_speaks_of_are_in_the_table() -> None:
    text = PAGE.read_text(encoding="utf-8")
    names = {row[0] for row in rows(text)}
    assert set(re.findall(r"\bG\d+\b", text)) == names


HERE = "`tests/docs/test_guarantees.py::test_faults_are_found`"


@pytest.mark.parametrize(
    ("table", "fault"),
    [
        (f"| G1 | a | b | c | d | {HERE} | e |\n| G1 | a | b | c | d | {HERE} | e |", "G1 is there twice"),
        (f"| G1 | a | b | | d | {HERE} | e |", "G1 has no how it breaks"),
        ("| G1 | a | b | c | d | a test | e |", "G1 names no test"),
        ("| G1 | a | b | c | d | e |", "G1 has 6 cells"),
        (
            "| G1 | a | b | c | d | `tests/docs/test_guarantees.py::test_faults` | e |",
            "G1: there is no tests/docs/test_guarantees.py::test_faults",
        ),
        (
            "| G1 | a | b | c | d | `cpp/tests/none.cpp::a_case` | e |",
            "G1: there is no cpp/tests/none.cpp::a_case",
        ),
    ],
)
def test_faults_are_found(table: str, fault: str) -> None:
    assert faults(table) == [fault]
