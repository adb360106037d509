"""Thinning of points that loses nothing."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sidestep._core import real_array

Points = NDArray[np.float64]

MOST_CELLS = 2.0**53  # of a grid whose cells are numbered without rounding


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
    if cloud.ndim != 2 or cloud.shape[1] != 3:
        raise ValueError(f"points have shape {cloud.shape}, expected finite points (N, 3)")
    if not (finite := np.isfinite(cloud).all(axis=1)).all():
        raise ValueError(
            f"{np.count_nonzero(~finite)} of {len(cloud)} points are not finite, the first is point "
            f"{int(np.argmin(finite))}; where they mean that a camera saw nothing, leave them out: "
            "points[np.isfinite(points).all(axis=1)]"
        )
    if not (np.isfinite(voxel) and voxel > 0.0):
        raise ValueError(f"voxel is {voxel}, must be positive and finite [m]")
    own = np.broadcast_to(real_array(radii, "radii"), len(cloud))
    if len(cloud) == 0:
        return np.zeros((0, 3)), np.zeros(0)
    cell = _cells(cloud, voxel)
    order = np.argsort(cell, kind="stable")
    own, cell = own[order], cell[order]
    starts = np.flatnonzero(np.concatenate([[True], cell[1:] != cell[:-1]]))
    counts = np.diff(np.append(starts, len(cloud)))
    centres, squares = np.empty((len(starts), 3)), np.zeros(len(cloud))
    for axis in range(3):  # one after the other: numbers that lie side by side are quicker
        values = cloud[order, axis]
        centres[:, axis] = 0.5 * (np.minimum.reduceat(values, starts) + np.maximum.reduceat(values, starts))
        squares += np.square(values - np.repeat(centres[:, axis], counts))
    return centres, np.maximum.reduceat(np.sqrt(squares) + own, starts)


def _cells(cloud: Points, voxel: float) -> NDArray[np.integer]:
    """Numbers (N,) of the cells of points (N, 3), in the order of x, then y, then z."""
    place = np.floor(cloud / voxel)
    low = place.min(axis=0)
    spans = place.max(axis=0) - low + 1.0
    if spans.prod() < MOST_CELLS and np.abs(place).max() < MOST_CELLS:
        x, y, z = (place - low).T
        kind = (
            np.uint16 if spans.prod() <= 2**16 else np.int64
        )  # the sort of short numbers is ten times as fast
        return np.asarray(((x * spans[1] + y) * spans[2] + z).astype(kind))
    _, cell = np.unique(place, axis=0, return_inverse=True)  # far points: eight times as long
    return np.asarray(cell.reshape(-1))
