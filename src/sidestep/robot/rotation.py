"""Rotation matrices, without SciPy: importing it would take longer than loading a robot."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sidestep.robot.link import Array


def about_axis(axis: Array, angle: float) -> Array:
    """The rotation (3, 3) by `angle` [rad] about a unit axis (3,), by Rodrigues' formula
    R = 1 + sin(angle) K + (1 - cos(angle)) K^2 with K x = axis × x."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Array = np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)
    return rotation


def from_roll_pitch_yaw(rpy: Sequence[float]) -> Array:
    """The rotation (3, 3) by roll, pitch, yaw [rad] about the fixed x, y and z axes, in this order."""
    x, y, z = np.eye(3)
    return about_axis(z, rpy[2]) @ about_axis(y, rpy[1]) @ about_axis(x, rpy[0])
