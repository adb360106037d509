"""The thesis, reproduced: every experiment with the correct equations, as a self-contained report."""

from __future__ import annotations

from sidestep.reproduce.item import Caption, Figure, Item, Table
from sidestep.reproduce.registry import PARTS, Part, Settings, select
from sidestep.reproduce.runner import Outcome, reproduce

__all__ = [
    "PARTS",
    "Caption",
    "Figure",
    "Item",
    "Outcome",
    "Part",
    "Settings",
    "Table",
    "reproduce",
    "select",
]
