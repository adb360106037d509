"""The recipe of Sidestep 0.2 for a depth camera, in NumPy, as its page on clouds had it."""

from __future__ import annotations

from time import perf_counter

import numpy as np
import numpy.typing as npt

from sidestep._core import Controller, Obstacles
from sidestep.arm import Arm
from sidestep.obstacles import merge_in_voxels
from sidestep.perception import DepthCamera, Frame

Array = npt.NDArray[np.float64]

RADIUS = 0.005  # [m] of a point
VOXEL = 0.03  # [m]
GROW = 0.03  # [m] of the arm
SOURCE = "recipe"
STAGES = ("points", "merge", "off_the_arm", "set_obstacles")


def points_of(camera: DepthCamera, depth: Array) -> Array:
    """Points (N, 3) in the world of the pixels of an image (H, W) [m] that see something."""
    row, column = np.nonzero(np.isfinite(depth) & (depth > 0.0))
    z = depth[row, column]
    seen = np.column_stack([(column - camera.cx) * z / camera.fx, (row - camera.cy) * z / camera.fy, z])
    points: Array = seen @ camera.pose[:3, :3].T + camera.pose[:3, 3]
    return points


def off_the_arm(arm: Arm, q: Array, points: Array, grow: float = GROW) -> npt.NDArray[np.bool_]:
    """Which points (N, 3) are not on the arm at joint positions q (nv,), grown by `grow` [m]."""
    keep, body = np.ones(len(points), dtype=bool), arm.body
    assert body.levels is not None
    for link, mean, covariance, level in zip(
        body.links, body.means, body.covariances, body.levels, strict=True
    ):
        X = arm.robot.pose(q, link)
        y = (points - X[:3, 3]) @ X[:3, :3] - mean  # in the frame of the link, from the ellipsoid's centre
        squares, axes = np.linalg.eigh(level * covariance)  # of its half axes
        keep &= (((y @ axes) / (np.sqrt(squares) + grow)) ** 2).sum(axis=1) > 1.0
    return keep


def update_by_recipe(
    controller: Controller, arm: Arm, camera: DepthCamera, frame: Frame
) -> tuple[int, list[float]]:
    """Gives a controller what an image shows; the number of balls and the times of `STAGES` [s].

    Balls are taken off the arm after merging, which is faster than before it.
    """
    marks = [perf_counter()]
    points = points_of(camera, frame.unit * frame.depth)
    marks.append(perf_counter())
    points, radii = merge_in_voxels(points, np.full(len(points), RADIUS), voxel=VOXEL)
    marks.append(perf_counter())
    assert frame.q is not None
    keep = off_the_arm(arm, frame.q, points)
    marks.append(perf_counter())
    controller.set_obstacles(Obstacles(points[keep], radii[keep]), SOURCE, valid_for=np.inf)
    marks.append(perf_counter())
    return int(keep.sum()), list(np.diff(marks))
