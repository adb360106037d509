"""Where a window looks from, and the corner of what it shows that the arm leaves free."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from sidestep.drawing.views import hidden
from sidestep.robot import Robot

if TYPE_CHECKING:
    import trimesh

Array = npt.NDArray[np.float64]

VIEW = np.array([-0.63, 0.50, -0.59]) / np.linalg.norm(
    [-0.63, 0.50, -0.59]
)  # forwards, in the world, if nothing hides
VIEWS = tuple(
    VIEW * turn for turn in ([1, 1, 1], [1, -1, 1], [-1, 1, 1], [-1, -1, 1])
)  # from the four corners
BETTER = 0.05  # share of hidden points by which another view than the first has to be better
RIGHT = np.cross(VIEW, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(VIEW, [0.0, 0.0, 1.0]))
UP = np.cross(RIGHT, VIEW)
HALF = float(np.tan(0.5 * np.deg2rad(75.0)))  # of viser's angle of view, upwards
# Places in a window, in halves of its height from its middle: right and up. A window of 1280 x 800 pixels shows 0.77 to
# either side between the panels.
LOW, HIGH = np.array([-0.64, -0.76]), np.array([0.62, 0.70])  # of what is looked at
UNDER_CORNER = np.array([0.62, 0.34])  # in place of `HIGH` where something stands in the corner
CORNER, CORNER_SIDE = (-0.36, 0.68), 0.50  # middle and edge of what stands in the upper left
LEAN = 0.75  # [rad] between its normal and the view: hills on it are seen from the side
NEAREST = 0.05  # [m] from the camera to what is looked at


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """A camera at `position` (3,) that looks along `view` (3,) at `target` (3,) [m], and at nothing beyond `far`."""

    position: Array
    target: Array
    far: float
    view: Array

    @property
    def right(self) -> Array:
        """The direction (3,) to the right in its window."""
        return axes_of(self.view)[0]

    @property
    def up(self) -> Array:
        """The direction (3,) upwards in its window."""
        return axes_of(self.view)[1]

    @classmethod
    def of(cls, places: Array, view: Array = VIEW, high: Array = HIGH) -> Viewpoint:
        """Points (n, 3) [m] fill the room between `LOW` and `high` (2,), seen along `view` (3,)."""
        right, up = axes_of(view)
        depth = places @ view
        # Left and right, or lower and upper, ends of what a camera at depth 0 would have to hold: (2,) each.
        seen = places @ np.array([right, up]).T
        most = (seen - HALF * high * depth[:, None]).max(axis=0)
        least = (seen - HALF * LOW * depth[:, None]).min(axis=0)
        back = min(float((-(most - least) / (HALF * (high - LOW))).min()), float(depth.min()) - NEAREST)
        middle = 0.5 * (most + least + back * HALF * (high + LOW))
        position = back * view + middle[0] * right + middle[1] * up
        distance = 0.5 * float(depth.min() + depth.max()) - back
        return cls(position, position + distance * view, float(depth.max()) - back, view)

    def corner(self, side: float) -> Array:
        """The pose (4, 4) of a square of edge `side` [m] in the upper left, behind what is looked at.

        Its x axis points to the right in the window, its y axis away and upwards, its z axis to the camera and upwards.
        """
        depth = max(side / (CORNER_SIDE * HALF), self.far)
        view, right, up = self.view, self.right, self.up
        normal = np.sin(LEAN) * up - np.cos(LEAN) * view
        pose = np.eye(4)
        pose[:3, :3] = np.column_stack([right, np.cross(normal, right), normal])
        pose[:3, 3] = self.position + depth * (view + HALF * (CORNER[0] * right + CORNER[1] * up))
        return pose


def axes_of(view: Array) -> tuple[Array, Array]:
    """The directions (3,) to the right and upwards in a window that looks along `view` (3,)."""
    right: Array = np.cross(view, [0.0, 0.0, 1.0])
    right = right / np.linalg.norm(right)
    return right, np.cross(right, view)


def extent(
    robot: Robot,
    meshes: Mapping[str, trimesh.Trimesh],
    postures: Sequence[Array],
    solids: Sequence[Array],
    near: float,
) -> Array:
    """Points (n, 3) [m] that a window should show: the arm in each posture (nv,), and what solids, triangles (F, 3, 3)
    each, have within `near` [m] of the base."""
    corners = {link: np.asarray(mesh.bounding_box.vertices) for link, mesh in meshes.items()}
    places = [robot.pose(q, frame.name)[None, :3, 3] for q in postures for frame in robot.frames]
    for q in postures:
        for link, box in corners.items():
            pose = robot.pose(q, link)
            places.append(box @ pose[:3, :3].T + pose[:3, 3])
    beside = np.concatenate([np.zeros((0, 3)), *(triangles.reshape(-1, 3) for triangles in solids)])
    return np.concatenate([*places, beside[np.linalg.norm(beside, axis=1) < near]])


def clear_view(places: Array, solids: Sequence[Array]) -> Array:
    """Of `VIEWS` the one in which solids, triangles (F, 3, 3) each, hide least of points (n, 3); the first where it is
    as good as any."""
    triangles = np.concatenate([np.zeros((0, 3, 3)), *solids])
    shares = [float(hidden(places, triangles, -view).mean()) for view in VIEWS]
    best = int(np.argmin(shares))
    chosen: Array = VIEWS[best] if shares[best] < shares[0] - BETTER else VIEW
    return chosen
