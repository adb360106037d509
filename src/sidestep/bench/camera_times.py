"""From a depth image to obstacles: what each stage costs, what is lost at 30 to 90 Hz, and the loop beside it."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import sidestep
from sidestep._core import instruction_set
from sidestep.arm import Arm
from sidestep.bench.camera_beside import LOADS, BesideRow, divided_cores
from sidestep.bench.camera_room import HEIGHT, WIDTH, CameraImages, render_images
from sidestep.bench.camera_stages import CameraCase, CameraRow, RecipeRow
from sidestep.bench.step import cpu_model, held_up
from sidestep.perception import PerceptionSettings

USUAL = {name: getattr(PerceptionSettings(), name) for name in ("voxel", "reach_margin", "view_margin")}
CASES = (
    CameraCase("2k", voxel=0.06, reach_margin=0.0, view_margin=0.1),
    CameraCase("10k", voxel=0.03, reach_margin=0.25, view_margin=0.25),
    CameraCase("20k", voxel=0.02, reach_margin=0.25, view_margin=0.25),
    CameraCase("default", **USUAL),
    CameraCase("default, unseen closed", **USUAL, unseen_is_free=False),
)
BESIDE = ("10k", "default")  # cases of the rows beside the loop
RECIPE_IMAGES = 2  # a round
IDLE = 2.0  # [s] of the loop that only reads the clock


@dataclass(frozen=True)
class CameraTimesSettings:
    """What is measured, and how long.

    Attributes:
        robot: a name. images: of a swing of the arm, gone through once a round. width, height: of an image [pixel].
        rounds: in which rows take turns, after one to warm up. seconds: of each loop in each round [s]; 0: none.
        seed: of noise, and planner.

    Raises:
        ValueError: a number out of range.
    """

    robot: str = "fr3"
    images: int = 60
    width: int = WIDTH
    height: int = HEIGHT
    rounds: int = 5
    seconds: float = 5.0
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("images", "width", "height", "rounds"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} is {getattr(self, name)}, must be at least 1")
        if not (np.isfinite(self.seconds) and self.seconds >= 0.0):
            raise ValueError(f"seconds is {self.seconds}, must be 0 or more, and finite")


def run_camera_times(
    settings: CameraTimesSettings, *, progress: Callable[[int, int, str], None] | None = None
) -> dict[str, Any]:
    """Times images of a room with a moving arm, and returns a document for JSON.

    Images are rendered once, with the noise of a D435, and kept. Rows take turns in each round: `Perception.update`
    stage by stage with settings for about 2,000, 10,000 and 20,000 voxels, and as they are without settings, with
    unseen space free and closed; then some images by the recipe of 0.2. Ratios are of medians of processor time.

    The loop of 1 kHz runs with the controller's default settings, planner and all, and goes to and fro; a thread beside
    it takes the images of one camera at 30, 60 and 90 Hz and of three at 30 Hz. An image is lost if a newer one
    replaces it before it is taken, or if its obstacles are set later than a period after it came. With two cores or
    more perception has the last one, which no thread of the controller uses. `frames_on_a_free_core` says what
    processor times alone would lose: on a machine that others use, images wait for the core.
    """
    arm = Arm.load(settings.robot)
    tell = progress or (lambda done, in_all, word: None)
    in_all = 2 * settings.rounds + 2
    tell(0, in_all, "images")
    images = render_images(
        arm, images=settings.images, width=settings.width, height=settings.height, seed=settings.seed
    )
    load_before = _load()
    stages = _stages(settings, arm, images[0], lambda k: tell(1 + k, in_all, "stages"))
    beside = _beside(
        settings, arm, images, lambda k: tell(2 + settings.rounds + k, in_all, "beside the loop")
    )
    _, own = divided_cores()
    return {
        "benchmark": "camera times",
        "version": sidestep.__version__,
        "cpu": cpu_model(),
        "cores": os.cpu_count(),
        "instruction_set": instruction_set(),
        "python": platform.python_version(),
        "robot": settings.robot,
        "ellipsoids": len(arm.body.links),
        "image": [settings.width, settings.height],
        "rounds": settings.rounds,
        "load": {"before": load_before, "after": _load()},
        "idle": held_up(IDLE if settings.seconds > 0.0 else 0.01),
        "perception_has_a_core": own is not None,
        "stages": stages,
        "beside": beside,
    }


def ratios(rows: list[dict[str, Any]]) -> dict[str, float]:
    """Median processor time of the last row, the recipe, over that of each other row."""
    *cases, recipe = rows
    return {row["name"]: recipe["thread_ms"]["p50"] / row["thread_ms"]["p50"] for row in cases}


def _stages(
    settings: CameraTimesSettings, arm: Arm, images: CameraImages, tell: Callable[[int], None]
) -> dict[str, Any]:
    rows = [CameraRow(case, arm, images) for case in CASES]
    recipe = RecipeRow(arm, images)
    for k in range(settings.rounds + 1):
        tell(k)
        for row in rows:
            row.go_through(count=k > 0)
        recipe.take(RECIPE_IMAGES if k > 0 else 1, count=k > 0)
    results = [*(row.to_dict() for row in rows), recipe.to_dict()]
    return {"results": results, "recipe_over": ratios(results)}


def _beside(
    settings: CameraTimesSettings, arm: Arm, images: list[CameraImages], tell: Callable[[int], None]
) -> list[dict[str, Any]]:
    if settings.seconds == 0.0:
        return []
    rows = [
        BesideRow(load, arm, case, images, settings.seed)
        for case in CASES
        if case.name in BESIDE
        for load in LOADS
    ]
    for k in range(settings.rounds):
        tell(k)
        for row in rows:
            row.run(settings.seconds)
    return [row.to_dict() for row in rows]


def _load() -> list[float] | None:
    return [round(x, 2) for x in os.getloadavg()] if hasattr(os, "getloadavg") else None
