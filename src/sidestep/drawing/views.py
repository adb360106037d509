"""A moving arm seen from fixed sides."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.proj3d import proj_transform

from sidestep._core import JointType
from sidestep.drawing.arm import Array, Solid, arm_triangles, direction, draw_arm, show_arm, solid_triangles
from sidestep.drawing.palette import BLUE, GREEN
from sidestep.math.pose import moved, pose_matrix
from sidestep.robot import Robot

DPI = 100
FILLED = 0.94  # share of a picture that what must be seen fills
SAMPLES_TO_FIT = 40  # configurations of the motion that must be in the picture
SAMPLES_TO_SEE = 12  # configurations of the motion that are to be seen from the side
TRACE_POINTS = 400  # of the line that the tip draws
THERE = 0.02  # [rad | m] from the goal the ghost is left out
GRID = 0.2  # [m] of the ground
SIDES = tuple((22.0, azimuth) for azimuth in (-35.0, -145.0, 35.0, 145.0))  # elevation and azimuth [deg]
BETTER = 0.05  # share of hidden points by which another side than the first has to be better
ABOVE = (90.0, -90.0)  # x to the right, y up


class ArmViews:
    """Pictures of a motion, sample by sample: a planar arm from above, another from the side and from above.

    Args:
        robot: the arm.
        q: (T, nv) the motion.
        goal: (nv,), drawn as a ghost; its tip position is marked by a cross, or goal_point (3,) [m].
        objects: the solids around; object_poses: (T, num_objects, 7), or None: where they stand.
        size: width and height of one view [pixel].
    """

    def __init__(
        self,
        robot: Robot,
        q: Array,
        *,
        goal: Array,
        goal_point: Array | None = None,
        objects: Sequence[Solid] = (),
        object_poses: Array | None = None,
        size: tuple[int, int] = (400, 360),
    ) -> None:
        tip = robot.frames[-1].name
        self._traced = np.unique(np.linspace(0, len(q) - 1, TRACE_POINTS).round().astype(int))
        trace = np.array([robot.pose(q[k], tip)[:3, 3] for k in self._traced])
        goal_tip = np.asarray(robot.pose(goal, tip)[:3, 3] if goal_point is None else goal_point)
        self._ghost = np.asarray(goal, dtype=float)
        self._robot, self._q, self._objects, self._poses = robot, q, objects, object_poses
        seen = np.concatenate([trace, goal_tip[None], self._reached(goal)])
        planar = is_planar(robot)
        self.views = (ABOVE,) if planar else (self._clear_side(), ABOVE)
        self._drawn = [
            _View(angles, seen, trace, goal_tip, ground=angles != ABOVE, size=size) for angles in self.views
        ]
        for view in self._drawn:
            view.arm = draw_arm(view.ax, robot, q[0], ghost=self._ghost)
            view.arm.set_zorder(2)

    def picture(self, sample: int) -> npt.NDArray[np.uint8]:
        """All views of one sample side by side, with the path of the tip so far: RGB (height, width, 3)."""
        poses = None if self._poses is None else self._poses[sample]
        images = []
        for view in self._drawn:
            q = self._q[sample]
            ghost = None if np.allclose(q, self._ghost, atol=THERE) else self._ghost
            show_arm(view.arm, self._robot, q, objects=self._objects, object_poses=poses, ghost=ghost)
            images.append(view.image(int(np.searchsorted(self._traced, sample, side="right"))))
        return np.hstack(images)

    def _clear_side(self) -> tuple[float, float]:
        """The side from which solids hide least of the moving frames; the first one where it does as well."""
        samples = np.unique(np.linspace(0, len(self._q) - 1, SAMPLES_TO_SEE).astype(int))
        frames = [frame.name for frame in self._robot.frames if frame.joint >= 0]
        points = np.array([self._robot.pose(self._q[k], name)[:3, 3] for k in samples for name in frames])
        solids = [np.zeros((0, 3, 3))]
        for i, item in enumerate(self._objects):
            pose = item.pose if self._poses is None else pose_matrix(self._poses[0, i])
            solids.append(moved(np.array(item.surface().triangles, dtype=float), pose))
        triangles = np.concatenate(solids)
        shares = [float(hidden(points, triangles, direction(*side)).mean()) for side in SIDES]
        best = int(np.argmin(shares))
        return SIDES[best] if shares[best] < shares[0] - BETTER else SIDES[0]

    def _reached(self, goal: Array) -> Array:
        """Points (N, 3) that the arm and the solids reach, world [m]; the solids at start, middle and end."""
        samples = np.unique(np.linspace(0, len(self._q) - 1, SAMPLES_TO_FIT).astype(int))
        clouds = [
            moved(_corners(shape), self._robot.pose(q, link))
            for link, _, shape in arm_triangles(self._robot)
            for q in (*self._q[samples], goal)
        ]
        for i, item in enumerate(self._objects):
            for sample in samples[[0, len(samples) // 2, -1]]:
                pose = item.pose if self._poses is None else pose_matrix(self._poses[sample, i])
                clouds.append(moved(_corners(solid_triangles(item)), pose))
        return np.concatenate(clouds) if clouds else np.zeros((0, 3))


class _View:
    """One canvas: the axes, and what changes on it from sample to sample."""

    arm: Any

    def __init__(
        self,
        angles: tuple[float, float],
        seen: Array,
        trace: Array,
        goal_tip: Array,
        *,
        ground: bool,
        size: tuple[int, int],
    ) -> None:
        width, height = size
        figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI)
        self._canvas: Any = FigureCanvasAgg(figure)
        side = max(size)  # 3D axes are square and clip: a square that covers the picture
        place = ((1.0 - side / width) / 2, (1.0 - side / height) / 2, side / width, side / height)
        axes: Any = figure.add_axes(place, projection="3d", computed_zorder=False)
        self.ax = axes
        self.ax.set_axis_off()
        self.ax.set_proj_type("ortho")
        self.ax.view_init(elev=angles[0], azim=angles[1])
        fit_view(self.ax, seen, size=size)
        if ground:
            _draw_ground(self.ax, seen)
        self.ax.plot(*goal_tip[:, None], marker="+", color=GREEN, markersize=13, markeredgewidth=2, zorder=3)
        line: Any
        (line,) = self.ax.plot(*trace[:1].T, color=BLUE, linewidth=1.6, zorder=3)
        self._trace, self._line = trace, line

    def image(self, num_traced: int) -> npt.NDArray[np.uint8]:
        self._line.set_data_3d(*self._trace[:num_traced].T)
        self._canvas.draw()
        return np.asarray(self._canvas.buffer_rgba())[..., :3].copy()


def fit_view(ax: Any, points: Array, *, size: tuple[int, int]) -> None:
    """Centres an orthographic 3D axes on points (N, 3) [m] and lets them fill a picture of `size` pixels."""
    elevation, azimuth = np.deg2rad(ax.elev), np.deg2rad(ax.azim)
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    towards = np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )
    axes = np.stack([right, np.cross(towards, right), towards])
    along = points @ axes.T
    middle = 0.5 * (along.min(axis=0) + along.max(axis=0)) @ axes
    reach = max(float(np.ptp(along, axis=0).max()), 1e-3)  # [m] even a single point gets a picture

    def show(zoom: float) -> Array:
        """Pixel bounds (2, 2) of the points, lowest and highest x and y, with `middle` in the centre."""
        for name, centre in zip("xyz", middle, strict=True):
            ax.set(**{f"{name}lim": (centre - 0.5 * reach, centre + 0.5 * reach)})
        ax.set_box_aspect((1.0, 1.0, 1.0), zoom=zoom)
        ax.apply_aspect()
        x, y, _ = proj_transform(*points.T, ax.get_proj())
        pixels = ax.transData.transform(np.column_stack([x, y]))
        return np.array([pixels.min(axis=0), pixels.max(axis=0)])

    extent = np.maximum(np.ptp(show(1.0), axis=0), 1e-9)
    zoom = FILLED * float(np.min(np.array(size) / extent))
    scale = zoom * float(extent.max()) / max(float(np.ptp(along[:, :2], axis=0).max()), 1e-9)  # [pixel/m]
    box = ax.get_window_extent()  # Matplotlib sets the centre of a 3D axes a little off the middle of its box
    off = show(zoom).mean(axis=0) - [0.5 * (box.x0 + box.x1), 0.5 * (box.y0 + box.y1)]
    middle = middle + (off / scale) @ axes[:2]
    show(zoom)


def hidden(points: Array, triangles: Array, towards: Array) -> npt.NDArray[np.bool_]:
    """Which points (N, 3) have a triangle (F, 3, 3) between them and a viewer in a direction (3,) far away.

    Source: Möller and Trumbore (1997).
    """
    edge1, edge2 = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    across = np.cross(towards, edge2)
    volume = (edge1 * across).sum(axis=1)
    inverse = 1.0 / np.where(np.abs(volume) < 1e-12, np.inf, volume)
    found = np.zeros(len(points), dtype=bool)
    for k, point in enumerate(points):
        offset = point - triangles[:, 0]
        u = (offset * across).sum(axis=1) * inverse
        normal = np.cross(offset, edge1)
        v, along = normal @ towards * inverse, (edge2 * normal).sum(axis=1) * inverse
        found[k] = bool(((inverse != 0.0) & (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (along > 0.0)).any())
    return found


def is_planar(robot: Robot) -> bool:
    """Whether every joint turns about an axis parallel to the world's z at every configuration."""
    upright = np.array([0.0, 0.0, 1.0])
    axes = []
    for joint in robot.joints:
        axis, item = joint.placement[:3, :3] @ joint.axis, joint
        while item.parent >= 0:
            item = robot.joints[item.parent]
            axis = item.placement[:3, :3] @ axis
        axes.append(axis)
    turning = all(joint.type == JointType.revolute for joint in robot.joints)
    return turning and bool(np.allclose(np.abs(np.array(axes) @ upright), 1.0, atol=1e-9))


def _corners(triangles: Array) -> Array:
    """The corners (F, 3) of triangles (F, 3, 3), one of each triangle: they spread over the whole surface."""
    return triangles[:, 0]


def _draw_ground(ax: Any, seen: Array) -> None:
    """A grid under the arm, as wide as what is seen."""
    low, high = seen.min(axis=0), seen.max(axis=0)
    height = min(low[2], 0.0)
    xs, ys = (np.arange(np.floor(low[k] / GRID), np.ceil(high[k] / GRID) + 1) * GRID for k in (0, 1))
    for x in xs:
        ax.plot([x, x], [ys[0], ys[-1]], [height, height], color="0.86", linewidth=0.7, zorder=0)
    for y in ys:
        ax.plot([xs[0], xs[-1]], [y, y], [height, height], color="0.86", linewidth=0.7, zorder=0)
