"""Poses as text files and messages hold them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sidestep._core import real_array
from sidestep.math.pose import checked_pose

_ROUNDING = 1e-3  # on R Rᵀ - 1, of single precision and of four digits


def rounded_pose(value: npt.ArrayLike, owner: str) -> npt.NDArray[np.float64]:
    """The pose (4, 4) that a matrix is but for rounding to four digits: the nearest rotation, last row 0 0 0 1.

    Raises:
        ValueError: it is no rigid transform by more than that; names the owner.
    """
    X = real_array(value, owner).copy()
    if X.shape == (4, 4) and np.abs(X[3] - [0.0, 0.0, 0.0, 1.0]).max() <= _ROUNDING:
        X[3] = [0.0, 0.0, 0.0, 1.0]
    X = checked_pose(X, owner, tolerance=_ROUNDING).copy()
    U, _, V = np.linalg.svd(X[:3, :3])
    X[:3, :3] = U @ V
    return X
