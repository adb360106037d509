"""The arm over time: a strip of instants (PNG) and an animation (GIF)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from sidestep.drawing import ArmViews
from sidestep.scenario.result import ScenarioResult
from sidestep.simulation.joint_words import in_words, largest_ways

VIEW_SIZE = (400, 360)  # [pixel]
CAPTION_HEIGHT = 24  # [pixel]
NUM_INSTANTS = 6
FRAMES_PER_SECOND = 12
MAX_FRAMES = 120  # keeps the file below 3 MB; a longer run is shown faster


class ArmPictures:
    """Draws the arm and the obstacles of a run at any of its samples, from fixed sides."""

    def __init__(self, result: ScenarioResult) -> None:
        run = result.run
        self._run = run
        self._views = ArmViews(
            run.robot,
            run.q,
            goal=run.goal,
            goal_point=None if run.pose is None else run.pose.goal.pose[:3, 3],
            objects=run.objects,
            object_poses=run.object_poses,
            size=VIEW_SIZE,
        )
        self.num_views = len(self._views.views)

    def picture(self, sample: int) -> Image.Image:
        """All views of one sample side by side, with the time and the path of the tip so far."""
        views = Image.fromarray(self._views.picture(sample))
        picture = Image.new("RGB", (views.width, views.height + CAPTION_HEIGHT), "white")
        picture.paste(views, (0, CAPTION_HEIGHT))
        run, q = self._run, self._run.q[sample]
        left = in_words(*largest_ways(run.robot, q - run.goal), radians=".2f", millimetres=".0f")
        error = f"largest joint error {left}"
        if run.pose is not None:
            error = f"{1e3 * run.pose.errors(q)[0]:.0f} mm from the goal"
        caption = f"t = {run.time[sample]:5.2f} s    {error}"
        font = ImageFont.load_default(size=14)
        ImageDraw.Draw(picture).text((8, 3), caption, fill=(30, 30, 30), font=font)
        return picture


def write_instants(pictures: ArmPictures, result: ScenarioResult, path: Path) -> None:
    """The arm at several instants, evenly spaced over the path of the joints, as one PNG."""
    run = result.run
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(run.q, axis=0), axis=1))])
    marks = np.linspace(0.0, travelled[-1], NUM_INSTANTS)
    samples = np.searchsorted(travelled, marks - 1e-12).clip(0, len(run.time) - 1)
    views = [pictures.picture(int(sample)) for sample in samples]
    columns = 2 if pictures.num_views > 1 else 3
    rows = -(-len(views) // columns)
    sheet = Image.new("RGB", (columns * views[0].width, rows * views[0].height), (255, 255, 255))
    for index, view in enumerate(views):
        sheet.paste(view, ((index % columns) * view.width, (index // columns) * view.height))
    sheet.save(path, optimize=True)


def write_animation(pictures: ArmPictures, result: ScenarioResult, path: Path) -> None:
    """The run as a GIF, in real time where that takes at most MAX_FRAMES frames, then a pause."""
    time = result.run.time
    count = int(np.clip(FRAMES_PER_SECOND * (time[-1] - time[0]), 2, MAX_FRAMES))
    samples = np.searchsorted(time, np.linspace(time[0], time[-1], count)).clip(0, len(time) - 1)
    frames = [pictures.picture(int(sample)) for sample in samples]
    palette = frames[0].quantize(colors=64)
    images = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    durations = [1000 // FRAMES_PER_SECOND] * (len(images) - 1) + [1500]
    images[0].save(path, save_all=True, append_images=images[1:], duration=durations, loop=0, optimize=True)
