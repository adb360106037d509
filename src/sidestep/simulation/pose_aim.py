"""Goals that are poses: what draws the arm, and a configuration in which it has the pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sidestep._core import JointGoal, PoseGoal, find_posture
from sidestep.robot import Robot
from sidestep.robot.pose import rotation_vector

Array = npt.NDArray[np.float64]

POSITION_SHARE, TURN_SHARE = 2.0, 0.5  # of the joint stiffness, per m^2 and per rad^2
ENTER = 1e-3, 5e-3  # [m] and [rad] within which the pose itself draws: far inside of what counts as arrived
LEAVE = 2e-2, 1e-1  # [m] and [rad] beyond which it is the posture again
ACCURACY = 1e-7  # [m] and [rad]; the frame is at the pose


@dataclass(frozen=True, eq=False)
class Posture:
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
        stiffness: of the system's pull to configurations [1/s^2], for the goal.
        rest: (nv,) a posture near which one for the pose is looked for; None: near where the arm is.

    Raises:
        ValueError: see `PoseGoal`.
    """

    def __init__(
        self, robot: Robot, frame: str, pose: Array, *, stiffness: float = 1.0, rest: Array | None = None
    ) -> None:
        self.robot = robot
        self.goal = PoseGoal(
            robot,
            frame,
            pose,
            position_stiffness=POSITION_SHARE * stiffness,
            orientation_stiffness=TURN_SHARE * stiffness,
            rest=rest,
        )

    def errors(self, q: Array) -> tuple[float, float]:
        """Distance [m] and angle [rad] of the frame at q (nv,) from the pose."""
        return _sizes(_error(self.robot.pose(q, self.goal.frame), self.goal.pose))


class PoseAim(PoseTarget):
    """What draws an arm without a `Controller` to a pose.

    The pull of a `PoseGoal`, J^T k e, is weak in directions in which the joints move the frame little: an arm with
    seven joints may be centimetres away after many seconds. From afar it is therefore drawn to a posture that has the
    pose; near by to the pose itself, which leaves the joints free that do not move the frame. Out of reach it comes to
    rest in the nearest posture that was found.

    Args:
        robot, frame, pose: what is to be where, in the world.
        stiffness: of the system's pull to configurations [1/s^2].
        posture: for the pose.

    Raises:
        ValueError: see `PoseGoal`.
    """

    def __init__(self, robot: Robot, frame: str, pose: Array, *, stiffness: float, posture: Posture) -> None:
        super().__init__(robot, frame, pose, stiffness=stiffness)
        self.posture = posture
        self._there = JointGoal(posture.q)
        self._near = False

    def at(self, q: Array) -> JointGoal | PoseGoal:
        """What draws an arm at q (nv,), which moves on from where it was asked last."""
        if self.posture.found:
            distance, angle = self.errors(q)
            bound = LEAVE if self._near else ENTER
            self._near = distance < bound[0] and angle < bound[1]
        return self.goal if self._near else self._there


def posture_at(
    robot: Robot,
    frame: str,
    pose: Array,
    near: Array,
    *,
    starts: int = 1,
) -> Posture:
    """A configuration within the limits with the frame at the pose, near a given one: see `find_posture`, which begins
    from up to `starts` configurations. Of obstacles it knows nothing: the search of a `Controller` does.
    """
    return Posture(*find_posture(robot, PoseGoal(robot, frame, pose), near, starts=starts))


def _error(pose: Array, goal: Array) -> Array:
    """(6,) from the goal to the pose in the world: displacement [m] and rotation vector [rad]."""
    return np.concatenate([pose[:3, 3] - goal[:3, 3], rotation_vector(pose[:3, :3] @ goal[:3, :3].T)])


def _sizes(error: Array) -> tuple[float, float]:
    """Distance [m] and angle [rad] of an error (6,)."""
    return float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:]))
