"""Obstacles from point-cloud files."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sidestep._core import Obstacles
from sidestep.math.pose import moved
from sidestep.obstacles.cloud_array import Points, read_npy, read_npz
from sidestep.obstacles.cloud_pcd import read_pcd, read_viewpoint
from sidestep.obstacles.cloud_ply import read_ply
from sidestep.obstacles.cloud_text import read_text
from sidestep.obstacles.voxels import merge_in_voxels
from sidestep.shapes.mesh_file import LFS_POINTER

FAR = 10.0  # [m] half of a cloud beyond this, or a point beyond ten times it, is warned of
NOWHERE = 1e7  # [m] map coordinates do not go beyond this; a point that does stands for nothing seen
TINY = 0.01  # [m] a cloud that was scaled and does not reach beyond this is warned of


def load_point_cloud(
    path: str | Path,
    *,
    radius: float = 0.0,
    voxel: float | None = None,
    scale: float = 1.0,
    invalid: Literal["raise", "drop"] = "drop",
    viewpoint: bool = False,
) -> Obstacles:
    """Reads obstacle points from a .ply, .pcd, .npy, .npz or text file.

    Coordinates are taken as metres in the world, times `scale`; points that are implausibly far for that are
    warned of. PLY may be ASCII or binary of either byte order, PCD ASCII, binary or compressed. NPY, and NPZ with one
    array or one called "points" or "xyz", hold an array (N, 3) or (H, W, 3), or one with up to 16 columns of which
    the first three are x, y, z, or a structured one with fields x, y, z or xyz; nothing is unpickled. Text files
    (.txt, .xyz, .csv, .asc, .pts) hold a point a line, x, y, z first or where a line of titles names them, between
    blanks, tabs, commas or semicolons; an empty cell is no number; `#`, `//` and `%` begin a comment.

    Args:
        path: the file.
        radius: radius of every point [m].
        voxel: edge [m] of the cells in which points are merged, see `merge_in_voxels`; None keeps all points.
        scale: of the coordinates: 0.001 for a file in millimetres.
        invalid: what to do with points that are not finite or farther than 1e7 m, which depth cameras write where
            they see nothing: drop them with a warning that gives their number, or refuse the file.
        viewpoint: take the points of a PCD file as seen from its VIEWPOINT, a pose in the world.

    Raises:
        FileNotFoundError: if there is no such file.
        ValueError: if the format is unknown, the file is malformed or a mesh, no point is left, or a viewpoint is
            asked of a file that is no PCD.
    """
    path = Path(path)
    if invalid not in ("raise", "drop"):
        raise ValueError(f"invalid is {invalid!r}, must be 'raise' or 'drop'")
    if not (np.isfinite(scale) and scale > 0.0):
        raise ValueError(f"scale is {scale}, must be positive and finite")
    if not path.is_file():
        raise FileNotFoundError(f"point cloud '{path}' does not exist")
    suffix = path.suffix.lower()
    if suffix not in READERS:
        raise ValueError(
            f"point cloud '{path}' has suffix '{path.suffix}', must be one of {', '.join(READERS)}"
        )
    if viewpoint and suffix != ".pcd":
        raise ValueError(f"point cloud '{path}' has no viewpoint; only .pcd files have one")
    with path.open("rb") as stream:
        if stream.read(len(LFS_POINTER)) == LFS_POINTER:
            raise ValueError(
                f"point cloud '{path}' is a Git LFS pointer, not the cloud; run `git lfs pull` in its repository"
            )
    try:
        points = READERS[suffix](path)
        with np.errstate(invalid="ignore", over="ignore"):  # of points that stand for nothing seen
            points = scale * (moved(points, read_viewpoint(path)) if viewpoint else points)
    except Exception as error:  # the readers raise anything; the file's name must reach the user
        raise ValueError(f"point cloud '{path}' cannot be read: {error}") from error
    if len(points) == 0:
        raise ValueError(f"point cloud '{path}' holds no point; where nothing is seen, use Obstacles.none()")
    kept, remark = _kept(points)
    if not kept.all() and invalid == "raise":
        raise ValueError(
            f"point cloud '{path}': {remark}, the first is point {int(np.argmin(kept))}; invalid='drop' leaves them out"
        )
    if not kept.any():
        raise ValueError(f"point cloud '{path}' holds no point that can be used: {remark}")
    points = points[kept]
    remarks = [f"{remark} and were dropped"] if remark else []
    remarks += _doubts(points, scaled=scale != 1.0)
    if remarks:
        warnings.warn(f"point cloud '{path}': {'; '.join(remarks)}", RuntimeWarning, stacklevel=2)
    radii = np.full(len(points), float(radius))
    if voxel is not None:
        points, radii = merge_in_voxels(points, radii, voxel=voxel)
    with warnings.catch_warnings():  # it was said above, with the file's name
        warnings.filterwarnings("ignore", "obstacles: all points are farther", RuntimeWarning)
        return Obstacles(points, radii=radii)


def _kept(points: Points) -> tuple[NDArray[np.bool_], str]:
    """Which points are somewhere, and what is wrong with the others."""
    finite = np.isfinite(points).all(axis=1)
    kept = np.all(np.abs(points) <= NOWHERE, axis=1)  # False of what is not finite
    remarks = []
    if not finite.all():
        remarks.append(f"{np.count_nonzero(~finite)} of {len(points)} points are not finite")
    beyond = np.flatnonzero(finite & ~kept)
    if len(beyond):
        place = np.array2string(points[beyond[0]], precision=4)
        remarks.append(
            f"{len(beyond)} of {len(points)} points are farther than {NOWHERE:g} m (point {beyond[0]} is at {place} m, "
            "as if nothing was seen there)"
        )
    return kept, " and ".join(remarks)


def _doubts(points: Points, *, scaled: bool) -> list[str]:
    """What is implausible about points that are kept: their unit, a few that stand for nothing seen."""
    doubts = []
    distance = np.abs(points).max(axis=1)
    middle, farthest = float(np.median(distance)), int(np.argmax(distance))
    if middle > FAR:
        doubts.append(
            f"half of its points are farther than {middle:.4g} m; are they in millimetres? Then scale=0.001"
        )
    elif distance[farthest] > 10.0 * FAR:
        doubts.append(
            f"{np.count_nonzero(distance > 10.0 * FAR)} of {len(points)} points are farther than {10.0 * FAR:g} m: "
            f"one is at {np.array2string(points[farthest], precision=4)} m; does that stand for nothing seen?"
        )
    elif scaled and distance[farthest] < TINY:
        doubts.append(
            f"no point is farther than {distance[farthest]:.4g} m; is the scale meant for a file in another unit?"
        )
    zeros = np.count_nonzero(distance == 0.0)
    if zeros > 1:
        doubts.append(
            f"{zeros} of {len(points)} points are exactly (0, 0, 0) and were kept; some cameras write that where they "
            "see nothing"
        )
    return doubts


READERS: dict[str, Callable[[Path], Points]] = {
    ".ply": read_ply,
    ".pcd": read_pcd,
    ".npy": read_npy,
    ".npz": read_npz,
    ".txt": read_text,
    ".xyz": read_text,
    ".csv": read_text,
    ".asc": read_text,
    ".pts": read_text,
}
