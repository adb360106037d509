"""The report of a recording of depth images as one web page that needs nothing else."""

from __future__ import annotations

import html
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from sidestep.perception import Recording
from sidestep.perception.colours import CELLS, MEANINGS, PIXELS
from sidestep.perception.pictures import DPI, stages_figure
from sidestep.perception.playback import Playback
from sidestep.perception.seen_stages import SeenStages
from sidestep.report.camera_figures import CameraFigures, ImageFigures, by_camera
from sidestep.report.camera_plots import camera_plots
from sidestep.report.page_parts import head, picture, table
from sidestep.report.spread_samples import SpreadSamples
from sidestep.storage.whole_file import write_text


@dataclass(frozen=True, eq=False)
class CameraReport:
    """Figures of a recording by camera, and what some of its images became."""

    name: str
    robot: str
    cameras: dict[str, CameraFigures]
    samples: dict[str, list[SeenStages]]
    skipped: int = 0

    def document(self) -> dict[str, Any]:
        """All figures, for JSON."""
        return {
            "recording": self.name,
            "robot": self.robot or None,
            "images": sum(len(camera.images) for camera in self.cameras.values()),
            "skipped": self.skipped,
            "cameras": [camera.document() for camera in self.cameras.values()],
        }

    def write(self, path: Path) -> None:
        """Writes the page.

        Raises:
            OSError: the file cannot be written.
        """
        document = self.document()
        title = f"{self.name}: {document['images']} depth images"
        parts = [head(title), f"<h1>{html.escape(title)}</h1>", f"<p>{html.escape(self._words())}</p>"]
        parts.append(_table_of_cameras(document["cameras"]))
        for name, figures in self.cameras.items():
            parts.append(f"<h1>{html.escape(name)}</h1>")
            parts += [
                f"<p class='verdict'>{html.escape(q)}: {n} images</p>" for q, n in figures.questions().items()
            ]
            parts += _stage_table(figures)
            parts += [picture(png, caption) for caption, png in camera_plots(figures)]
            samples = self.samples.get(name, [])
            parts += [_legend()] if samples else []
            parts += [picture(_png(stages), _caption(stages, figures)) for stages in samples]
        write_text(path, "\n".join([*parts, "</html>"]))

    def _words(self) -> str:
        if not self.robot:
            return "The images alone: without an arm nothing was taken out of them."
        skipped = (
            f" {self.skipped} images were left out: no joint state at their time." if self.skipped else ""
        )
        return f"Played through perception with the arm {self.robot}.{skipped}"


def report_images(
    recording: Recording, name: str, *, progress: Callable[[int], None] | None = None
) -> CameraReport:
    """The report of the images alone; nothing is taken out of them.

    Args:
        recording: of depth images. name: what the report calls it. progress: told the number of images so far.
    """
    cameras = by_camera(recording.cameras, times_known=recording.times_known)
    for number, frame in enumerate(recording.frames(), start=1):
        cameras[frame.camera].images.append(ImageFigures.of(frame))
        if progress is not None:
            progress(number)
    return CameraReport(name, "", cameras, {})


def report_played(
    playback: Playback, name: str, *, pictures: int = 3, progress: Callable[[int], None] | None = None
) -> CameraReport:
    """The report of a recording that is played through perception.

    Args:
        playback: of the recording. name: what the report calls it.
        pictures: number of images of each camera that are shown stage by stage.
        progress: told the number of images so far.
    """
    recording = playback.recording
    cameras = by_camera(recording.cameras, times_known=recording.times_known)
    samples = {camera: SpreadSamples[SeenStages](pictures) for camera in cameras}
    for number, played in enumerate(playback.play(), start=1):
        camera = played.frame.camera
        cameras[camera].images.append(ImageFigures.of(played.frame, played.report))
        samples[camera].offer(partial(playback.stages, camera))
        if progress is not None:
            progress(number)
    chosen = {camera: kept.chosen() for camera, kept in samples.items()}
    return CameraReport(name, playback.arm.name, cameras, chosen, playback.skipped)


def _table_of_cameras(documents: Sequence[dict[str, Any]]) -> str:
    header = (
        "camera",
        "size [pixel]",
        "images",
        "rate [Hz]",
        "lost",
        "duration [s]",
        "no depth, p50",
        "most",
    )
    rows = []
    for camera in documents:
        holes = camera["holes"]
        rows.append(
            (
                camera["camera"],
                f"{camera['width']} × {camera['height']}",
                str(camera["images"]),
                _known(camera["rate_hz"], "{:.1f}"),
                _known(camera["lost"], "{}"),
                _known(camera["duration_s"], "{:.2f}"),
                _known(holes and 100.0 * holes["p50"], "{:.1f} %"),
                _known(holes and 100.0 * holes["max"], "{:.1f} %"),
            )
        )
    return table(header, rows)


def _stage_table(figures: CameraFigures) -> list[str]:
    """Times of the stages and what was counted; nothing where no image was played."""
    if not figures.reports:
        return []
    document = figures.document()
    rows = [
        (f"time, {name}", *(f"{1000.0 * times[key]:.2f} ms" for key in ("p50", "p99", "max")))
        for name, times in document["stages_s"].items()
    ]
    for name, words, factor, form in (
        ("arm_pixels", "pixels of the arm", 1.0, "{:,.0f}"),
        ("edge_pixels", "flying pixels", 1.0, "{:,.0f}"),
        ("through_share", "rays through where the arm should be", 100.0, "{:.2f} %"),
        ("depth_error_m", "depth error on the arm", 1000.0, "{:.1f} mm"),
        ("seen", "cells seen now", 1.0, "{:,.0f}"),
        ("remembered", "cells remembered", 1.0, "{:,.0f}"),
    ):
        values = document[name]
        if values is not None:
            rows.append((words, *(form.format(factor * values[key]) for key in ("p50", "p99", "max"))))
    return [table(("", "p50", "p99", "most"), rows)]


def _caption(stages: SeenStages, figures: CameraFigures) -> str:
    times = [image.time for image in figures.images]
    number = times.index(stages.time)
    when = f", {stages.time - times[0]:.3f} s after the first" if figures.times_known else ""
    return f"Image {number + 1} of {len(times)}{when}"


def _known(value: Any, form: str) -> str:
    return "not known" if value is None else form.format(value)


def _legend() -> str:
    """The colours of the pictures and what they mean."""
    box = "<span style='display:inline-block;width:.8em;height:.8em;border:1px solid #888;background:{}'></span> {}"
    shown = {name: colour for name, colour in (PIXELS | CELLS).items() if name != "moving"}
    return "<p>" + " &nbsp; ".join(box.format(c, html.escape(MEANINGS[n])) for n, c in shown.items()) + "</p>"


def _png(stages: SeenStages) -> bytes:
    stream = io.BytesIO()
    stages_figure(stages).savefig(stream, format="png", dpi=DPI)
    return stream.getvalue()
