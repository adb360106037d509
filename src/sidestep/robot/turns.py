"""Joints that turn without limits: a configuration is the same a turn further."""

from __future__ import annotations

from typing import Any

import numpy as np

from sidestep import _core
from sidestep.robot.link import Array


def ways_to(robot: _core.Robot, q: Any, goal: Any) -> Array:
    """|q - goal| of every joint (..., nv) [rad | m], to the nearest turn of joints that turn without limits.

    Args:
        robot: whose joints they are. q, goal: (..., nv), (nv,).
    """
    away = np.abs(np.asarray(q, dtype=np.float64) - goal)
    free = np.array(_core.unlimited_joints(robot))
    turn = 2.0 * np.pi
    rest = np.mod(away, turn)
    return np.asarray(np.where(free, np.minimum(rest, turn - rest), away))
