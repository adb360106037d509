"""The end of an arm, whose pose is a goal."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sidestep.robot import Robot
from sidestep.scenario.assembly import pose_of
from sidestep.scenario.scenario import PoseChoice

Array = npt.NDArray[np.float64]


def tip_of(robot: Robot) -> str:
    """The link whose pose is a goal: of those that the last joint of the arm carries, the tool centre point where one
    is named so, else the last named."""
    depth = {-1: 0}
    for index, joint in enumerate(robot.joints):
        depth[index] = depth[joint.parent] + 1
    deepest = max(depth[frame.joint] for frame in robot.frames)
    names = [frame.name for frame in robot.frames if depth[frame.joint] == deepest]
    return next((name for name in names if name.endswith("tcp")), names[-1])


def at_tip(choice: PoseChoice, robot: Robot) -> Array:
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
