"""Lines and ellipsoids that explain the motion: the nearest line, the trail of the tip, the metric."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import trimesh

from sidestep.distance.clearance import Clearance
from sidestep.math.pose import pose_vector
from sidestep.robot import Robot
from sidestep.studio.page import colours
from sidestep.studio.page.arm import reach

if TYPE_CHECKING:
    import viser

Array = npt.NDArray[np.float64]

LONGEST_LINE = 1.0  # [m] nearest line that is drawn: nothing farther off matters to the arm
TRAIL_POINTS = 150
TRAIL_STEP = 0.01  # [m] of the tip between two points
GAP = 0.3  # [s] between two states, ten frames: how the arm moved between them is not known, and no line is drawn
METRIC_SIZE = (
    0.25  # of the reach: half axis of the metric's ellipsoid where the tip moves as freely as in flat space
)
THINNEST = 0.05  # of the longest half axis: what can still be seen


class Marks:
    """The nearest line, the trail and the metric of one arm."""

    def __init__(self, server: viser.ViserServer, robot: Robot, tip: str) -> None:
        self._robot, self._tip = robot, tip
        self._trail_points: deque[Array] = deque(maxlen=TRAIL_POINTS)  # NaN between two that are not joined
        self._last = np.nan  # [s] time of the last state of the trail
        none = self._lines = np.zeros((1, 2, 3), dtype=np.float32)
        self.nearest = server.scene.add_line_segments(
            "/marks/nearest",
            none,
            colours.rgb(colours.NEAR),
            thickness=4.0,
            thickness_units="screen",
            visible=False,
        )
        self.trail = server.scene.add_line_segments(
            "/marks/trail", none, colours.rgb(colours.TRAIL), thickness=3.0, thickness_units="screen"
        )
        unit = trimesh.creation.icosphere(subdivisions=3)
        self.metric = server.scene.add_mesh_simple(
            "/marks/metric",
            unit.vertices.astype(np.float32),
            unit.faces.astype(np.uint32),
            color=colours.rgb(colours.METRIC),
            opacity=0.7,
            cast_shadow=False,
            receive_shadow=False,
            visible=False,
        )

    def show_nearest(self, found: tuple[Clearance, ...], *, visible: bool) -> None:
        """The line between the closest points of the arm and the scene; `found` nearest first."""
        self.nearest.visible = visible and bool(found) and found[0].distance < LONGEST_LINE
        if self.nearest.visible:
            ends = np.array([[found[0].point_on_link, found[0].point_on_obstacle]])
            self.nearest.points = ends.astype(np.float32)

    def show_trail(self, q: Array, time: float, *, visible: bool) -> None:
        """Adds where the tip is at q (nv,) and a time [s]."""
        here = self._robot.pose(q, self._tip)[:3, 3]
        points = self._trail_points
        if not points or np.linalg.norm(here - points[-1]) > TRAIL_STEP:
            if points and not time - self._last <= GAP:
                points.append(np.full(3, np.nan))
            points.append(here)
        self._last = time
        self._draw_trail(visible)

    def _draw_trail(self, visible: bool) -> None:
        lines = segments(np.array(self._trail_points).reshape(-1, 3))
        if len(lines) and not np.array_equal(lines, self._lines):
            self.trail.points = self._lines = lines
        self.trail.visible = visible and len(lines) > 0

    def show_way(self, way: Sequence[Array], *, visible: bool) -> None:
        """In place of the trail: where the tip is at some of many configurations (nv,), in their order."""
        some = np.unique(np.linspace(0, len(way) - 1, TRAIL_POINTS).astype(int))
        self.clear_trail()
        self._last = np.nan
        self._trail_points.extend(self._robot.pose(way[k], self._tip)[:3, 3] for k in some)
        self._draw_trail(visible)

    def clear_trail(self) -> None:
        """Forgets where the tip has been."""
        self._trail_points.clear()
        self.trail.visible = False

    def show_metric(self, q: Array, metric: Array, *, visible: bool) -> None:
        """The velocities of the tip that a joint velocity of metric length 1 gives: J G^-1 J^T, scaled so that
        the longest half axis in flat space (G = 1) is `METRIC_SIZE` of the reach."""
        self.metric.visible = visible
        if visible:
            pose, half_axes = metric_ellipsoid(self._robot, self._tip, q, metric)
            vector = pose_vector(pose)
            self.metric.position, self.metric.wxyz = vector[:3], vector[3:]
            x, y, z = (float(axis) for axis in half_axes)
            self.metric.scale = (x, y, z)

    def remove(self) -> None:
        for mark in (self.nearest, self.trail, self.metric):
            mark.remove()


def segments(points: Array) -> npt.NDArray[np.float32]:
    """Lines (n, 2, 3) from each point (m, 3) to the next, none from or to a point of NaN."""
    lines = np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)
    return lines[np.isfinite(lines).all(axis=(1, 2))]


def metric_ellipsoid(robot: Robot, tip: str, q: Array, metric: Array) -> tuple[Array, Array]:
    """Pose (4, 4) and half axes (3,) [m] of the ellipsoid at the tip, see `Marks.show_metric`."""
    J = robot.jacobian(q, tip)[:3]
    flat, size = float(np.linalg.norm(J, 2)), METRIC_SIZE * reach(robot)
    values, axes = np.linalg.eigh(J @ np.linalg.solve(metric, J.T))
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = axes, robot.pose(q, tip)[:3, 3]
    lengths = np.sqrt(np.maximum(values, 0.0)) * (size / flat if flat > 0.0 else 0.0)
    return pose, np.maximum(lengths, THINNEST * size)
