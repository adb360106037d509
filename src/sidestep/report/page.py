"""The report as one web page that needs nothing else: figures and animation are inside the file."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from pathlib import Path

from sidestep.scenario.result import ScenarioResult
from sidestep.scenario.summary import summary_rows

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; }
body { max-width: 960px; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.1rem; margin-top: 2rem; }
table { border-collapse: collapse; }
td { padding: .15rem 1.2rem .15rem 0; border-bottom: 1px solid #e4e4e4; }
img { max-width: 100%; }
.verdict { padding: .6rem 1rem; border-left: 6px solid #D55E00; background: #f6f6f6; }
.success { border-color: #009E73; } pre { background: #f6f6f6; padding: .8rem; overflow-x: auto; }
"""
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
        "<!doctype html><html lang='en'><meta charset='utf-8'>",
        f"<title>Sidestep: {html.escape(scenario.name)}</title><style>{_STYLE}</style>",
        f"<h1>{html.escape(scenario.name)}</h1><p>{html.escape(scenario.description)}</p>",
        f"<p><small>{html.escape(scenario.source)}</small></p>" if scenario.source else "",
        f"<p class='verdict {'success' if result.success else ''}'><b>{verdict.capitalize()}.</b> "
        f"{html.escape(result.sentence())}</p><table>",
    ]
    for name, value, allowed in summary_rows(result):
        parts.append(f"<tr><td>{html.escape(name)}<td>{html.escape(value)}<td>{html.escape(allowed)}")
    parts.append("</table>")
    known = {picture.name: picture for picture in pictures}
    captions = _CAPTIONS | ({"psi.png": "Embedding"} if scenario.method == "custom" else {})
    for name, caption in captions.items():
        if name in known:
            kind = "gif" if name.endswith("gif") else "png"
            data = base64.b64encode(known[name].read_bytes()).decode("ascii")
            parts.append(f"<h2>{caption}</h2><img alt='{caption}' src='data:image/{kind};base64,{data}'>")
    parts.append(
        "<h2>Files</h2><p><code>log.npz</code> and <code>log.csv</code>: the run step by step; "
        "<code>result.json</code>: the figures; <code>scenario.yaml</code>: run it again with "
        "<code>sidestep run scenario.yaml</code>.</p></html>"
    )
    path.write_text("\n".join(parts), encoding="utf-8")
