"""The report as one web page that needs nothing else: every figure is inside the file."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from pathlib import Path

from sidestep.thesis.reproduce.item import Figure, Item
from sidestep.thesis.reproduce.registry import Part

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; }
body { max-width: 800px; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.3rem; margin-top: 3rem; border-bottom: 2px solid #0072B2; }
h3 { font-size: 1.05rem; margin-top: 2.2rem; }
img { width: 100%; height: auto; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .88rem; }
th, td { text-align: left; vertical-align: top; }
th, td { padding: .25rem .9rem .25rem 0; border-bottom: 1px solid #e0e0e0; }
dl { display: grid; grid-template-columns: max-content 1fr; }
dl { gap: .15rem .9rem; font-size: .9rem; color: #444; }
dt { font-weight: 600; } dd { margin: 0; }
.files { font-size: .82rem; color: #666; } nav { columns: 2; font-size: .9rem; } nav p { margin: 0; }
.facts { background: #f4f6f8; padding: .6rem 1rem; font-size: .88rem; }
"""


def write_page(
    parts: Sequence[tuple[Part, Sequence[Item]]],
    facts: Sequence[str],
    files: dict[str, list[Path]],
    path: Path,
) -> None:
    """Writes the report.

    Args:
        parts: the parts that ran, each with its items.
        facts: lines about the run (machine, version, time).
        files: name of an item to the files written for it.
        path: of the page.
    """
    body = [
        "<!doctype html><html lang='en'><meta charset='utf-8'>",
        "<meta name='viewport' content='width=device-width'>",
        f"<title>Sidestep: the thesis, reproduced</title><style>{_STYLE}</style>",
        "<h1>The thesis, reproduced</h1>",
        "<p>The experiments of B. Bosc, <i>Geometric Dynamical Systems for Obstacle Avoidance in Manipulator "
        "Configuration Space</i> (2024), computed again with the corrected equations. Each figure has the "
        "number of the thesis's figure it stands beside; equations of the thesis are written T5.4.</p>",
        "<p class='facts'>" + "<br>".join(html.escape(line) for line in facts) + "</p><nav>",
    ]
    for _, items in parts:
        body += [f"<p><a href='#{item.name}'>{_number(item)}</a> {_text(item.title)}</p>" for item in items]
    body.append("</nav>")
    chapter = ""
    for part, items in parts:
        if part.chapter != chapter:
            chapter = part.chapter
            body.append(f"<h2>{_text(chapter)}</h2>")
        for item in items:
            body += _item(item, files[item.name])
    body.append("</html>")
    path.write_text("\n".join(body), encoding="utf-8")


def _item(item: Item, files: Sequence[Path]) -> list[str]:
    lines = [f"<h3 id='{item.name}'>{_number(item)} {_text(item.title)}</h3>"]
    if isinstance(item, Figure):
        picture = next(file for file in files if file.suffix == ".png")
        code = base64.b64encode(picture.read_bytes()).decode("ascii")
        lines.append(f"<img alt='{_text(item.title)}' src='data:image/png;base64,{code}'>")
    else:
        heads = "".join(f"<th>{_text(name)}</th>" for name in item.columns)
        lines.append(f"<div class='scroll'><table><tr>{heads}</tr>")
        lines += ["<tr>" + "".join(f"<td>{_text(cell)}</td>" for cell in row) + "</tr>" for row in item.rows]
        lines.append("</table></div>")
    caption = "".join(f"<dt>{label}</dt><dd>{_text(text)}</dd>" for label, text in item.caption.lines())
    lines.append(f"<dl>{caption}</dl>")
    names = ", ".join(f"<code>{_text(file.name)}</code>" for file in files)
    lines.append(f"<p class='files'>Files: {names}</p>")
    return lines


def _number(item: Item) -> str:
    """The label before a title; a table that the thesis does not have carries no number."""
    kind = "Figure" if isinstance(item, Figure) else "Table"
    numbered = isinstance(item, Figure) or item.key == "6.1"
    return f"{kind} {html.escape(item.key)}." if numbered else f"{kind}."


def _text(text: str) -> str:
    return html.escape(text, quote=True)
