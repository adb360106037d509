"""Goals that are poses: what draws the arm, and a configuration in which it has the pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sidestep._core import JointGoal, PoseGoal, real_array
from sidestep.pose import rotation_vector
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]

POSITION_SHARE, TURN_SHARE = 2.0, 0.5  # of the joint stiffness, per m^2 and per rad^2
ENTER = 1e-3, 5e-3  # [m] and [rad] within which the pose itself draws: far inside of what counts as arrived
LEAVE = 2e-2, 1e-1  # [m] and [rad] beyond which it is the posture again
ITERATIONS = 50  # from a configuration nearby about ten are enough
FRUITLESS = 8  # iterations in a row that come no nearer: the pose is out of reach from here
DAMPING = 0.03  # [m | rad] of the inverse: directions in which an arm moves less than this are left alone
LARGEST_STEP = 0.3  # [rad | m] of any joint: a metre of arm moves 4 cm beside the tangent
ACCURACY = 1e-7  # [m] and [rad]; the frame is at the pose
CLEARLY = 0.9  # of the error of a posture nearby: less is worth a way to quite another one


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
    """A configuration within the limits with the frame at the pose, by damped least squares from q = near:

        q <- clip(q + J^T (J J^T + lambda^2 1)^-1 e),    e = (p* - p, log(R* R^T)),

    (Nakamura and Hanafusa 1986), lambda shrinking with the error. Where that does not get there, again from random
    configurations ever farther away, the same every time, up to `starts` in all. Without success the one from `near`,
    unless another is clearly nearer to the pose. Of obstacles it knows nothing: the search of a `Controller` does.
    """
    lower, upper = robot._finite_interval()
    rng = np.random.default_rng(0)
    near = np.clip(real_array(near, "near"), lower, upper)
    best = _descend(robot, frame, pose, near)
    if best.found:
        return best
    for k in range(1, starts):
        spread = np.pi * k / (starts - 1)
        begin = rng.uniform(np.maximum(lower, near - spread), np.minimum(upper, near + spread))
        other = _descend(robot, frame, pose, begin)
        if other.found:
            return other
        if np.hypot(other.distance, other.angle) < CLEARLY * np.hypot(best.distance, best.angle):
            best = other
    return best


def _descend(robot: Robot, frame: str, pose: Array, q: Array) -> Posture:
    lower, upper = robot._finite_interval()
    best, least, fruitless = Posture(q, np.inf, np.inf), np.inf, 0
    for _ in range(ITERATIONS):
        error = -_error(robot.pose(q, frame), pose)
        size = float(np.linalg.norm(error))
        fruitless = fruitless + 1 if size > 0.99 * least else 0
        if size < least:
            best, least = Posture(q, *_sizes(error)), size
        if size < ACCURACY or fruitless == FRUITLESS:
            break
        J = robot.jacobian(q, frame)
        damping = min(DAMPING, size) ** 2
        step = J.T @ np.linalg.solve(J @ J.T + damping * np.eye(6), error)
        step *= min(1.0, LARGEST_STEP / float(np.abs(step).max(initial=1e-12)))
        q = np.clip(q + step, lower, upper)
    return best


def _error(pose: Array, goal: Array) -> Array:
    """(6,) from the goal to the pose in the world: displacement [m] and rotation vector [rad]."""
    return np.concatenate([pose[:3, 3] - goal[:3, 3], rotation_vector(pose[:3, :3] @ goal[:3, :3].T)])


def _sizes(error: Array) -> tuple[float, float]:
    """Distance [m] and angle [rad] of an error (6,)."""
    return float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:]))
