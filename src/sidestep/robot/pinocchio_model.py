"""A robot's tree as a model of Pinocchio."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from sidestep import _core
from sidestep.robot.link import Link


def pinocchio_model(robot: _core.Robot, links: Sequence[Link]) -> pin.Model:
    """The tree as a Pinocchio model; coordinate i belongs to `robot.joints[i]`, frames carry link names."""
    model = pin.Model()
    model.name = robot.name
    indices: list[int] = []
    limits = robot.limits
    for joint in robot.joints:
        prismatic = joint.type == _core.JointType.prismatic
        kind = pin.JointModelPrismaticUnaligned if prismatic else pin.JointModelRevoluteUnaligned
        parent = 0 if joint.parent < 0 else indices[joint.parent]
        bounds = [np.full(1, np.inf), np.full(1, np.inf), np.full(1, -np.inf), np.full(1, np.inf)]
        if robot.coordinate_names[joint.coordinate] == joint.name:
            values = (limits.effort, limits.velocity, limits.lower, limits.upper)
            bounds = [value[joint.coordinate : joint.coordinate + 1] for value in values]
        index = model.addJoint(parent, kind(joint.axis), pin.SE3(joint.placement), joint.name, *bounds)
        model.addJointFrame(index)
        indices.append(index)
    for frame, link in zip(robot.frames, links, strict=True):
        index = 0 if frame.joint < 0 else indices[frame.joint]
        placement = pin.SE3(frame.placement)
        model.addFrame(pin.Frame(frame.name, index, 0, placement, pin.FrameType.BODY), False)
        if link.inertial is not None and index > 0:
            inertia = pin.Inertia(link.inertial.mass, link.inertial.com, link.inertial.inertia)
            model.appendBodyToJoint(index, inertia, placement)
    return model
