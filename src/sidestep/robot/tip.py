"""The end of an arm, whose pose is a goal."""

from __future__ import annotations

from sidestep.robot.model import Robot


def tip_of(robot: Robot) -> str:
    """The link whose pose is a goal: of those that the last joint of the arm carries, the tool centre point where one
    is named so, else the last named."""
    depth = {-1: 0}
    for index, joint in enumerate(robot.joints):
        depth[index] = depth[joint.parent] + 1
    deepest = max(depth[frame.joint] for frame in robot.frames)
    names = [frame.name for frame in robot.frames if depth[frame.joint] == deepest]
    return next((name for name in names if name.endswith("tcp")), names[-1])
