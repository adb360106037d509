"""Rigid poses: rotations (3, 3), poses (4, 4), and MuJoCo's pose vectors (7,)."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sidestep._core import real_array
from sidestep.math.matrices import determinant, product

Array = npt.NDArray[np.float64]

ROUNDED = (
    0.01  # largest entry of |R Rᵀ - 1| that counts as rounding: a quaternion of three digits has up to 0.008
)
NO_TURN = 1e-9  # sine of an angle that is none, or half a turn
ALONG = 1e-6  # sine of the angle to a direction that is along it
ROUNDED_NORM = 0.01  # from 1: four entries of a quaternion that are rounded to two digits


def about_axis(axis: Array, angle: float) -> Array:
    """The rotation (3, 3) by `angle` [rad] about a unit axis (3,), by Rodrigues' formula
    R = 1 + sin(angle) K + (1 - cos(angle)) K^2 with K x = axis × x."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Array = np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * product(cross, cross)
    return rotation


def from_roll_pitch_yaw(rpy: Sequence[float]) -> Array:
    """The rotation (3, 3) by roll, pitch, yaw [rad] about the fixed x, y and z axes, in this order."""
    x, y, z = np.eye(3)
    return product(product(about_axis(z, rpy[2]), about_axis(y, rpy[1])), about_axis(x, rpy[0]))


