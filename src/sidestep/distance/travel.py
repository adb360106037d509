"""Positions along a sampled motion, and how far points of bodies move on the way."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
import numpy.typing as npt

from sidestep._core import JointType
from sidestep.math.pose import moved
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]

SAME_DIRECTION = 1e-12  # of the product of two quaternions: what rounding makes of a pose that does not turn


def travel_per_joint(robot: Robot, link: str, points: Array, *, beyond: Collection[int] = ()) -> Array:
    """Bound (nv,) on how far points (N, 3) of a link, in its frame, move per unit of each joint coordinate, at
    any configuration.

    For a revolute joint it is the longest lever arm, at most the stretched length of the chain from the joint
    to the link plus the distance of the farthest point; for a prismatic joint 1. [m/rad] or [m/m].
    Only the joints beyond the ones in `beyond` (indices of `robot.joints`) count: motion relative to them.

    Raises:
        ValueError: a prismatic joint between a revolute one and the link has no position limits.
    """
    frame = next(f for f in robot.frames if f.name == link)
    bound = np.zeros(robot.num_coordinates)
    limits = robot.limits
    vertices = moved(points, frame.placement)
    reach = float(np.linalg.norm(vertices, axis=1).max())
    index, first = frame.joint, True
    while index >= 0 and index not in beyond:
        joint = robot.joints[index]
        if joint.type == JointType.revolute:
            arm = float(np.linalg.norm(np.cross(vertices, joint.axis), axis=1).max()) if first else reach
            bound[joint.coordinate] += abs(joint.multiplier) * arm
        else:
            bound[joint.coordinate] += abs(joint.multiplier)
            ends = (limits.lower[joint.coordinate], limits.upper[joint.coordinate])
            stroke = max(abs(joint.multiplier * e + joint.offset) for e in ends)
            if not np.isfinite(stroke) and joint.parent >= 0:
                raise ValueError(
                    f"prismatic joint {joint.name!r} needs finite position limits to bound its motion"
                )
            reach += stroke if np.isfinite(stroke) else 0.0
        reach += float(np.linalg.norm(joint.placement[:3, 3]))
        index, first = joint.parent, False
    return bound


def object_travel(poses: Array, radius: float) -> Array:
    """Bound (T - 1,) on the travel of any point of an object between samples: shift plus angle times
    radius. A half-space, of infinite radius, has to keep its direction."""
    shift: Array = np.linalg.norm(np.diff(poses[:, :3], axis=0), axis=1)
    overlap = np.abs(np.einsum("ij,ij->i", poses[1:, 3:], poses[:-1, 3:]))
    if not np.isfinite(radius):
        if (overlap < 1.0 - SAME_DIRECTION).any():
            raise ValueError(
                "a plane turns between samples; clearance along a motion needs one that does not"
            )
        return shift
    turned: Array = shift + radius * 2.0 * np.arccos(np.clip(overlap, 0.0, 1.0))
    return turned


def interpolate(samples: Array, s: float) -> Array:
    """The row of samples (T, n) at a position along them, linear between two of them."""
    k = min(int(s), len(samples) - 1)
    f = s - k
    value: Array = samples[k] if f == 0.0 else (1.0 - f) * samples[k] + f * samples[k + 1]
    return value


def interpolate_many(samples: Array, positions: Array) -> Array:
    """The same (M, ...) at many positions (M,)."""
    k = np.minimum(positions.astype(int), len(samples) - 1)
    f = (positions - k).reshape(-1, *[1] * (samples.ndim - 1))
    values: Array = (1.0 - f) * samples[k] + f * samples[np.minimum(k + 1, len(samples) - 1)]
    return values


def interpolate_pose(poses: Array, s: float) -> Array:
    """The pose (7,) at a position along poses (T, 7): shifted linearly, turned at a constant rate."""
    pose = interpolate(poses, s)
    k = min(int(s), len(poses) - 1)
    if s == k or np.array_equal(poses[k, 3:], poses[k + 1, 3:]):
        return pose
    start, end, f = poses[k, 3:], poses[k + 1, 3:], s - k
    overlap = float(start @ end)
    end = end if overlap >= 0.0 else -end
    angle = float(np.arccos(min(abs(overlap), 1.0)))
    if angle < 1e-9:  # [rad] no turn worth dividing by
        return np.concatenate([pose[:3], start])
    turned = (np.sin((1.0 - f) * angle) * start + np.sin(f * angle) * end) / np.sin(angle)
    return np.concatenate([pose[:3], turned])
