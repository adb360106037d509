"""What the page says of the depth camera, as HTML: how many of each kind there are, how old they are, and times."""

from __future__ import annotations

import html

from sidestep.perception.colours import CELLS, PIXELS
from sidestep.studio.sight import KINDS, STAGES, CameraState, Sight

BOX = "font-size:12px;line-height:1.4;padding:2px 10px"
KINDS_IN_WORDS = {"seen": "seen now", "remembered": "remembered", "hidden": "hidden"}
PIXELS_IN_WORDS = {  # of the image
    "obstacle": "obstacles, in grey",
    "arm": "taken out as arm",
    "edge": "flying pixels",
    "explained": "explained",
    "outside": "out of range",
    "nothing": "no depth",
}
COLOURS = {**PIXELS, **CELLS, "obstacle": "#9E9E9E"}  # in the image, obstacles have the greys of their depths


def words_of(state: CameraState, *, running: bool) -> str:
    """All of a state."""
    if state.error:
        return f'<div id="camera" style="{BOX}"><b>The camera is off:</b> {html.escape(state.error)}</div>'
    if state.choice is None:
        return f'<div id="camera" style="{BOX}">The camera is off.</div>'
    if state.sight is None:
        waits = "preparing the camera …" if running else "no image yet: the loop is paused"
        return f'<div id="camera" style="{BOX}">{waits}</div>'
    rows = [*cell_rows(state.sight), *beside_rows(state), *pixel_rows(state.sight)]
    table = f'<table id="camera-legend" style="border-spacing:0">{"".join(rows)}</table>'
    return f'<div id="camera" style="{BOX}">{facts(state, state.sight)}{table}{stages(state.sight)}</div>'


def facts(state: CameraState, sight: Sight) -> str:
    """Age of the image, how many there were, and what is doubtful."""
    lost = f", {state.lost} lost" if state.lost else ""
    question = f'<div style="color:#B00020">{html.escape(sight.question)}</div>' if sight.question else ""
    return f"<div>image {sight.number}{lost}, captured {1e3 * state.age:.0f} ms ago</div>{question}"


def cell_rows(sight: Sight) -> list[str]:
    """Of each kind of cell, how many there are and how long ago they were shown."""
    rows = []
    for kind, name in enumerate(KINDS):
        ages = sight.ages[sight.kinds == kind]
        age = f"{ages.min():.1f} to {ages.max():.1f} s" if len(ages) and kind else ""
        rows.append(row(name, KINDS_IN_WORDS[name], str(len(ages)), age))
    return rows


def beside_rows(state: CameraState) -> list[str]:
    """Space that nobody has seen, and what moves."""
    assert state.sight is not None
    assert state.choice is not None
    free = "counts as free" if state.choice.unseen_is_free else ""
    speed = f"up to {state.speeds.max():.2f} m/s" if len(state.speeds) else ""
    unseen = "–" if free else str(len(state.sight.unseen))
    return [
        row("unseen", "never looked at", unseen, free),
        row("moving", "moving", str(len(state.moving)), speed),
    ]


def pixel_rows(sight: Sight) -> list[str]:
    """Shares of the image."""
    head = '<tr><td colspan="4" style="padding-top:6px;opacity:0.7">pixels of the image</td></tr>'
    return [
        head,
        *(row(name, what, f"{100 * sight.pixels[name]:.1f} %") for name, what in PIXELS_IN_WORDS.items()),
    ]


def stages(sight: Sight) -> str:
    """What each stage took."""
    parts = ", ".join(f"{name} {1e3 * time:.1f}" for name, time in zip(STAGES, sight.times, strict=True))
    total = 1e3 * sum(sight.times)
    return (
        f'<div id="camera-times" style="margin-top:6px"><b>{total:.1f} ms</b> from image to obstacles: {parts} ms; '
        f"{1e3 * sight.rendering:.0f} ms to render the image, in a process of its own</div>"
    )


def row(name: str, what: str, count: str, age: str = "") -> str:
    """A row of the legend: colour, meaning, number and age."""
    return (
        f'<tr data-kind="{name}"><td style="padding-right:6px"><span style="display:inline-block;width:11px;'
        f'height:11px;border-radius:3px;background:{COLOURS[name]};outline:1px solid #BBBBBB"></span></td>'
        f"<td>{what}</td>"
        f'<td style="text-align:right;padding:0 8px;white-space:nowrap"><b>{count}</b></td>'
        f'<td style="opacity:0.8;white-space:nowrap">{age}</td></tr>'
    )
