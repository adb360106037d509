"""Rigid poses as MuJoCo keeps them: position and quaternion (w, x, y, z)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

Array = npt.NDArray[np.float64]


def pose_vector(pose: Array) -> Array:
    """(7,) position and quaternion (w, x, y, z), w >= 0, of a (4, 4) pose."""
    quaternion = np.roll(Rotation.from_matrix(pose[:3, :3]).as_quat(), 1)
    return np.concatenate([pose[:3, 3], quaternion if quaternion[0] >= 0.0 else -quaternion])


def rotation_matrix(quaternion: Array) -> Array:
    """(3, 3) rotation of a unit quaternion (w, x, y, z)."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def pose_matrix(pose: Array) -> Array:
    """(4, 4) pose of a (7,) position and quaternion (w, x, y, z)."""
    X = np.eye(4)
    X[:3, :3] = rotation_matrix(pose[3:])
    X[:3, 3] = pose[:3]
    return X
