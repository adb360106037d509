"""What was read, as HTML for the panel of the page."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from sidestep.studio.show.touching import Touching

Document = dict[str, Any]
ALARM = "#D55E00"  # vermillion, as all that needs a look
SHOWN_PAIRS = 30  # of links, in one list
BOX = '<div style="font-size:13px;line-height:1.4;padding:4px 10px;overflow-wrap:anywhere">{}</div>'


def robot_html(facts: Document, warnings: Sequence[str], touching: Touching | None, state: str = "") -> str:
    """Name, masses, joints that do not move freely, warnings, and what touches.

    Args:
        facts: of `document`. warnings: all so far. touching: None while it is measured. state: what the page does now.
    """
    parts = [
        f'<b style="font-size:15px">{html.escape(facts["name"])}</b>',
        f"{html.escape(facts['kind'])}: {html.escape(facts['source'])}"
        if facts["kind"] != "named robot"
        else "",
        f"joint coordinates: {facts['num_coordinates']}, links: {len(facts['links'])}",
        f"base: {_code(facts['base'])}, tip: {_code(facts['tip'])}",
        _mass(facts),
        state,
        _heading(f"Warnings: {len(warnings)}" if warnings else "No warnings"),
        _list((html.escape(_shortened(text, facts["source"])) for text in warnings), ALARM),
        _heading("Links that touch here"),
        _touching_html(touching),
    ]
    if facts["mimic"]:
        parts += [_heading("Mimic joints"), _list(map(_mimic, facts["mimic"]))]
    if facts["locked"]:
        held = (f"{_code(name)} at {value:.4g}" for name, value in facts["locked"].items())
        parts += [_heading("Locked joints [rad or m]"), _list(held)]
    return BOX.format("".join(f"<div>{part}</div>" for part in parts if part))


def joints_html(facts: Document) -> str:
    """Kind and limits of each joint."""
    note = (
        "<i>Descriptions have no limits of acceleration and jerk; these are defaults.</i>"
        if facts["default_acceleration_and_jerk"]
        else ""
    )
    return BOX.format(note + "".join(_joint_html(joint) for joint in facts["joints"]))


def links_html(facts: Document) -> str:
    """What moves each link, its mass and its shapes."""
    rows = []
    for link in facts["links"]:
        mass = "no inertia" if link["mass_kg"] is None else f"{link['mass_kg']:.4g} kg"
        moved = "does not move" if link["moved_by"] is None else f"moved by {_code(link['moved_by'])}"
        shapes = "; ".join(
            f"{what}: {_counted(link[key])}"
            for what, key in (("visual", "visual"), ("collision", "collision"))
            if link[key]
        )
        facts_of = ", ".join((moved, mass)) + f"<br>{shapes or 'no shapes'}"
        rows.append(f'<div style="margin-top:6px"><b>{html.escape(link["name"])}</b><br>{facts_of}</div>')
    return BOX.format("".join(rows))


def configuration_html(facts: Document, q: Sequence[float]) -> str:
    """The configuration in rad, degrees and metres, and as a list for Python."""
    rows = "".join(
        f"<tr><td>{html.escape(joint['name'])}</td>{_cells(_value(joint, value))}</tr>"
        for joint, value in zip(facts["joints"], q, strict=True)
    )
    numbers = ", ".join(f"{value:.4f}" for value in q)
    return BOX.format(
        f'<table style="font-size:12px;border-spacing:0;width:100%"><tbody>{rows}</tbody></table>'
        f'<div style="font-size:12px;margin-top:4px"><code>q = [{numbers}]</code></div>'
    )


def _value(joint: Document, value: float) -> tuple[str, str]:
    if joint["unit"] == "m":
        return f"{value:.4f} m", ""
    return f"{value:.4f} rad", f"{math.degrees(value):.1f}°"


def _cells(texts: Sequence[str]) -> str:
    style = "text-align:right;padding-left:8px;white-space:nowrap"
    return "".join(f'<td style="{style}">{text}</td>' for text in texts)


def _joint_html(joint: Document) -> str:
    unit = joint["unit"]
    force = "N" if unit == "m" else "Nm"
    limits = (
        ("velocity", "velocity", f"{unit}/s"),
        ("acceleration", "acceleration", f"{unit}/s²"),
        ("effort", "effort", force),
        ("jerk", "jerk", f"{unit}/s³"),
        ("effort rate", "effort_rate", f"{force}/s"),
    )
    rest = ", ".join(
        f"{what} {'without limit' if joint[key] is None else f'{joint[key]:.4g} {of}'}"
        for what, key, of in limits
    )
    return (
        f'<div style="margin-top:6px"><b>{html.escape(joint["name"])}</b>, {joint["kind"]}<br>'
        f"position {_interval(joint)}<br>{rest}</div>"
    )


def _interval(joint: Document) -> str:
    lower, upper, unit = joint["lower"], joint["upper"], joint["unit"]
    if lower is None and upper is None:
        return "without limit"
    ends = ["without limit" if end is None else f"{end:.4g}" for end in (lower, upper)]
    text = f"{ends[0]} … {ends[1]} {unit}"
    if unit == "m":
        return text
    degrees = ["" if end is None else f"{math.degrees(end):.1f}°" for end in (lower, upper)]
    return f"{text} ({degrees[0]} … {degrees[1]})"


def _mass(facts: Document) -> str:
    whole, moving = facts["mass_kg"], facts["moving_mass_kg"]
    if moving is None:
        return "mass: the description has no inertias"
    if whole is None:
        return f"mass that the joints move: {moving:.4g} kg"
    return f"mass: {whole:.4g} kg, of which {moving:.4g} kg move"


def _touching_html(touching: Touching | None) -> str:
    if touching is None:
        return "measuring …"
    if touching.reason:
        return f"not measured: {html.escape(touching.reason)}"
    found = (
        _list((_pair(pair) for pair in touching.pairs), ALARM)
        if touching.pairs
        else "none, on the exact meshes"
    )
    for reason, what in (
        ("always", "touch in nearly every posture"),
        ("allowed", "may touch, by the description"),
    ):
        pairs = [_pair(pair) for pair, why in touching.left_out.items() if why == reason]
        if pairs:
            found += (
                f'<div style="opacity:0.75;font-size:12px">Not checked, as they {what}: {_cut(pairs)}</div>'
            )
    return found + '<div style="opacity:0.75;font-size:12px">Neighbours are not checked.</div>'


def _mimic(item: Document) -> str:
    offset = f" {item['offset']:+.4g}" if item["offset"] else ""
    return f"{_code(item['joint'])} = {item['multiplier']:g} × {_code(item['follows'])}{offset}"


def _shortened(text: str, source: str) -> str:
    """A warning with the file's name in place of its path, which stands above already."""
    path = Path(source)
    return text.replace(str(path.resolve()), path.name) if path.is_file() else text


def _counted(kinds: Sequence[str]) -> str:
    return ", ".join(f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds))


def _pair(pair: tuple[str, str]) -> str:
    return f"{_code(pair[0])} – {_code(pair[1])}"


def _cut(texts: Sequence[str]) -> str:
    more = f" and {len(texts) - SHOWN_PAIRS} more" if len(texts) > SHOWN_PAIRS else ""
    return ", ".join(texts[:SHOWN_PAIRS]) + more


def _code(name: str) -> str:
    return f"<code>{html.escape(name)}</code>"


def _heading(text: str) -> str:
    return f'<div style="font-weight:600;margin-top:10px">{text}</div>'


def _list(texts: Iterable[str], colour: str = "inherit") -> str:
    rows = "".join(f"<li>{text}</li>" for text in texts)
    return f'<ul style="margin:0;padding-left:18px;color:{colour}">{rows}</ul>' if rows else ""
