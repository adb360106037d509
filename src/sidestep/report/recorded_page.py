"""A recorded run as one web page that needs nothing else."""

from __future__ import annotations

import html
import io
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from sidestep.report.page_parts import head, picture, table
from sidestep.report.recorded_arrays import RecordedArrays
from sidestep.report.recorded_figures import (
    draw_clearance,
    draw_status,
    draw_torque,
    draw_velocity,
    has_torque,
    single,
)

DPI = 110
MOST_EVENTS = 200  # rows of the table


def write_recorded_page(run: RecordedArrays, path: Path) -> None:
    """Writes the page: summary, status, clearance by link, velocity, torque, and what happened."""
    own = run.links[-1]
    parts = [
        head(f"{run.arm.name}, recorded"),
        f"<h1>{html.escape(run.arm.name)}: {run.duration:.2f} s recorded</h1>",
        f"<p class='verdict {'' if worst_is_bad(run) else 'success'}'>{html.escape(sentence(run))}</p>",
        table((), summary(run)),
        picture(_png(single(run, draw_status, 1.2)), "Status and activity"),
        picture(
            _png(single(run, draw_clearance)),
            f"Clearance of each link to what is around, and of {own} (dashed), by the covering ellipsoids",
        ),
        picture(_png(single(run, draw_velocity)), "Commanded velocity, as a share of its limit"),
    ]
    if has_torque(run):
        parts.append(
            picture(
                _png(single(run, draw_torque)), "Commanded torque, gravity included, as a share of its limit"
            )
        )
    events = run.events
    rows = [(f"{event.time:.3f}", event.kind, event.words) for event in events[:MOST_EVENTS]]
    if len(events) > MOST_EVENTS:
        rows.append(("", "", f"and {len(events) - MOST_EVENTS} more"))
    parts += ["<h2>What happened</h2>", table(("time [s]", "change of", "to, and why"), rows), "</html>"]
    path.write_text("\n".join(parts), encoding="utf-8")


def worst_is_bad(run: RecordedArrays) -> bool:
    """Whether a margin was lost, or worse."""
    return bool(np.isin(run.status, ["margin_lost", "tracking_lost", "stopping", "clearance_lost"]).any())


def sentence(run: RecordedArrays) -> str:
    """How the run went, in one or two sentences."""
    if len(run) == 0:
        return "No step was recorded."
    end = run.activity[-1].replace("_", " ")
    text = f"At the end: {end}, {run.status[-1].replace('_', ' ')}."
    known = np.isfinite(run.clearance)
    if known.any():
        k = int(np.argmin(np.where(known, run.clearance, np.inf)))
        text += f" Least clearance {1e3 * run.clearance[k]:.0f} mm at {run.time[k]:.3f} s ({run.nearest[k]})."
    if run.damage:
        text += f" Damaged: {run.damage}."
    elif not run.complete:
        text += " The recording was not ended: its program stopped before."
    if run.lost:
        text += f" {run.lost:,} steps after these were lost."
    return text


def summary(run: RecordedArrays) -> list[tuple[str, str]]:
    """Figures of a run, by name."""
    limits = run.arm.robot.limits
    rows = [
        ("steps", f"{len(run):,}, {run.duration:.3f} s"),
        ("recorded by", f"Sidestep {run.core.header.sidestep_version}"),
        ("from", "its first step on" if run.whole else "a black box: from the middle of a motion"),
    ]
    rows += [("status", _shares(run.status)), ("activity", _shares(run.activity))]
    fastest = _largest(np.abs(run.velocity) / limits.velocity, run.joint_names)
    rows.append(("largest velocity / limit", fastest))
    if has_torque(run):
        rows.append(("largest torque / limit", _largest(np.abs(run.torque) / limits.effort, run.joint_names)))
    if np.isfinite(run.tracking_error).any():
        rows.append(("largest tracking error", f"{np.nanmax(run.tracking_error):.4f} rad | m"))
    return rows


def _shares(names: np.ndarray[tuple[int], np.dtype[np.str_]]) -> str:
    found, counts = np.unique(names, return_counts=True)
    order = np.argsort(-counts)
    return ", ".join(f"{found[k].replace('_', ' ')} {100 * counts[k] / len(names):.1f} %" for k in order)


def _largest(shares: np.ndarray[tuple[int, int], np.dtype[np.float64]], names: tuple[str, ...]) -> str:
    if len(shares) == 0 or np.isnan(shares).all():
        return "unknown"
    joint = int(np.nanargmax(shares)) % shares.shape[1]
    return f"{100 * np.nanmax(shares):.0f} % ({names[joint]})"


def _png(figure: Figure) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=DPI)
    return stream.getvalue()
