"""Sidestep: reactive whole-arm obstacle avoidance on the curved configuration space of a manipulator."""

import importlib
from typing import TYPE_CHECKING

from sidestep._core import __version__

if TYPE_CHECKING:  # what type checkers and editors see; at run time a name is imported on first use, see below
    pass

# A public name and the module it comes from. Loaded on first use, so that the command line starts at once.
_EXPORTS: dict[str, str] = {}

__all__ = ["__version__"]


def __getattr__(name: str) -> object:
    if name not in _EXPORTS:
        raise AttributeError(f"module 'sidestep' has no attribute {name!r}")
    value = getattr(importlib.import_module(_EXPORTS[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(set(globals()) | set(_EXPORTS))
