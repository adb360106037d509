"""Writes what the pages of docs/reference take from the code: names, settings, the command line.

Run it after you add or rename a public name, a setting or an option: `python docs/make_reference.py`. A test fails
while the pages differ from what this would write.
"""

from __future__ import annotations

import importlib
import inspect
import re
from enum import Enum
from pathlib import Path
from types import ModuleType
from typing import Any, get_type_hints

import typer

import sidestep
from sidestep._core import perception_settings_fields
from sidestep.cli import app
from sidestep.controller import controller_settings_fields
from sidestep.link import link_messages, link_version
from sidestep.loop import loop_settings_fields, supervisor_settings_fields

FOLDER = Path(__file__).parent / "reference"
# The parts of the package, each importing only those before it.
PARTS = (
    "robot",
    "obstacles",
    "body",
    "distance",
    "arm",
    "system",
    "control",
    "planning",
    "controller",
    "loop",
    "drivers",
    "thesis",
)
PARTS += ("simulation", "scenario", "bench", "studio")
NAMES = """# Python

The names of `sidestep` itself are enough to move an arm. Its parts hold the rest: `from sidestep.planning import Plan`.
The site has a page for each part, with arguments, shapes, units, frames and errors; so has `help(sidestep.NAME)`.
`python docs/make_reference.py` writes this page.
"""
SETTINGS = """# Settings

The tree of `ControllerSettings`. Set one by its name:
`ss.ControllerSettings(barriers=BarrierSettings(activation=0.15))`, with `BarrierSettings` from `sidestep.controller`.
Scenario files use the same names. A value out of range is refused by name.

Units are those of revolute joints; for prismatic joints read m for rad. A setting without unit has "-". `planner`,
`look_ahead` and `local_minimum` may be None (in scenario files null), which leaves the part out. `speed_limits` is off
by default. [Tuning](../how-to/tuning.md) says what to turn first.
`python docs/make_reference.py` writes this page from the tables in the core.

"""
PERCEPTION = """

## Perception

`ss.perception.Perception(controller, cameras, ss.perception.PerceptionSettings(voxel=0.015))`:
[from a depth camera](../how-to/camera.md).

"""
LOOP = """

## Loop

`ss.run(controller, driver, settings=ss.loop.LoopSettings(priority=80))`: [run on a robot](../how-to/run-on-a-robot.md).

"""
SUPERVISOR = """

## Supervisor

`ss.loop.Supervisor(controller, ss.loop.SupervisorSettings(tolerance=0.05))`.

"""
COMMANDS = """# Command line

Every command has `--help`. Exit codes: 0 on success, 1 when a run fails, 2 on bad input, with one line on stderr.
`--json -` prints figures to stdout and everything else to stderr. `python docs/make_reference.py` writes this page.
"""


PROTOCOL = f"""# Messages between programs

What `sidestep serve`, its clients, and robots in programs of their own say to each other over a stream
socket, protocol version {link_version}. [Serve](../how-to/serve.md) says how to use them. `python
docs/make_reference.py` writes this page from the code.

A message is a header of 20 bytes and the fields of its type, one after the other, all little-endian and
without padding:

| part | kind | what it is |
|---|---|---|
| `magic` | uint32 | 0x54534453, the bytes `SDST` |
| `version` | uint16 | {link_version}; both sides must have the same |
| `type` | uint16 | number of the message, see below |
| `payload` | uint32 | number of bytes that follow the header |
| `sequence` | uint64 | counts the messages of a sender; an answer has that of its request |

A text is a uint32, the number of bytes, and UTF-8. A vector is a uint32, the number of entries, and float64
each; a matrix has two uint32, rows and columns, and its entries column by column. A list is a uint32 and its
entries. A bool is one byte.

Another beginning, another version and a payload longer than the type allows break the protocol: the answer is
`Refused` with words, and the connection ends. Anything else that is wrong, such as a type that is unknown, a
number that is none, or what the controller does not allow, is answered by `Refused`, and the connection goes
on.
"""


def first_sentence(name: str, package: ModuleType = sidestep) -> str:
    """The first sentence of a public object's docstring, or what comes before its formula, as a cell of a table."""
    text = inspect.getdoc(getattr(package, name)) or ""
    if re.match(rf"{name}\(.*\)( -> .*)?$", text.split("\n")[0]):  # a signature that the binding put first
        text = text.split("\n", 1)[1].strip()
    paragraph = re.split(r"\n\s*\n|\n    ", text)[0]
    line = " ".join(paragraph.split())
    return re.split(r"(?<=[a-z\])])\. (?=[A-Z])", line)[0].rstrip(",;:").replace("|", r"\|")


