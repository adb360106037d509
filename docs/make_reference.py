"""Writes docs/reference.md from the public names and the first sentence of each docstring.

Run it after adding or renaming a public name; a test fails while the page differs from what this would write.
"""

from __future__ import annotations

import importlib
import inspect
import re
from pathlib import Path
from types import ModuleType

import sidestep
from sidestep.controller import controller_settings_fields

PAGE = Path(__file__).parent / "reference.md"
# The rooms of the package, each importing only those before it.
ROOMS = ("robot", "obstacles", "body", "distance", "system", "control", "planning", "controller", "thesis")
ROOMS += ("simulation", "scenario", "bench")
INTRODUCTION = """# Reference

What `sidestep` itself has is enough to move an arm. Its rooms hold the rest: `from sidestep.planning import Plan`.
`python docs/make_reference.py` writes this page. `help(sidestep.NAME)` has arguments, shapes, units, frames and errors.
"""
SETTINGS = """
## Settings of the controller

The tree of `ControllerSettings`; units are those of turning joints, for sliding ones rad is m. `planner`, `look_ahead`
and `local_minimum` may be None (in scenario files null), which leaves the part out. A setting without unit has "-".

"""


def first_sentence(name: str, package: ModuleType = sidestep) -> str:
    """The first sentence of a public object's docstring, or what comes before its formula, as a cell of a table."""
    text = inspect.getdoc(getattr(package, name)) or ""
    if re.match(rf"{name}\(.*\)( -> .*)?$", text.split("\n")[0]):  # a signature that the binding put first
        text = text.split("\n", 1)[1].strip()
    paragraph = re.split(r"\n\s*\n|\n    ", text)[0]
    line = " ".join(paragraph.split())
    return re.split(r"(?<=[a-z\])])\. (?=[A-Z])", line)[0].rstrip(",;:").replace("|", r"\|")


def settings_table() -> list[str]:
    """The tree of the controller's settings, a row each, as the core states it."""
    rows = ["| setting | default | unit | allowed | what it trades |\n|---|---|---|---|---|"]
    for field in controller_settings_fields():
        least, most = (f"{field[end]:g}" for end in ("least", "most"))
        allowed = "on, off" if isinstance(field["default"], bool) else f"{least} to {most}"
        default = (
            {True: "on", False: "off"}.get(field["default"]) if allowed == "on, off" else field["default"]
        )
        rows.append(f"| `{field['name']}` | {default} | {field['unit']} | {allowed} | {field['trades']} |")
    return rows


def table(module: str, names: list[str]) -> list[str]:
    """A heading and the names of a module, a row each."""
    package = importlib.import_module(module)
    rows = [f"| `{name}` | {first_sentence(name, package)} |" for name in sorted(names)]
    return [f"\n## `{module}`\n", "| name | what it is |\n|---|---|", *rows]


def page() -> str:
    """The whole page."""
    parts = [
        INTRODUCTION,
        *table("sidestep", [name for name in sidestep.__all__ if not name.startswith("__")]),
    ]
    parts.append(SETTINGS + "\n".join(settings_table()))
    for room in ROOMS:
        name = f"sidestep.{room}"
        members = set(importlib.import_module(name).__all__) - set(sidestep.__all__)
        parts += table(name, sorted(members))
    return "\n".join(parts) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
