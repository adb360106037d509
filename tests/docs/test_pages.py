"""The pages that are written from the code are what their script writes, and examples of files are valid."""

import re
import runpy
from pathlib import Path

import pytest

from sidestep import system
from sidestep.scenario import Scenario

DOCS = Path(__file__).parents[2] / "docs"
MAKE = runpy.run_path(str(DOCS / "make_reference.py"))


@pytest.mark.parametrize("name", ["python.md", "settings.md", "command-line.md", "protocol.md"])
def test_page_is_what_its_script_writes(name: str) -> None:
    page = DOCS / "reference" / name
    assert page.read_text(encoding="utf-8") == MAKE["pages"]()[page], "run: python docs/make_reference.py"


def test_a_bar_stays_a_bar_in_a_cell_of_the_reference() -> None:
    assert r"x, y [rad \| m] move" in MAKE["first_sentence"]("ClearanceTable", system)
    assert r"N(y \| mu_k, Sigma_k)" in MAKE["first_sentence"]("Body")
    for path, text in MAKE["pages"]().items():
        bars = 0
        for row in text.splitlines():
            if row.startswith("|---"):
                bars = row.count("|")
                assert bars in (3, 4, 6), path  # two cells; three of an option; five of a setting
            elif row.startswith("| `"):
                assert len(re.findall(r"(?<!\\)\|", row)) == bars, row


def test_every_command_and_option_is_listed() -> None:
    text = MAKE["pages"]()[DOCS / "reference" / "command-line.md"]
    assert "## `sidestep bench reach`" in text
    assert (
        r"| `--method controller\|barrier\|thesis\|unswitched` | How the arm is moved. | `controller` |"
        in text
    )
    assert "| `--seed SEED` | Seed of all that is random. | `0` |" in text


def test_scenario_example_is_valid() -> None:
    page = (DOCS / "reference" / "scenarios.md").read_text(encoding="utf-8")
    text, settings = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)
    scenario = Scenario.from_text(text, file="docs/reference/scenarios.md")
    assert "look_ahead" in Scenario.from_text(text + settings, file="docs/reference/scenarios.md").controller
    assert scenario.robot.name == "planar3"
    assert scenario.obstacles[0].shape.radius == 0.05
