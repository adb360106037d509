"""Rigid-body dynamics of a robot's tree, by Pinocchio."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from sidestep import _core
from sidestep.robot.link import Array, Link


class Dynamics:
    """Mass matrix and bias force of a tree whose mimic joints follow other coordinates.

    Pinocchio's model has one coordinate per moving joint, q' = S q + c, where S holds the mimic multipliers
    (the identity without mimic joints). By virtual work M = S^T M' S and, S being constant,
    h = S^T h'(q', S v).
    Source: Featherstone, Rigid Body Dynamics Algorithms (2008), chapters 5 and 6.

    Args:
        robot: the tree. links: inertias, in the order of `robot.frames`.
    """

    def __init__(self, robot: _core.Robot, links: Sequence[Link]) -> None:
        joints = robot.joints
        self.model = _model(robot, links)
        self._data = self.model.createData()
        self._selection = np.zeros((len(joints), robot.num_coordinates))
        for row, joint in enumerate(joints):
            self._selection[row, joint.coordinate] = joint.multiplier
        self._offset = np.array([joint.offset for joint in joints])

    def mass_matrix(self, q: Array) -> Array:
        """M(q) (nv, nv) [kg m^2, kg m, kg]."""
        full = pin.crba(self.model, self._data, self._selection @ q + self._offset)
        upper = np.triu(full)
        return np.asarray(self._selection.T @ (upper + np.triu(full, 1).T) @ self._selection)

    def bias(self, q: Array, v: Array) -> Array:
        """h(q, v) = C(q, v) v + g(q) (nv,) [Nm | N]."""
        force = pin.nonLinearEffects(
            self.model, self._data, self._selection @ q + self._offset, self._selection @ v
        )
        return np.asarray(self._selection.T @ force)


def _model(robot: _core.Robot, links: Sequence[Link]) -> pin.Model:
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
