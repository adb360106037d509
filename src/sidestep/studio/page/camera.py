"""Where a window looks from, and the corner of what it shows that the arm leaves free."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

VIEW = np.array([-0.63, 0.50, -0.59]) / np.linalg.norm([-0.63, 0.50, -0.59])  # forwards, in the world
RIGHT = np.cross(VIEW, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(VIEW, [0.0, 0.0, 1.0]))
UP = np.cross(RIGHT, VIEW)
HALF = float(np.tan(0.5 * np.deg2rad(75.0)))  # of viser's angle of view, upwards
# Places in a window, in halves of its height from its middle: right and up. A window of 1280 x 800 pixels shows 0.77 to
# either side between the panels.
LOW, HIGH = np.array([-0.55, -0.60]), np.array([0.58, 0.30])  # of what is looked at
CORNER, CORNER_SIDE = (-0.36, 0.68), 0.50  # middle and edge of what stands in the upper left
LEAN = 0.75  # [rad] between its normal and the view: hills on it are seen from the side
ROUNDS = 30  # by then the distance changes by less than a part in a thousand


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """A camera at `position` (3,) that looks along `VIEW` at `target` (3,) [m], and at nothing beyond `far` [m]."""

    position: Array
    target: Array
    far: float

    @classmethod
    def of(cls, places: Array) -> Viewpoint:
        """Points (n, 3) [m] fill the room between `LOW` and `HIGH`."""
        target = 0.5 * (places.min(axis=0) + places.max(axis=0))
        distance = size = float(np.linalg.norm(places - target, axis=1).max())
        for _ in range(ROUNDS):
            depth = np.maximum(distance + (places - target) @ VIEW, 0.1 * size)
            seen = (places - target) @ np.array([RIGHT, UP]).T / (HALF * depth[:, None])
            low, high = seen.min(axis=0), seen.max(axis=0)
            off = 0.5 * (low + high - LOW - HIGH)
            target = target + distance * HALF * (off[0] * RIGHT + off[1] * UP)
            distance *= float(((high - low) / (HIGH - LOW)).max()) ** 0.5
        return cls(target - distance * VIEW, target, float(((places - target) @ VIEW).max()) + distance)

    def corner(self, side: float) -> Array:
        """The pose (4, 4) of a square of edge `side` [m] in the upper left, behind what is looked at.

        Its x axis points to the right in the window, its y axis away and upwards, its z axis to the camera and upwards.
        """
        depth = max(side / (CORNER_SIDE * HALF), self.far)
        normal = np.sin(LEAN) * UP - np.cos(LEAN) * VIEW
        pose = np.eye(4)
        pose[:3, :3] = np.column_stack([RIGHT, np.cross(normal, RIGHT), normal])
        pose[:3, 3] = self.position + depth * (VIEW + HALF * (CORNER[0] * RIGHT + CORNER[1] * UP))
        return pose
