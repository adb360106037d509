"""The arm over time: a strip of instants (PNG) and an animation (GIF)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from sidestep import Robot
from sidestep.report.drawing import ARM, GOAL, OBSTACLE, PATH, Camera, look_at, paint
from sidestep.scenario.result import ScenarioResult
from sidestep.simulation.pose import pose_matrix

Array = npt.NDArray[np.float64]

VIEW_SIZE = (400, 360)  # [pixel]
NUM_INSTANTS = 6
FRAMES_PER_SECOND = 12
MAX_FRAMES = 120  # keeps the file below 3 MB; a longer run is shown faster
PATH_STRIDE = 20  # samples from one corner of the drawn path to the next
CROSS = 0.03  # [m] half the width of the cross at the goal of the tip


class ArmPictures:
    """Draws the arm and the obstacles of a run at any of its samples, from fixed sides."""

    def __init__(self, result: ScenarioResult) -> None:
        self._result = result
        robot = result.run.robot
        meshes = {link.name: robot.collision_mesh(link.name) for link in robot.links}
        self._links = {name: np.asarray(m.triangles) for name, m in meshes.items() if m is not None}
        self._obstacles = [np.asarray(item.surface(subdivisions=2).triangles) for item in result.run.objects]
        self._tip = robot.links[-1].name
        samples = np.linspace(0, len(result.run.time) - 1, 40).astype(int)
        self._path = np.array([self._tip_position(q) for q in result.run.q])
        clouds = [self._path]
        for q in (*result.run.q[samples], result.run.goal):
            clouds += [t.reshape(-1, 3) for t in self._arm(q)]
        for sample in samples[[0, len(samples) // 2, -1]]:
            clouds += [t.reshape(-1, 3) for t in self._solids(sample)]
        points = np.concatenate(clouds)
        axes = [frame_axis(robot, joint) for joint in range(len(robot.joints))]
        flat = all(abs(abs(axis[2]) - 1.0) < 1e-9 for axis in axes)
        self.cameras = look_at(points, flat=flat, size=VIEW_SIZE)

    def picture(self, sample: int) -> Image.Image:
        """All views of one sample side by side, with the time and the path of the tip so far."""
        views = [self._view(camera, sample) for camera in self.cameras]
        width = sum(view.width for view in views)
        picture = Image.new("RGB", (width, views[0].height + 24), (255, 255, 255))
        for index, view in enumerate(views):
            picture.paste(view, (index * view.width, 24))
        ImageDraw.Draw(picture).text((8, 3), self._caption(sample), fill=(30, 30, 30), font=_font())
        return picture

    def _caption(self, sample: int) -> str:
        run = self._result.run
        error = float(np.abs(run.q[sample] - run.goal).max())
        return f"t = {run.time[sample]:5.2f} s    largest joint error {error:.2f} rad"

    def _view(self, camera: Camera, sample: int) -> Image.Image:
        q = self._result.run.q[sample]
        surfaces = [(t, ARM) for t in self._arm(q)] + [(t, OBSTACLE) for t in self._solids(sample)]
        tip = self._tip_position(self._result.run.goal)
        cross = [(tip + np.array([[-CROSS], [CROSS]]) * axis, GOAL) for axis in camera.axes[:2]]
        path = np.vstack([self._path[: sample + 1 : PATH_STRIDE], self._path[sample]])
        return paint(camera, surfaces, lines=[*cross, (path, PATH)])

    def _arm(self, q: Array) -> list[Array]:
        return [moved(t, self._result.run.robot.pose(q, name)) for name, t in self._links.items()]

    def _solids(self, sample: int) -> list[Array]:
        poses = self._result.run.object_poses[sample]
        return [moved(t, pose_matrix(pose)) for t, pose in zip(self._obstacles, poses, strict=True)]

    def _tip_position(self, q: Array) -> Array:
        return np.asarray(self._result.run.robot.pose(q, self._tip)[:3, 3])


def frame_axis(robot: Robot, joint: int) -> Array:
    """Direction (3,) of a joint's axis in the world at zero configuration."""
    rotation, index = np.eye(3), joint
    axis = robot.joints[joint].axis
    while index >= 0:
        item = robot.joints[index]
        rotation = item.placement[:3, :3] @ rotation
        index = item.parent
    return np.asarray(rotation @ axis)


def moved(triangles: Array, pose: Array) -> Array:
    """Triangles (F, 3, 3) of a frame at `pose` (4, 4), in the world."""
    return np.asarray(triangles @ pose[:3, :3].T + pose[:3, 3])


def write_instants(pictures: ArmPictures, result: ScenarioResult, path: Path) -> None:
    """The arm at several instants, evenly spaced over the path of the joints, as one PNG."""
    run = result.run
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(run.q, axis=0), axis=1))])
    marks = np.linspace(0.0, travelled[-1], NUM_INSTANTS)
    samples = np.searchsorted(travelled, marks - 1e-12).clip(0, len(run.time) - 1)
    views = [pictures.picture(int(sample)) for sample in samples]
    columns = 2 if len(pictures.cameras) > 1 else 3
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


def _font() -> ImageFont.ImageFont | ImageFont.FreeTypeFont:
    return ImageFont.load_default(size=14)
