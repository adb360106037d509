"""Writes the report folder of a run."""

from __future__ import annotations

import json
from pathlib import Path

from sidestep.report.animation import ArmPictures, write_animation, write_instants
from sidestep.report.figures import write_figures
from sidestep.report.page import write_page
from sidestep.report.tables import write_csv, write_npz
from sidestep.scenario.result import ScenarioResult


def write_report(result: ScenarioResult, folder: str | Path, *, animation: bool = True) -> tuple[Path, ...]:
    """Writes everything about a run into a folder, which is made if need be; same-named files are replaced.

    Args:
        result: of `run_scenario`.
        folder: gets index.html (all of it on one page), PNG figures, animation.gif, log.npz, log.csv,
            result.json and scenario.yaml.
        animation: whether to write the animation, which takes longest.

    Returns:
        The files written, index.html first.

    Raises:
        OSError: the folder cannot be written.
    """
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    pictures = list(write_figures(result, target))
    arm = ArmPictures(result)
    write_instants(arm, result, target / "arm.png")
    pictures.append(target / "arm.png")
    if animation:
        write_animation(arm, result, target / "animation.gif")
        pictures.append(target / "animation.gif")
    write_npz(result, target / "log.npz")
    write_csv(result, target / "log.csv")
    (target / "result.json").write_text(
        json.dumps(result.to_document(), indent=2, allow_nan=False) + "\n", encoding="utf-8"
    )
    result.scenario.save(target / "scenario.yaml")
    write_page(result, pictures, target / "index.html")
    data = [target / name for name in ("log.npz", "log.csv", "result.json", "scenario.yaml")]
    return (target / "index.html", *pictures, *data)
