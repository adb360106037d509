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


def test_how_the_code_is_built_names_files_and_functions_that_there_are() -> None:
    root = DOCS.parent
    page = (DOCS / "how-the-code-is-built.md").read_text(encoding="utf-8")
    names = re.findall(r"`([^`\n]+)`", page)
    files = [name for name in names if re.match(r"(cpp|src|bindings|tests)/", name)]
    functions = [name for name in names if "::" in name]
    assert len(files) > 25
    assert len(functions) > 25
    assert [name for name in files if not (root / name).exists()] == []
    core = [file for suffix in ("cpp", "hpp", "inl") for file in (root / "cpp").rglob(f"*.{suffix}")]
    text = "\n".join(file.read_text(encoding="utf-8") for file in core)
    # `Class::function` as it is defined, or by its last name where it is defined inside its class.
    unknown = [
        name
        for name in functions
        if f"{name}(" not in text and not re.search(rf"\b{name.split('::')[-1]}\(", text)
    ]
    assert unknown == []
    plain = [name for name in names if re.fullmatch(r"[A-Za-z_]+", name) and name not in files]
    python = "\n".join(file.read_text(encoding="utf-8") for file in (root / "src").rglob("*.py"))
    assert [name for name in plain if not re.search(rf"\b{name}\b", text + python)] == []
