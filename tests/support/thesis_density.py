"""The thesis's density as its text writes it, in CasADi: an oracle that shares nothing with the core.

Poses are products of homogeneous matrices, covariances are rotated into the world, and their inverse and
determinant are taken there. Derivatives are CasADi's automatic differentiation of psi.
"""

import math

import casadi as ca
import numpy as np

import sidestep as ss


def _rotation(axis: np.ndarray, angle: ca.SX) -> ca.SX:
    cross = ca.skew(ca.DM(axis))
    return ca.SX.eye(3) + ca.sin(angle) * cross + (1 - ca.cos(angle)) * (cross @ cross)


def _joint_poses(robot: ss.Robot, q: ca.SX) -> list[ca.SX]:
    """World pose (4, 4) of every joint's child: placements and motions multiplied from base to tip (T3.8)."""
    poses: list[ca.SX] = []
    for joint in robot.joints:
        position = joint.multiplier * q[joint.coordinate] + joint.offset
        motion = ca.SX.eye(4)
        if joint.type.name == "revolute":
            motion[:3, :3] = _rotation(joint.axis, position)
        else:
            motion[:3, 3] = ca.DM(joint.axis) * position
        parent = poses[joint.parent] if joint.parent >= 0 else ca.SX.eye(4)
        poses.append(parent @ ca.DM(joint.placement) @ motion)
    return poses


def _determinant_and_inverse(matrix: ca.SX) -> tuple[ca.SX, ca.SX]:
    """By cofactors."""
    a, b, c = matrix[:, 0], matrix[:, 1], matrix[:, 2]
    determinant = ca.dot(a, ca.cross(b, c))
    cofactors = ca.horzcat(ca.cross(b, c), ca.cross(c, a), ca.cross(a, b))
    return determinant, cofactors.T / determinant


def _density(robot: ss.Robot, body: ss.Body, q: ca.SX, point: ca.SX, radius: ca.SX) -> ca.SX:
    """p(x, q) of the links that joints move (T3.1 to T3.7), covariances widened by radius^2."""
    poses = _joint_poses(robot, q)
    frames = {frame.name: frame for frame in robot.frames}
    total = ca.SX(0)
    for k, link in enumerate(body.links):
        frame = frames[link]
        if frame.joint < 0:
            continue
        pose = poses[frame.joint] @ ca.DM(frame.placement)
        R, o = pose[:3, :3], pose[:3, 3]
        mean = o + R @ ca.DM(body.means[k])
        covariance = R @ ca.DM(body.covariances[k]) @ R.T + radius**2 * ca.SX.eye(3)
        determinant, inverse = _determinant_and_inverse(covariance)
        offset = point - mean
        exponent = -0.5 * ca.dot(offset, inverse @ offset)
        total += body.weights[k] * ca.exp(exponent) / ca.sqrt((2 * math.pi) ** 3 * determinant)
    return total


class ThesisDensity:
    """psi of one point, with its gradient and Hessian in q and d2/dt2 psi(q + v t, x + s t) at t = 0."""

    def __init__(self, robot: ss.Robot, body: ss.Body) -> None:
        nv = robot.num_coordinates
        q, v, t = ca.SX.sym("q", nv), ca.SX.sym("v", nv), ca.SX.sym("t")
        x, s, radius = ca.SX.sym("x", 3), ca.SX.sym("s", 3), ca.SX.sym("r")
        psi = _density(robot, body, q, x, radius)
        hessian, gradient = ca.hessian(psi, q)
        moved = ca.substitute(psi, ca.vertcat(q, x), ca.vertcat(q + v * t, x + s * t))
        curvature = ca.substitute(ca.jacobian(ca.jacobian(moved, t), t), t, 0)
        self._nv = nv
        self._function = ca.Function("density", [q, v, x, s, radius], [psi, gradient, hessian, curvature])

    def __call__(
        self, q: np.ndarray, v: np.ndarray, obstacles: ss.Obstacles
    ) -> tuple[float, np.ndarray, np.ndarray, float]:
        """psi, dpsi/dq (nv,), d2psi/dq2 (nv, nv) and d2psi/dt2, summed over the obstacle points."""
        num = len(obstacles)
        repeated = [np.tile(a[:, None], num) for a in (q, v)]
        arrays = [obstacles.points.T, obstacles.velocities.T, obstacles.radii[None]]
        psi, gradient, hessian, curvature = (
            np.array(out) for out in self._function.map(num)(*repeated, *arrays)
        )
        blocks = hessian.reshape(self._nv, num, self._nv)
        return psi.sum(), gradient.sum(axis=1), blocks.sum(axis=1), curvature.sum()
