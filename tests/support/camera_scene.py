"""A camera before an FR3, a ball and a wall: depth images by casting rays at ellipsoids, a sphere and a plane."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sidestep import Arm
from sidestep.math.pose import look_at
from sidestep.perception import CameraRecord, FolderWriter, Frame

WIDTH, HEIGHT, FOCAL = 160, 120, 120.0  # [pixel]
BALL, RADIUS = np.array([0.3, 0.55, 0.5]), 0.1  # [m]
WALL = -0.7  # [m] x of a plane behind the arm
HOLES = 3  # columns at the left without depth
LINK_SHARE = 0.6  # of the semi-axes of the cover: what the links surely fill
START = 100.0  # [s]
RATE = 30.0  # [Hz]


CAMERA = CameraRecord(
    "front",
    WIDTH,
    HEIGHT,
    FOCAL,
    FOCAL,
    0.5 * (WIDTH - 1),
    0.5 * (HEIGHT - 1),
    pose=look_at([1.5, 0.2, 0.7], [0.0, 0.2, 0.45]),
)


def rendered(arm: Arm, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Depth (H, W) [m], and what is seen: 0 nothing, 1 the arm, 2 the ball, 3 the wall."""
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    rays = np.stack([(u - CAMERA.cx) / FOCAL, (v - CAMERA.cy) / FOCAL, np.ones_like(u)], axis=-1)
    X = CAMERA.pose
    directions, eye = rays @ X[:3, :3].T, X[:3, 3]
    depth = (WALL - eye[0]) / directions[..., 0]
    seen = np.full(depth.shape, 3)
    ball = _ellipsoid(directions, eye, BALL, RADIUS**2 * np.eye(3))
    seen[ball < depth], depth = 2, np.minimum(depth, ball)
    body = arm.body
    for link, mean, covariance, level in zip(
        body.links, body.means, body.covariances, body.levels, strict=True
    ):
        pose = arm.robot.pose(q, link)
        shape = LINK_SHARE**2 * level * pose[:3, :3] @ covariance @ pose[:3, :3].T
        part = _ellipsoid(directions, eye, pose[:3, :3] @ mean + pose[:3, 3], shape)
        seen[part < depth], depth = 1, np.minimum(depth, part)
    depth[:, :HOLES], seen[:, :HOLES] = 0.0, 0
    return depth, seen


def _ellipsoid(directions: np.ndarray, eye: np.ndarray, centre: np.ndarray, shape: np.ndarray) -> np.ndarray:
    """Depth at which rays enter {p : (p - c)ᵀ S⁻¹ (p - c) <= 1}; inf where they do not."""
    inverse, away = np.linalg.inv(shape), centre - eye
    a = np.einsum("...i,ij,...j", directions, inverse, directions)
    b = directions @ inverse @ away
    root = b * b - a * (away @ inverse @ away - 1.0)
    return np.where(root >= 0.0, (b - np.sqrt(np.maximum(root, 0.0))) / a, np.inf)


def configurations(arm: Arm, count: int) -> list[np.ndarray]:
    """A slow turn of the first joint from the middle."""
    turned = np.zeros(arm.num_coordinates)
    turned[0] = 0.02
    return [arm.neutral + n * turned for n in range(count)]


def write_recording(
    path: Path, arm: Arm, *, count: int = 5, lost: Sequence[int] = (), joints: bool = True
) -> list[np.ndarray]:
    """Writes a folder at 30 Hz without the images `lost`; returns the q of those that are in it."""
    names = list(arm.robot.coordinate_names) if joints else []
    written = []
    with FolderWriter(path, [CAMERA], joint_names=names) as writer:
        for n, q in enumerate(configurations(arm, count)):
            if n in lost:
                continue
            depth = np.round(1000.0 * rendered(arm, q)[0]).astype(np.uint16)
            writer.add(Frame("front", START + n / RATE, depth, 0.001, q=q if joints else None))
            written.append(q)
    return written
