"""Thinning of points that loses nothing."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sidestep._core import real_array

Points = NDArray[np.float64]


def merge_in_voxels(points: ArrayLike, radii: ArrayLike = 0.0, *, voxel: float) -> tuple[Points, Points]:
    """Merges the points of each cell of a grid into one ball that contains all of theirs.

    The ball sits at the centre of the box around the cell's points and reaches over the farthest of them, so
    it adds at most half the cell's diagonal, sqrt(3)/2 voxel, to the largest radius; a point alone stays as
    it is. The merged obstacle contains the original one: thinning makes the arm more careful, never less.

    Args:
        points: (N, 3) [m].
        radii: one or (N,) [m].
        voxel: edge of a cell [m].

    Returns:
        Points (M, 3) and radii (M,) with M <= N, in the order of the cells.

    Raises:
        ValueError: if the voxel is not a positive length or the points are not finite (N, 3).
    """
    cloud = real_array(points, "points")
    if cloud.ndim != 2 or cloud.shape[1] != 3 or not np.isfinite(cloud).all():
        raise ValueError(f"points have shape {cloud.shape}, expected finite points (N, 3)")
    if not (np.isfinite(voxel) and voxel > 0.0):
        raise ValueError(f"voxel is {voxel}, must be positive and finite [m]")
    own = np.broadcast_to(real_array(radii, "radii"), len(cloud))
    _, cell = np.unique(np.floor(cloud / voxel), axis=0, return_inverse=True)
    cell = cell.reshape(-1)
    order = np.argsort(cell, kind="stable")
    starts = (
        np.flatnonzero(np.r_[True, np.diff(cell[order]) > 0]) if len(cloud) else np.zeros(0, dtype=np.int64)
    )
    low = np.minimum.reduceat(cloud[order], starts)
    high = np.maximum.reduceat(cloud[order], starts)
    centres = 0.5 * (low + high)
    reach = np.linalg.norm(cloud - centres[cell], axis=1) + own
    return centres, np.maximum.reduceat(reach[order], starts)
