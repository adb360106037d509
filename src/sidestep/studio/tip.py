"""Where the tip of an arm is to be, for a pose goal of any frame that it carries."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sidestep.robot import Robot, tip_of
from sidestep.scenario.assembly import pose_of
from sidestep.scenario.scenario import PoseConfig

Array = npt.NDArray[np.float64]


def at_tip(choice: PoseConfig, robot: Robot) -> Array:
    """The pose (4, 4) of the tip that puts the frame of a file's goal at its pose.

    Raises ValueError where a joint lies between that frame and the tip.
    """
    tip, pose, rest = tip_of(robot), pose_of(choice), robot.neutral
    joints = {frame.name: frame.joint for frame in robot.frames}
    carried = [name for name, joint in joints.items() if joint == joints[tip]]
    if choice.frame not in carried:
        raise ValueError(f"goal.frame is {choice.frame!r}; the studio allows: {', '.join(carried)}")
    if choice.frame == tip:
        return pose
    moved: Array = pose @ np.linalg.inv(robot.pose(rest, choice.frame)) @ robot.pose(rest, tip)
    return moved
