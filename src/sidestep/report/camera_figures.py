"""Figures of a recording of depth images: rates, holes, times of the stages, the arm, the cells."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import PerceptionReport
from sidestep.perception import CameraRecord, Frame

Array = npt.NDArray[np.float64]

STAGES = ("depth", "mask", "map", "unseen", "obstacles", "total")  # those of `PerceptionReport`
LATE = 1.5  # periods after the one before: an image between them is lost


@dataclass(frozen=True, eq=False)
class ImageFigures:
    """An image of a recording: time [s], share of pixels without depth, and what became of it; None: not played."""

    time: float
    holes: float
    report: PerceptionReport | None = None

    @classmethod
    def of(cls, frame: Frame, report: PerceptionReport | None = None) -> ImageFigures:
        """Counts the holes of a frame."""
        depth = frame.depth
        shown = depth > 0 if depth.dtype.kind == "u" else np.isfinite(depth) & (depth > 0.0)
        return cls(frame.time, 1.0 - float(np.count_nonzero(shown)) / depth.size, report)


class CameraFigures:
    """The images of one camera of a recording, in order, and what they add up to."""

    def __init__(self, camera: CameraRecord, *, times_known: bool) -> None:
        self.camera, self.times_known = camera, times_known
        self.images: list[ImageFigures] = []

    @property
    def times(self) -> Array:
        """Capture times [s] (N,), from the first image on."""
        times = np.array([image.time for image in self.images])
        return times - times[:1] if len(times) else times

    @property
    def period(self) -> float:
        """Median time between two images [s]; nan where the source has no times, or fewer than two images."""
        known = self.times_known and len(self.images) > 1
        return float(np.median(np.diff(self.times))) if known else math.nan

    @property
    def lost(self) -> int | None:
        """Number of images that are missing between others, by the period; None where nobody knows."""
        period = self.period
        if not period > 0.0:
            return None
        gaps = np.diff(self.times) / period
        return int(np.sum(np.round(gaps[gaps > LATE]) - 1))

    @property
    def reports(self) -> list[PerceptionReport]:
        """Of the images that were played."""
        return [image.report for image in self.images if image.report is not None]

    def series(self, value: Callable[[PerceptionReport], float]) -> Array:
        """A figure of each played image (N,)."""
        return np.array([value(report) for report in self.reports], dtype=np.float64)

    def stage_times(self) -> dict[str, Array]:
        """Times of the stages of each played image [s], by name."""
        return {name: self.series(attrgetter(f"{name}_time")) for name in STAGES}

    def questions(self) -> dict[str, int]:
        """What was hard to believe, in words, and in how many images."""
        found: dict[str, int] = {}
        for report in self.reports:
            if report.question:
                found[report.question] = found.get(report.question, 0) + 1
        return found

    def document(self) -> dict[str, Any]:
        """All figures, for JSON; null where nobody knows."""
        holes = np.array([image.holes for image in self.images])
        period = self.period
        result: dict[str, Any] = {
            "camera": self.camera.name,
            "width": self.camera.width,
            "height": self.camera.height,
            "images": len(self.images),
            "duration_s": float(self.times[-1]) if self.times_known and len(self.images) else None,
            "rate_hz": 1.0 / period if period > 0.0 else None,
            "lost": self.lost,
            "holes": spread(holes),
        }
        if self.reports:
            result["used"] = sum(report.used for report in self.reports)
            result["stages_s"] = {name: spread(times) for name, times in self.stage_times().items()}
            result["arm_pixels"] = spread(self.series(lambda r: r.arm_pixels))
            result["edge_pixels"] = spread(self.series(lambda r: r.edge_pixels))
            result["through_share"] = spread(self.series(lambda r: r.arm.through_share))
            result["depth_error_m"] = spread(
                np.array([r.arm.depth_error for r in self.reports if r.arm.on_arm])
            )
            result["seen"] = spread(self.series(lambda r: r.seen))
            result["remembered"] = spread(self.series(lambda r: r.remembered))
            result["questions"] = self.questions()
        return result


def spread(values: Array) -> dict[str, float] | None:
    """Median, 99th percentile and largest of values; None where there are none."""
    if not len(values):
        return None
    p50, p99 = np.percentile(values, [50, 99])
    return {"p50": float(p50), "p99": float(p99), "max": float(values.max())}


def by_camera(cameras: Sequence[CameraRecord], *, times_known: bool) -> dict[str, CameraFigures]:
    """Empty figures for each camera, by name."""
    return {camera.name: CameraFigures(camera, times_known=times_known) for camera in cameras}
