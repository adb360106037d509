"""The guide to a constraint of one's own shows the class that the C++ tests build, and names files that there are."""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / ".ci" / "structure"))

from files import Checkout  # noqa: E402

PAGE = (ROOT / "docs" / "how-to" / "add-a-constraint.md").read_text(encoding="utf-8")


def test_the_guide_shows_the_class_that_is_tested() -> None:
    tested = (ROOT / "cpp/tests/constraints/own_constraint_test.cpp").read_text(encoding="utf-8")
    first = re.findall(r"```cpp\n(.*?)```", PAGE, re.DOTALL)[0]
    shown = first[first.index("/// Keeps") : first.rindex("};") + 2]
    assert "class AbovePlane : public Constraint" in shown
    assert shown in tested


def test_a_constraint_touches_three_files_at_most() -> None:
    table = PAGE[PAGE.index("## The files") :]
    files = re.findall(r"^\| `([^`]+)`", table, re.MULTILINE)
    assert len(files) == 3
    there = [file for file in files if (ROOT / file).exists()]
    assert there == ["cpp/src/constraints/motion_program.cpp"]  # the others are the constraint's own
    # One that every arm has, beside its tests: header, source, and the list.
    of_torque = Checkout(ROOT).that_know(r"\bGravityTorqueConstraint\b|gravity_torque_constraint")
    assert of_torque == [
        "cpp/include/sidestep/constraints/gravity_torque_constraint.hpp",
        "cpp/src/constraints/gravity_torque_constraint.cpp",
        "cpp/src/constraints/motion_program.cpp",
    ]


def test_the_guide_lists_every_priority_that_rows_may_have() -> None:
    source = (ROOT / "cpp/src/constraints/motion_program.cpp").read_text(encoding="utf-8")
    listed = set(re.findall(r"^\| `Priority::(\w+)`", PAGE, re.MULTILINE))
    assert listed == set(re.findall(r"priority != Priority::(\w+)", source))
