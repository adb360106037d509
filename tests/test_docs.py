"""The documentation names what there is, and its examples are valid."""

import re
import runpy
from pathlib import Path

from sidestep import system
from sidestep.scenario import Scenario

DOCS = Path(__file__).parents[1] / "docs"


def test_reference_is_what_its_script_writes() -> None:
    make_reference = runpy.run_path(str(DOCS / "make_reference.py"))
    assert (DOCS / "reference.md").read_text(encoding="utf-8") == make_reference["page"]()


def test_a_bar_stays_a_bar_in_a_cell_of_the_reference() -> None:
    first_sentence = runpy.run_path(str(DOCS / "make_reference.py"))["first_sentence"]
    assert r"x, y [rad \| m] move" in first_sentence("ClearanceTable", system)
    assert r"N(y \| mu_k, Sigma_k)" in first_sentence("Body")
    bars = 0
    for row in (DOCS / "reference.md").read_text(encoding="utf-8").splitlines():
        if row.startswith("|---"):
            bars = row.count("|")
            assert bars in (3, 6)  # two cells; five of a setting
        elif row.startswith("| `"):
            assert len(re.findall(r"(?<!\\)\|", row)) == bars, row


def test_scenario_example_is_valid() -> None:
    page = (DOCS / "scenarios.md").read_text(encoding="utf-8")
    text, settings = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)
    scenario = Scenario.from_text(text, file="docs/scenarios.md")
    assert "look_ahead" in Scenario.from_text(text + settings, file="docs/scenarios.md").controller
    assert scenario.robot.name == "planar3"
    assert scenario.obstacles[0].shape.radius == 0.05
