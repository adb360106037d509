"""The report as one web page that needs nothing else: figures and animation are inside the file."""

from __future__ import annotations

import html
from collections.abc import Sequence
from pathlib import Path

from sidestep.report.page_parts import head, picture, table
from sidestep.scenario.result import ScenarioResult
from sidestep.scenario.summary import summary_rows

_CAPTIONS = {
    "animation.gif": "The run (a cross marks the tip at the goal, a line the path of the tip)",
    "arm.png": "The arm at several instants",
    "clearance.png": "Exact clearance between arm and obstacles",
    "position.png": "Joint positions",
    "velocity.png": "Joint velocities",
    "acceleration.png": "Joint accelerations: wanted by the method, achieved by the arm",
    "torque.png": "Joint torques",
    "switch.png": "Switch weights",
    "psi.png": "What bent the motion: barriers that were active, by part of the arm and what it kept off",
}


def write_page(result: ScenarioResult, pictures: Sequence[Path], path: Path) -> None:
    """Writes index.html with the summary, the pictures and the scenario."""
    scenario = result.scenario
    verdict = "success" if result.success else "no success"
    parts = [
        head(scenario.name),
        f"<h1>{html.escape(scenario.name)}</h1><p>{html.escape(scenario.description)}</p>",
        f"<p><small>{html.escape(scenario.source)}</small></p>" if scenario.source else "",
        f"<p class='verdict {'success' if result.success else ''}'><b>{verdict.capitalize()}.</b> "
        f"{html.escape(result.sentence())}</p>",
        table((), summary_rows(result)),
    ]
    known = {path.name: path for path in pictures}
    captions = _CAPTIONS | ({"psi.png": "Embedding"} if scenario.method == "custom" else {})
    for name, caption in captions.items():
        if name in known:
            kind = "gif" if name.endswith("gif") else "png"
            parts.append(picture(known[name].read_bytes(), caption, kind=kind))
    parts.append(
        "<h2>Files</h2><p><code>log.npz</code> and <code>log.csv</code>: the run step by step; "
        "<code>result.json</code>: the figures; <code>scenario.yaml</code>: run it again with "
        "<code>sidestep run scenario.yaml</code>.</p></html>"
    )
    path.write_text("\n".join(parts), encoding="utf-8")
