"""Where the tip is, as a UR says it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sidestep.arm import Arm

FLANGE = "tool0"  # link of the description
_TURN = np.diag([-1.0, -1.0, 1.0])  # a UR's base frame is turned by 180° about z from that of its URDF


def tip_pose(arm: Arm, q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Pose of the flange (6,): position [m] and rotation vector [rad], in a UR's own base frame.

    Args:
        arm: the model. q: (6,) [rad].
    """
    pose = arm.robot.pose(q, FLANGE)
    return np.concatenate([_TURN @ pose[:3, 3], Rotation.from_matrix(_TURN @ pose[:3, :3]).as_rotvec()])
