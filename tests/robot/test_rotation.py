"""Rotations against SciPy's."""

import numpy as np
from scipy.spatial.transform import Rotation

from sidestep.robot.rotation import about_axis, from_roll_pitch_yaw


def test_rotations_agree_with_scipy() -> None:
    rng = np.random.default_rng(0)
    for _ in range(200):
        axis, angle, rpy = rng.normal(size=3), rng.uniform(-7, 7), rng.uniform(-7, 7, size=3)
        axis /= np.linalg.norm(axis)
        # a handful of products of numbers below 1: rounding stays below 3e-15
        np.testing.assert_allclose(
            about_axis(axis, angle), Rotation.from_rotvec(angle * axis).as_matrix(), rtol=0, atol=3e-15
        )
        np.testing.assert_allclose(
            from_roll_pitch_yaw(rpy), Rotation.from_euler("xyz", rpy).as_matrix(), rtol=0, atol=3e-15
        )