def from_quaternion(quaternion: Array) -> Array:
    """The rotation (3, 3) of a unit quaternion (w, x, y, z)."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def rotation_vector(rotation: Array) -> Array:
    """The axis times the angle (3,) [rad] in [0, pi] of a rotation (3, 3): its logarithm."""
    axis = 0.5 * np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    sine, cosine = float(np.linalg.norm(axis)), 0.5 * (float(np.trace(rotation)) - 1.0)
    if sine < NO_TURN and cosine < 0.0:  # half a turn: the axis is in the symmetric part
        along = (rotation + np.eye(3))[:, int(np.argmax(np.diag(rotation)))]
        return np.asarray(np.pi * along / np.linalg.norm(along))
    return np.asarray(axis * (math.atan2(sine, cosine) / sine if sine > NO_TURN else 1.0))


def pose_at(
    translation: npt.ArrayLike,
    rotation: npt.ArrayLike | None = None,
    *,
    xyzw: npt.ArrayLike | None = None,
    wxyz: npt.ArrayLike | None = None,
) -> Array:
    """A pose (4, 4) at a translation, turned by a rotation or a unit quaternion, or not at all.

    Args:
        translation: (3,) [m].
        rotation: (3, 3).
        xyzw: quaternion (4,) with the real part last, as ROS, SciPy and PyBullet write it.
        wxyz: quaternion (4,) with the real part first, as MuJoCo, Drake and Eigen's constructor write it.

    Raises:
        ValueError: a shape is another, more than one turn is given, or a quaternion's norm is not 1 but for rounding to
            two digits, which is made up for; names the value and what is allowed.
    """
    X = np.eye(4)
    X[:3, 3] = _shaped(translation, "translation", (3,))
    given = [
        name for name, value in (("rotation", rotation), ("xyzw", xyzw), ("wxyz", wxyz)) if value is not None
    ]
    if len(given) > 1:
        raise ValueError(f"pose_at: {' and '.join(given)} are given, allowed: one of them")
    if rotation is not None:
        X[:3, :3] = _shaped(rotation, "rotation", (3, 3))
    elif xyzw is not None:
        X[:3, :3] = from_quaternion(np.roll(_unit_quaternion(xyzw, "xyzw"), 1))
    elif wxyz is not None:
        X[:3, :3] = from_quaternion(_unit_quaternion(wxyz, "wxyz"))
    return X


def look_at(eye: npt.ArrayLike, target: npt.ArrayLike, *, up: npt.ArrayLike = (0.0, 0.0, 1.0)) -> Array:
    """The pose X_WC (4, 4) of a camera's optical frame (x right, y down, z forward) at `eye` that looks at `target`.

    Args:
        eye, target: (3,) in the world [m].
        up: (3,) direction in the world that is up in the image. Where the camera looks along it, the world's y axis
            is up, or its x axis.

    Raises:
        ValueError: a shape is another, an entry is not finite, the points are one, or `up` is 0.
    """
    start, end, upward = (
        _shaped(value, name, (3,), owner="look_at")
        for value, name in ((eye, "eye"), (target, "target"), (up, "up"))
    )
    forward = end - start
    distance, length = float(np.linalg.norm(forward)), float(np.linalg.norm(upward))
    if not (math.isfinite(distance + length) and distance > 0.0 and length > 0.0):
        raise ValueError(
            f"look_at: eye {start.tolist()}, target {end.tolist()}, up {upward.tolist()}: allowed are finite numbers, "
            "two points apart from each other, and a direction that is not 0"
        )
    z = forward / distance
    for candidate in (upward / length, np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])):
        x = np.cross(z, candidate)
        if np.linalg.norm(x) > ALONG:
            break
    x /= np.linalg.norm(x)
    return pose_at(start, np.column_stack([x, np.cross(z, x), z]))


def _shaped(value: npt.ArrayLike, name: str, shape: tuple[int, ...], *, owner: str = "pose_at") -> Array:
    array: Array = real_array(value, name)
    if array.shape == shape:
        return array
    words = f"{owner}: {name} has shape {array.shape}, expected {shape}"
    if name == "rotation" and array.shape == (4,):
        words += (
            "; state the order of a quaternion: xyzw=q as of ROS and SciPy, or wxyz=q as of MuJoCo and Drake"
        )
    raise ValueError(words)


def _unit_quaternion(value: npt.ArrayLike, name: str) -> Array:
    quaternion = _shaped(value, name, (4,))
    norm = float(np.linalg.norm(quaternion))
    if not abs(norm - 1.0) <= ROUNDED_NORM:
        cause = "; is the message empty?" if norm == 0.0 else ""
        raise ValueError(
            f"pose_at: quaternion {name} {quaternion.tolist()} has norm {norm:.4g}, must be 1{cause}"
        )
    return quaternion / norm


def checked_pose(value: npt.ArrayLike, owner: str, *, tolerance: float = 1e-6) -> Array:
    """A copy of a pose (4, 4) that cannot be written to.

    Args:
        value: the pose.
        owner: what an error calls it.
        tolerance: on R Rᵀ - 1. Up to 0.01, as of a pose that was written down with three digits, the nearest rotation
            is taken, with a warning that says by how much.

    Raises:
        ValueError: it is not a rigid transform with finite entries; says by how much.
    """
    X = real_array(value, owner).copy()
    if X.shape != (4, 4):
        raise ValueError(f"{owner} has shape {X.shape}, expected (4, 4): a rigid transform")
    if not (np.isfinite(X).all() and np.array_equal(X[3], [0.0, 0.0, 0.0, 1.0])):
        raise ValueError(f"{owner} is not a rigid transform (rotation, translation, last row 0 0 0 1):\n{X}")
    X[:3, :3] = checked_rotation(X[:3, :3], owner, tolerance=tolerance)
    X.setflags(write=False)
    return X


def checked_rotation(R: Array, owner: str, *, tolerance: float) -> Array:
    """The rotation (3, 3) that a matrix is but for rounding; warns where that is more than `tolerance` on R Rᵀ - 1.

    Raises:
        ValueError: the matrix mirrors, or is no rotation by more than rounding; says by how much.
    """
    off = float(np.abs(product(R, R.T) - np.eye(3)).max())
    mirrors = float(determinant(R)) <= 0.0
    if off <= ROUNDED and not mirrors:
        if off <= tolerance:
            return R
        warnings.warn(
            f"{owner}: its rotation R was rounded, an entry of R Rᵀ - 1 is {off:.2g}; the nearest rotation is taken: "
            "give more digits, or normalise the quaternion",
            RuntimeWarning,
            stacklevel=4,
        )
        U, _, V = np.linalg.svd(R)
        return np.asarray(U @ V)
    why = "it mirrors" if mirrors and off <= ROUNDED else f"an entry of R Rᵀ - 1 is {off:.2g}, not 0"
    raise ValueError(
        f"{owner} is not a rigid transform (rotation, translation, last row 0 0 0 1): {why}; a quaternion must have "
        f"norm 1, and scale has no place in a pose:\n{R}"
    )


def pose_matrix(vector: Array) -> Array:
    """(4, 4) pose of a (7,) position and quaternion (w, x, y, z)."""
    return pose_at(vector[:3], from_quaternion(vector[3:]))


def pose_vector(pose: Array) -> Array:
    """(7,) position and quaternion (w, x, y, z), w >= 0, of a (4, 4) pose."""
    from scipy.spatial.transform import Rotation  # here: importing it takes longer than loading a robot

    quaternion = np.roll(Rotation.from_matrix(pose[:3, :3]).as_quat(), 1)
    return np.concatenate([pose[:3, 3], quaternion if quaternion[0] >= 0.0 else -quaternion])


def moved(points: Array, pose: Array) -> Array:
    """Points (..., 3) of a frame at `pose` (4, 4), in the world."""
    world: Array = points @ pose[:3, :3].T + pose[:3, 3]
    return world
