"""The thesis, reproduced: every experiment with the correct equations, as a self-contained report."""

from __future__ import annotations

from sidestep.thesis.reproduce.item import Caption, Figure, Item, Table
from sidestep.thesis.reproduce.registry import PARTS, Part, Settings, select
from sidestep.thesis.reproduce.runner import Outcome, reproduce

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
