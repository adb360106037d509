"""What other packages bring, by entry points: methods beside the controller, and commands.

Sidestep's own room of the thesis comes in this way, so that nothing depends on it. The groups, and what is behind their
entries:

- "sidestep.scenario": `CustomMethod` (sidestep.scenario.custom_method), for scenarios of method "custom";
- "sidestep.bench": `BenchMethod` (sidestep.bench.methods), by the name of a method of the benchmarks;
- "sidestep.studio": `OtherMethods` (sidestep.studio.other_methods), for the studio's list of methods;
- "sidestep.commands": a function for Typer, by the name of the command.
"""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import Any


def plugins(group: str) -> dict[str, Any]:
    """What the entries of a group name, by their names; without those whose module is not there."""
    found = {}
    for entry in entry_points(group=group):
        try:
            found[entry.name] = entry.load()
        except ModuleNotFoundError as error:
            if not f"{entry.module}.".startswith(f"{error.name}."):
                raise  # the module is there, and lacks something itself
    return found
