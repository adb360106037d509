"""Goals that are poses: how far an arm is from one, and a configuration that has it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sidestep._core import PoseGoal, find_posture
from sidestep.math.pose import rotation_vector
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]

ACCURACY = 1e-7  # [m] and [rad]; the frame is at the pose


@dataclass(frozen=True, eq=False)
class IkSolution:
    """A configuration q (nv,) for a pose, in which the frame is this distance [m] and angle [rad] from it."""

    q: Array
    distance: float = 0.0
    angle: float = 0.0

    @property
    def found(self) -> bool:
        """Whether the frame is at the pose; otherwise q is as near as was found."""
        return float(np.hypot(self.distance, self.angle)) < ACCURACY

    def in_words(self, diagnosis: str) -> str:
        """A diagnosis of the way to q, after what q lacks."""
        if self.found:
            return diagnosis
        lack = f"{100.0 * self.distance:.1f} cm and {np.rad2deg(self.angle):.0f}°"
        return f"out of reach: the nearest posture found is {lack} from the pose; " + diagnosis.replace(
            "the goal", "there"
        )


class PoseTarget:
    """A pose (4, 4) of a frame in the world that an arm is to reach: how far it is.

    Args:
        robot, frame, pose: what is to be where.
        rest: (nv,) a posture near which one for the pose is looked for; None: near where the arm is.

    Raises:
        ValueError: see `PoseGoal`.
    """

    def __init__(self, robot: Robot, frame: str, pose: Array, *, rest: Array | None = None) -> None:
        self.robot = robot
        self.goal = PoseGoal(robot, frame, pose, rest=rest)

    def errors(self, q: Array) -> tuple[float, float]:
        """Distance [m] and angle [rad] of the frame at q (nv,) from the pose."""
        pose, goal = self.robot.pose(q, self.goal.frame), self.goal.pose
        turn = rotation_vector(pose[:3, :3] @ goal[:3, :3].T)
        return float(np.linalg.norm(pose[:3, 3] - goal[:3, 3])), float(np.linalg.norm(turn))


def solve_ik(
    robot: Robot,
    frame: str,
    pose: Array,
    near: Array,
    *,
    starts: int = 1,
) -> IkSolution:
    """A configuration within the limits with the frame at the pose, near a given one: see `find_posture`, which begins
    from up to `starts` configurations. Of obstacles it knows nothing: the search of a `Controller` does.
    """
    return IkSolution(*find_posture(robot, PoseGoal(robot, frame, pose), near, starts=starts))
