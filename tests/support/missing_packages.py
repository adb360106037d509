"""Programs that run as if some packages of the extras were not installed."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

from sidestep.extras import MODULES

PROJECT = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
OPTIONAL = sorted({module for modules in MODULES.values() for module in modules})

# Begins programs in which some packages are not installed.
HIDE = """
import sys

class Hidden:
    def __init__(self, finder, names):
        self.finder, self.names = finder, names
    def __getattr__(self, name):
        return getattr(self.finder, name)
    def find_spec(self, name, path=None, target=None):
        return None if name.partition(".")[0] in self.names else self.finder.find_spec(name, path, target)

def hide(*names):
    sys.meta_path[:] = [Hidden(finder, names) for finder in sys.meta_path]
"""


def held_by(extra: str) -> set[str]:
    """An extra and those that it installs as well."""
    nested = re.findall(r"sidestep\[(.+?)\]", " ".join(PROJECT["optional-dependencies"][extra]))
    return {extra}.union(*(held_by(name) for names in nested for name in names.split(",")))


def missing_without(*extras: str) -> list[str]:
    """The packages of extras that are not installed where these extras are."""
    held = set().union(*map(held_by, extras))
    there = {module for extra in held for module in MODULES.get(extra, ())}
    return sorted(set(OPTIONAL) - there)


def run(code: str, *arguments: str | Path, folder: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Runs a program that may `hide` packages, in a folder."""
    program = [sys.executable, "-c", HIDE + code, *map(str, arguments)]
    return subprocess.run(program, capture_output=True, text=True, check=False, cwd=folder)