def settings_table(fields: list[dict[str, float | str]]) -> list[str]:
    """Settings, a row each, as the core states them."""
    rows = ["| setting | default | unit | allowed | what it is and trades |\n|---|---|---|---|---|"]
    for field in fields:
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


def public_names() -> dict[str, list[str]]:
    """The public names of `sidestep` and of each part that `sidestep` itself does not have."""
    names = {"sidestep": sorted(name for name in sidestep.__all__ if not name.startswith("__"))}
    for part in PARTS:
        module = f"sidestep.{part}"
        names[module] = sorted(set(importlib.import_module(module).__all__) - set(sidestep.__all__))
    return names


def value_word(parameter: Any, hints: dict[str, Any]) -> str:
    """What to write for the value of an argument or option: the choices where there are some, else its name."""
    hint = hints.get(parameter.name)
    if isinstance(hint, type) and issubclass(hint, Enum):
        return "|".join(str(item.value) for item in hint)
    return str(parameter.metavar or parameter.name.upper().replace("_", "-"))


def option_row(parameter: Any, hints: dict[str, Any]) -> str:
    """One argument or option of a command, as a row of a table."""
    if parameter.param_type_name == "argument":
        name = value_word(parameter, hints)
    else:
        name = ", ".join([*parameter.opts, *parameter.secondary_opts])
        if not parameter.is_flag:
            name += f" {value_word(parameter, hints)}"
    default = parameter.default
    if default is None or default is False or default in ("", ()) or callable(default):
        shown = "required" if parameter.required else ""
    else:
        shown = "on" if default is True else f"`{getattr(default, 'value', default)}`"
    says = " ".join((getattr(parameter, "help", None) or "").split())
    says = says.replace("] [", r"] \[")  # a unit and a default are no link
    cells = (f"`{name}`", says, shown)
    return "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |"


def command_parts(name: str, command: Any) -> list[str]:
    """A heading, the text and the options of a command, and those of its own commands."""
    help_text = inspect.cleandoc(command.help or "")
    parts = [f"\n## `{name}`\n", help_text]
    hints = get_type_hints(command.callback) if command.callback else {}
    rows = [option_row(item, hints) for item in command.params if not getattr(item, "hidden", False)]
    if rows:
        parts.append("\n| argument or option | what it does | default |\n|---|---|---|\n" + "\n".join(rows))
    for word, inner in sorted(getattr(command, "commands", {}).items()):
        parts += command_parts(f"{name} {word}", inner)
    return parts


def protocol_parts() -> list[str]:
    """The messages of the protocol, each with a table of its fields."""
    parts = []
    for message in link_messages():
        head = f"\n## {message['type']} `{message['name']}`\n\n{message['meaning']}"
        parts.append(f"{head} From {message['sender']}; at most {message['largest']} bytes.")
        rows = [
            f"| `{name}` | {kind} | {meaning.replace('|', chr(92) + '|')} |"
            for name, kind, meaning in message["fields"]
        ]
        if rows:
            parts += ["", "| field | kind | what it is |", "|---|---|---|", *rows]
    return parts


def pages() -> dict[Path, str]:
    """The text of each page."""
    names = [part for module, names in public_names().items() for part in table(module, names)]
    return {
        FOLDER / "python.md": "\n".join([NAMES, *names]) + "\n",
        FOLDER / "settings.md": SETTINGS
        + "\n".join(settings_table(controller_settings_fields()))
        + PERCEPTION
        + "\n".join(settings_table(perception_settings_fields()))
        + LOOP
        + "\n".join(settings_table(loop_settings_fields()))
        + SUPERVISOR
        + "\n".join(settings_table(supervisor_settings_fields()))
        + "\n",
        FOLDER / "protocol.md": "\n".join([PROTOCOL.rstrip(), *protocol_parts()]) + "\n",
        FOLDER / "command-line.md": "\n".join(
            [COMMANDS, *command_parts("sidestep", typer.main.get_command(app))]
        )
        + "\n",
    }


if __name__ == "__main__":
    for path, text in pages().items():
        path.write_text(text, encoding="utf-8")
