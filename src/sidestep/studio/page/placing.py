"""Where an obstacle that is added stands: near the goal, in sight, and away from the arm."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from sidestep.distance import ExactClearance, SceneObject
from sidestep.math.pose import pose_at, pose_vector
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]
Ball = tuple[Array, float]  # centre (3,) and radius [m]

CLEAR = 0.05  # [m] at least from arm, ghost and other obstacles: an arm at 1 m/s comes 3 cm nearer until it is there
DIRECTIONS = 40  # that are tried around a point
SHELLS, SHELL = 8, 0.08  # half balls that are tried, and how much each is larger [m]
SIGHT = 0.01  # [m] radius of the line of sight that is free of the arm
# In halves of a window's height from its middle, right and up: what lies between the panels of 1280 x 800 pixels.
LOW, HIGH = np.array([-0.70, -0.85]), np.array([0.70, 0.85])


class Camera:
    """Where somebody looks from: position (3,), axes (3, 3) to the right, down and forward, fov upwards [rad]."""

    def __init__(self, position: Array, axes: Array, fov: float) -> None:
        self.position, self.axes, self._half = position, axes, float(np.tan(0.5 * fov))

    def sees(self, place: Array) -> bool:
        """Whether a place (3,) is between the panels of the window."""
        right, down, depth = self.axes.T @ (place - self.position)
        there = np.array([right, -down]) / (self._half * max(depth, 1e-9))
        return bool(depth > 0.0 and (there > LOW).all() and (there < HIGH).all())


def free_place(
    robot: Robot,
    postures: Sequence[Array],
    others: Sequence[Ball],
    gizmo: Ball,
    size: float,
    camera: Camera,
    first: Sequence[Array] = (),
) -> Array:
    """The first place (3,) for a ball of radius `size` [m] that is free: on the exact meshes `CLEAR` of the arm in each
    posture (nv,), and of the other balls.

    It is looked for around the gizmo, above and before it first, where it neither hides gizmo, balls or arm (in the
    first posture) nor is hidden by them; else between the panels, else anywhere. `first`: places tried before those.

    Raises:
        ValueError: there is none.
    """
    bare = ExactClearance(robot, ())
    arm = bare.among([SceneObject("new", "sphere", size=(size,), motion="moving")])

    def clear(place: Array) -> bool:
        apart = (np.linalg.norm(place - centre) - radius - size for centre, radius in others)
        pose = pose_vector(pose_at(place))[None]
        return bool(min(apart, default=np.inf) > CLEAR) and all(
            arm.distance(q, pose).distance > CLEAR for q in postures
        )

    def in_sight(place: Array) -> bool:
        ray = place - camera.position
        length = float(np.linalg.norm(ray))
        beside = (
            float(np.linalg.norm(np.cross(ray / length, centre - camera.position))) - radius
            for centre, radius in (gizmo, *others)
        )
        if not camera.sees(place) or min(beside) < size:
            return False
        line = SceneObject("sight", "cylinder", size=(SIGHT, length), pose=along(camera.position, place))
        return bare.among([line]).distance(postures[0]).distance > 0.0

    for place in first:
        if clear(place):
            return place
    tried = list(around(gizmo[0], gizmo[1] + size + CLEAR, camera))
    for wanted in (in_sight, camera.sees, lambda _: True):
        for place in tried:
            if wanted(place) and clear(place):
                return place
    raise ValueError("there is no room for it near the goal; move the goal, or take a smaller one")


def around(centre: Array, nearest: float, camera: Camera) -> Iterator[Array]:
    """Places (3,) on half balls around a point, upwards: on each those first that are above it and before it."""
    k = np.arange(DIRECTIONS) + 0.5  # spread evenly, on a spiral
    turn, up = np.pi * (1.0 + np.sqrt(5.0)) * k, 1.0 - k / DIRECTIONS
    flat = np.sqrt(1.0 - up**2)
    directions = np.column_stack([flat * np.cos(turn), flat * np.sin(turn), up])
    wish = np.array([0.0, 0.0, 1.0]) - 0.5 * camera.axes[:, 2]
    ordered = directions[np.argsort(-directions @ wish)]
    for shell in range(SHELLS):
        yield from centre + (nearest + shell * SHELL) * ordered


def along(begin: Array, end: Array) -> Array:
    """The pose (4, 4) half way, whose z axis points from one point (3,) to the other."""
    z = (end - begin) / np.linalg.norm(end - begin)
    x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
    x /= np.linalg.norm(x)
    return pose_at(0.5 * (begin + end), np.column_stack([x, np.cross(z, x), z]))
