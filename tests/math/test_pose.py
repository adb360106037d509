"""Rotations against SciPy's, pose vectors there and back, and what is no pose."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sidestep.math.pose import (
    about_axis,
    checked_pose,
    from_roll_pitch_yaw,
    look_at,
    moved,
    pose_at,
    pose_matrix,
    pose_vector,
    rotation_vector,
)


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


def test_quaternions_and_pose_vectors_agree_with_scipy() -> None:
    rng = np.random.default_rng(1)
    for _ in range(200):
        turn = Rotation.random(random_state=rng)
        pose = pose_at(rng.normal(size=3), turn.as_matrix())
        vector = pose_vector(pose)
        w, *xyz = vector[3:]
        assert w >= 0.0
        # products of numbers up to 1, and a quaternion found again by a square root
        np.testing.assert_allclose(
            Rotation.from_quat([*xyz, w]).as_matrix(), pose[:3, :3], rtol=0, atol=1e-14
        )
        np.testing.assert_allclose(pose_matrix(vector), pose, rtol=0, atol=1e-14)


def test_points_are_moved_as_by_the_matrix() -> None:
    pose = pose_at([1.0, 2.0, 3.0], about_axis(np.array([0.0, 0.0, 1.0]), np.pi / 2))
    np.testing.assert_allclose(moved(np.array([[[1.0, 0.0, 0.0]]]), pose), [[[1.0, 3.0, 3.0]]], atol=1e-15)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (np.eye(3), r"arm: pose has shape \(3, 3\), expected \(4, 4\)"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "arm: pose is not a rigid transform"),
        (np.diag([1.0, 1.0, 1.0, 2.0]), "arm: pose is not a rigid transform"),
        (1.001 * np.eye(4), "arm: pose is not a rigid transform"),
        (np.full((4, 4), np.nan), "arm: pose is not a rigid transform"),
    ],
)
def test_what_is_no_pose_is_refused(value: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        checked_pose(value, "arm: pose")


def test_a_rotation_vector_is_the_logarithm() -> None:
    rng = np.random.default_rng(0)
    for angle in (0.0, 1e-12, 1e-4, 1.0, 3.0, np.pi - 1e-6):
        axis = rng.normal(size=3)
        vector = angle * axis / np.linalg.norm(axis)
        rotation = Rotation.from_rotvec(vector).as_matrix()
        np.testing.assert_allclose(
            rotation_vector(rotation), vector, atol=1e-9
        )  # digits lost near half a turn
    for axis in np.eye(3):
        half = rotation_vector(2.0 * np.outer(axis, axis) - np.eye(3))
        np.testing.assert_allclose(np.abs(half), np.pi * axis, atol=1e-12)


def test_the_order_of_a_quaternion_is_stated_by_name() -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        q = rng.normal(size=4)
        q /= np.linalg.norm(q)
        X = pose_at([0.1, 0.2, 0.3], xyzw=q)
        # a handful of products of numbers below 1
        np.testing.assert_allclose(X[:3, :3], Rotation.from_quat(q).as_matrix(), rtol=0, atol=3e-15)
        # the norm is summed in another order
        np.testing.assert_allclose(pose_at([0.1, 0.2, 0.3], wxyz=np.roll(q, 1)), X, rtol=0, atol=3e-15)
        np.testing.assert_array_equal(X[:, 3], [0.1, 0.2, 0.3, 1.0])
    rounded = pose_at(np.zeros(3), wxyz=[0.707, 0.707, 0.0, 0.0])  # three digits: normalised
    np.testing.assert_allclose(rounded[:3, :3] @ rounded[:3, :3].T, np.eye(3), rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (
            {"rotation": [0.0, 0.0, 0.0, 1.0]},
            r"rotation has shape \(4,\), expected \(3, 3\); .*xyzw=q .* wxyz=q",
        ),
        ({"rotation": np.eye(2)}, r"rotation has shape \(2, 2\), expected \(3, 3\)$"),
        ({"xyzw": [0.0, 0.0, 1.0]}, r"xyzw has shape \(3,\), expected \(4,\)"),
        (
            {"xyzw": np.zeros(4)},
            r"quaternion xyzw \[0\.0, .*\] has norm 0, must be 1; is the message empty\?",
        ),
        ({"wxyz": [1.1, 0.0, 0.0, 0.0]}, r"quaternion wxyz \[1\.1, .*\] has norm 1\.1, must be 1$"),
        ({"wxyz": [np.nan, 0.0, 0.0, 0.0]}, "has norm nan, must be 1"),
        (
            {"xyzw": [0.0, 0.0, 0.0, 1.0], "wxyz": [1.0, 0.0, 0.0, 0.0]},
            "xyzw and wxyz are given, allowed: one",
        ),
    ],
)
def test_what_is_no_turn_is_named(given: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        pose_at([0.0, 0.0, 0.0], **given)


def test_what_is_no_translation_is_named() -> None:
    with pytest.raises(ValueError, match=r"translation has shape \(2,\), expected \(3,\)"):
        pose_at([0.0, 0.0])


@pytest.mark.parametrize(
    ("eye", "target"),
    [
        ((1.5, 0.4, 0.9), (0.2, -0.1, 0.3)),
        ((0.0, 0.0, 2.0), (0.0, 0.0, 0.0)),
        ((0.1, 0.2, 0.0), (0.1, 0.2, 3.0)),
    ],
)
def test_a_camera_looks_at_its_target(eye: tuple[float, ...], target: tuple[float, ...]) -> None:
    X_WC = look_at(eye, target)
    R = X_WC[:3, :3]
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0, abs=1e-12)
    seen = R.T @ (np.array(target) - X_WC[:3, 3])
    distance = np.linalg.norm(np.subtract(target, eye))
    np.testing.assert_allclose(seen, [0.0, 0.0, distance], atol=1e-12)  # on the optical axis
    assert R[2, 0] == pytest.approx(0.0, abs=1e-12)  # the horizon is level
    assert R[2, 1] <= 1e-12  # y points down


def test_up_turns_the_image() -> None:
    # looks along the world's x with its y axis up: right is then up in the world
    np.testing.assert_allclose(
        look_at((0, 0, 0), (1, 0, 0), up=(0, 2, 0))[:3, :3].T, [[0, 0, 1], [0, -1, 0], [1, 0, 0]], atol=1e-12
    )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (((0, 0, 0), (0, 0, 0)), "two points apart"),
        (((0, 0, float("inf")), (0, 0, 0)), "finite numbers"),
        (((0, 0), (0, 0, 0)), r"look_at: eye has shape \(2,\)"),
    ],
)
def test_a_view_that_is_none_is_refused(arguments: tuple, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        look_at(*arguments)
