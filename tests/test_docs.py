"""The documentation names what there is, and its examples are valid."""

import re
from pathlib import Path

import sidestep
from sidestep.scenario import Scenario

DOCS = Path(__file__).parents[1] / "docs"


def test_reference_lists_every_public_name() -> None:
    listed = re.findall(r"^\| `(\w+)` \|", (DOCS / "reference.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(listed) == sorted(set(sidestep.__all__) - {"__version__"})


def test_scenario_example_is_valid() -> None:
    (text,) = re.findall(r"```yaml\n(.*?)```", (DOCS / "scenarios.md").read_text(encoding="utf-8"), re.DOTALL)
    scenario = Scenario.from_text(text, file="docs/scenarios.md")
    assert scenario.robot.name == "planar3"
    assert scenario.obstacles[0].shape.radius == 0.05
