"""What every page of a report has: its style, and pictures inside the file."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; }
body { max-width: 960px; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.1rem; margin-top: 2rem; }
table { border-collapse: collapse; }
td, th { padding: .15rem 1.2rem .15rem 0; border-bottom: 1px solid #e4e4e4; text-align: left; }
img { max-width: 100%; }
.verdict { padding: .6rem 1rem; border-left: 6px solid #D55E00; background: #f6f6f6; }
.success { border-color: #009E73; } pre { background: #f6f6f6; padding: .8rem; overflow-x: auto; }
"""


def head(title: str) -> str:
    """The beginning of a page; `title` is text."""
    return (
        "<!doctype html><html lang='en'><meta charset='utf-8'>"
        f"<title>Sidestep: {html.escape(title)}</title><style>{STYLE}</style>"
    )


def picture(content: bytes, caption: str, *, kind: str = "png") -> str:
    """A picture under its caption, which is text; `kind`: png or gif."""
    words = html.escape(caption, quote=True)
    data = base64.b64encode(content).decode("ascii")
    return f"<h2>{words}</h2><img alt='{words}' src='data:image/{kind};base64,{data}'>"


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table of texts; without a header where that is empty."""
    parts = ["<table>"]
    if header:
        parts.append("<tr>" + "".join(f"<th>{html.escape(name)}" for name in header))
    parts += ["<tr>" + "".join(f"<td>{html.escape(cell)}" for cell in row) for row in rows]
    return "\n".join([*parts, "</table>"])
