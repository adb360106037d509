"""Small print beside controls: what they do can be read without a mouse over them."""

from __future__ import annotations

import html
from typing import Any


def add_note(gui: Any, text: str) -> Any:
    """A sentence in small letters, below what was added last; returns its handle."""
    return gui.add_html(
        '<div style="font-size:12px;line-height:1.35;opacity:0.75;padding:0 10px;margin:-6px 0 2px">'
        f"{html.escape(text)}</div>"
    )
