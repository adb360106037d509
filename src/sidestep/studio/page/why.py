"""Why the arm moves as it does, in the scene: its path, the attraction of its tip, the limiting point."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from sidestep.robot import Robot
from sidestep.studio.page import colours
from sidestep.studio.page.arm import reach
from sidestep.studio.page.marks import segments
from sidestep.studio.reason import Reason

if TYPE_CHECKING:
    import viser

Array = npt.NDArray[np.float64]

PATH_STEP = 0.08  # [rad | m] of the farthest joint between two points of the ribbon
PATH_POINTS = 160  # at most
PULL_LENGTH = 0.3  # of the reach: the longest arrow
HALF_PULL = 6.0  # [m/s^2] of the tip at which the arrow has half of that length
LEAST_PULL = 0.15  # [m/s^2] below which no arrow is drawn
LEAST_RADIUS = 0.012  # [m] of the lit point: what can be seen


class Why:
    """Ribbon, arrow and lit point of one arm."""

    def __init__(self, server: viser.ViserServer, robot: Robot, tip: str) -> None:
        self._robot, self._tip = robot, tip
        none = np.zeros((1, 2, 3), dtype=np.float32)
        size = reach(robot)
        self.path = server.scene.add_line_segments(
            "/why/path",
            none,
            colours.rgb(colours.PATH),
            thickness=6.0,
            thickness_units="screen",
            visible=False,
        )
        self.pull = server.scene.add_arrows(
            "/why/pull",
            none,
            colours.rgb(colours.PULL),
            shaft_radius=0.008 * size,
            head_radius=0.02 * size,
            head_length=0.05 * size,
            visible=False,
        )
        self.point = server.scene.add_icosphere(
            "/why/point", 1.0, color=colours.rgb(colours.LIT), cast_shadow=False, visible=False
        )
        self._known: Array = np.zeros(0)

    def show(self, q: Array, reason: Reason, *, visible: bool) -> None:
        """Of a moment at q (nv,)."""
        self._show_path(reason.path if visible else np.zeros((0, len(q))))
        arrow = pull_arrow(self._robot, self._tip, q, reason.pull) if visible else None
        self.pull.visible = arrow is not None
        if arrow is not None:
            self.pull.points = arrow[None].astype(np.float32)
        self.point.visible = visible and reason.point is not None
        if visible and reason.point is not None:
            self.point.position = reason.point
            self.point.scale = max(1.15 * reason.radius, LEAST_RADIUS)

    def _show_path(self, path: Array) -> None:
        self.path.visible = len(path) > 1
        if len(path) > 1 and not np.array_equal(path, self._known):
            self._known = path
            places = [self._robot.pose(q, self._tip)[:3, 3] for q in along(path)]
            self.path.points = segments(np.array(places))

    def remove(self) -> None:
        for mark in (self.path, self.pull, self.point):
            mark.remove()


def along(path: Array) -> Array:
    """Configurations (n, nv) on a path (W, nv), at most `PATH_STEP` apart unless they would be too many."""
    lengths = np.abs(np.diff(path, axis=0)).max(axis=1)
    counts = np.maximum(np.ceil(lengths / max(PATH_STEP, float(lengths.sum()) / PATH_POINTS)).astype(int), 1)
    pieces = [
        path[k] + np.arange(counts[k])[:, None] / counts[k] * (path[k + 1] - path[k])
        for k in range(len(counts))
    ]
    return np.vstack([*pieces, path[-1:]])


def pull_arrow(robot: Robot, tip: str, q: Array, pull: Array) -> Array | None:
    """From the tip along its acceleration (2, 3) that goal or path ask for; None where that is next to nothing."""
    if len(pull) != robot.num_coordinates:
        return None
    asked = robot.jacobian(q, tip)[:3] @ pull
    size = float(np.linalg.norm(asked))
    if not size > LEAST_PULL:
        return None
    begin = robot.pose(q, tip)[:3, 3]
    return np.array([begin, begin + PULL_LENGTH * reach(robot) * asked / (size + HALF_PULL)])
