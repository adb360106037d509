"""What an image costs on its way to the controller, stage by stage, beside the recipe of Sidestep 0.2."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from time import perf_counter, thread_time
from typing import Any

import numpy as np

from sidestep._core import Controller, ControllerSettings, Obstacles
from sidestep.arm import Arm
from sidestep.bench import cloud_recipe
from sidestep.bench.camera_room import CameraImages
from sidestep.bench.step import interruptions
from sidestep.perception import Perception, PerceptionReport, PerceptionSettings

STAGES = ("depth", "mask", "map", "unseen", "obstacles", "total")
APART_TIMES = 5  # a round
APART = ("obstacles_build", "set_obstacles")


@dataclass(frozen=True)
class CameraCase:
    """A row: settings of `Perception` that give about so many voxels.

    Attributes:
        name: of the row. voxel, reach_margin, view_margin: see `PerceptionSettings`. unseen_is_free: the same.
    """

    name: str
    voxel: float
    reach_margin: float
    view_margin: float
    unseen_is_free: bool = True

    def settings(self) -> PerceptionSettings:
        return PerceptionSettings(
            voxel=self.voxel,
            reach_margin=self.reach_margin,
            view_margin=self.view_margin,
            unseen_is_free=self.unseen_is_free,
            valid_for=np.inf,
        )


@dataclass
class ImageTimes:
    """Times of images [s], one list a stage, with those of the thread and whether the core was kept.

    Attributes:
        wall: by stage. thread: processor time of the call. kept: no other program had the core meanwhile; empty where
            the system does not tell. voxels: obstacles that were set. remembered: of those, what no camera shows now.
    """

    wall: dict[str, list[float]] = field(default_factory=dict)
    thread: list[float] = field(default_factory=list)
    kept: list[bool] = field(default_factory=list)
    voxels: list[int] = field(default_factory=list)
    remembered: list[int] = field(default_factory=list)

    def add(
        self,
        voxels: int,
        wall: dict[str, float],
        thread: float,
        interrupted: int | None,
        *,
        remembered: int = 0,
    ) -> None:
        """One image."""
        for name, value in wall.items():
            self.wall.setdefault(name, []).append(value)
        self.thread.append(thread)
        self.voxels.append(voxels)
        self.remembered.append(remembered)
        if interrupted is not None:
            self.kept.append(interrupted == 0)

    def to_dict(self) -> dict[str, Any]:
        """Number of images, voxels, and times [ms]: of all, of those whose core was kept, and of the thread."""
        kept = np.array(self.kept, dtype=bool)
        undisturbed = None
        if len(kept) == len(self.thread) and kept.any():
            undisturbed = {name: spread_ms(np.array(values)[kept]) for name, values in self.wall.items()}
        return {
            "images": len(self.thread),
            "voxels": int(np.median(self.voxels)),
            "remembered": int(np.median(self.remembered)),
            "wall_ms": {name: spread_ms(np.array(values)) for name, values in self.wall.items()},
            "undisturbed_images": int(kept.sum()) if len(kept) else None,
            "undisturbed_ms": undisturbed,
            "thread_ms": spread_ms(np.array(self.thread)),
        }


def spread_ms(seconds: np.ndarray[Any, np.dtype[np.float64]]) -> dict[str, float]:
    """p50, p99 and max [ms] of times [s]."""
    p50, p99 = np.percentile(seconds, [50.0, 99.0])
    found = {"p50": p50, "p99": p99, "max": seconds.max()}
    return {name: round(1e3 * float(value), 4) for name, value in found.items()}


def timed(call: Callable[[], Any]) -> tuple[Any, float, float, int | None]:
    """What a call returns, its times on the wall and of the thread [s], and how often the core was taken away."""
    before, thread, start = interruptions(), thread_time(), perf_counter()
    result = call()
    wall, thread = perf_counter() - start, thread_time() - thread
    after = interruptions()
    return result, wall, thread, None if before is None or after is None else after - before


class CameraRow:
    """One case: a controller that does not step, its perception, and the times so far."""

    def __init__(self, case: CameraCase, arm: Arm, images: CameraImages) -> None:
        self._case, self._images = case, images
        self._controller = Controller(
            arm, ControllerSettings(planner=None, look_ahead=None, synchronous=True)
        )
        self._perception = Perception(self._controller, [images.camera], case.settings())
        self._number = 0
        self._times, self._apart = ImageTimes(), ImageTimes()

    def go_through(self, *, count: bool) -> None:
        """Takes every image once, and counts their times or only warms up."""
        for _ in self._images.frames:
            report, thread, interrupted = self._update()
            if count:
                wall = {stage: float(getattr(report, f"{stage}_time")) for stage in STAGES}
                number, old = report.seen + report.remembered, report.remembered
                self._times.add(number, wall, thread, interrupted, remembered=old)
        for _ in range(APART_TIMES if count else 0):
            self._set_apart()

    def _update(self) -> tuple[PerceptionReport, float, int | None]:
        frame = self._images.at(self._number)
        self._number += 1
        report, _, thread, interrupted = timed(
            lambda: self._perception.update(
                frame.camera, frame.depth, time=frame.time, unit=frame.unit, q=frame.q
            )
        )
        assert report.used, report.question
        return report, thread, interrupted

    def _set_apart(self) -> None:
        """Makes obstacles of as many cells and sets them, apart from the rest; `cells` has the background, too."""
        cells = self._perception.cells()
        chosen = np.linspace(0, len(cells["radii"]) - 1, self._times.voxels[-1]).astype(int)
        centres, radii = cells["centres"][chosen], cells["radii"][chosen]
        obstacles, build, thread, first = timed(lambda: Obstacles(centres, radii))
        name = self._images.camera.name
        _, put, more, second = timed(
            lambda: self._controller.set_obstacles(obstacles, name, valid_for=np.inf)
        )
        interrupted = None if first is None or second is None else first + second
        wall = dict(zip(APART, (build, put), strict=True))
        self._apart.add(len(obstacles.points), wall, thread + more, interrupted)

    def to_dict(self) -> dict[str, Any]:
        settings = {
            name: getattr(self._case, name)
            for name in ("voxel", "reach_margin", "view_margin", "unseen_is_free")
        }
        return {"name": self._case.name, **settings, **self._times.to_dict(), "apart": self._apart.to_dict()}


class RecipeRow:
    """The recipe of 0.2 on the same images."""

    name = "recipe of 0.2"

    def __init__(self, arm: Arm, images: CameraImages) -> None:
        self._arm, self._images, self._times = arm, images, ImageTimes()
        self._controller = Controller(
            arm, ControllerSettings(planner=None, look_ahead=None, synchronous=True)
        )
        self._number = 0

    def take(self, images: int, *, count: bool) -> None:
        """Takes the next images; they are seconds each, so not all."""
        for _ in range(images):
            frame = self._images.at(self._number * 7)  # from all over the swing
            self._number += 1
            (balls, stages), wall, thread, interrupted = timed(
                partial(
                    cloud_recipe.update_by_recipe, self._controller, self._arm, self._images.camera, frame
                )
            )
            if count:
                named = dict(zip(cloud_recipe.STAGES, stages, strict=True))
                self._times.add(balls, {**named, "total": wall}, thread, interrupted)

    def to_dict(self) -> dict[str, Any]:
        return {"name": self.name, "voxel": cloud_recipe.VOXEL, **self._times.to_dict()}
