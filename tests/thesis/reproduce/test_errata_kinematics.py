"""Errata 1, 2 and 16: rotations of links."""

import numpy as np
from scipy.spatial.transform import Rotation

from sidestep import Obstacles, Robot
from sidestep._core import Body
from sidestep.thesis import CollisionDensity

ANGLES = np.array([0.4, -0.6, 0.9, -1.5, 0.7, 1.9, -0.3])


def factors(robot, q):
    """Rotation of each joint with its fixed placement in front, base first."""
    return [
        joint.placement[:3, :3] @ Rotation.from_rotvec(angle * joint.axis).as_matrix()
        for joint, angle in zip(robot.joints, q, strict=True)
    ]


def test_rotations_multiply_from_base_to_tip():
    robot = Robot.named("fr3_arm")
    parts = factors(robot, ANGLES)
    last = next(f for f in reversed(robot.frames) if f.joint == 6)
    truth = robot.pose(ANGLES, last.name)[:3, :3] @ last.placement[:3, :3].T
    # Products of seven rotations: rounding only.
    np.testing.assert_allclose(np.linalg.multi_dot(parts), truth, atol=1e-13)
    as_printed = np.linalg.multi_dot(parts[::-1])
    assert np.abs(as_printed - truth).max() > 0.1
    without_placements = np.linalg.multi_dot(
        [j.placement[:3, :3].T @ p for j, p in zip(robot.joints, parts, strict=True)][::-1]
    )
    assert np.abs(without_placements - truth).max() > 0.1


def test_derivative_of_a_rotation_is_s_times_r():
    def product(angle):
        return (Rotation.from_rotvec([angle, 0.0, 0.0]) * Rotation.from_rotvec([0.0, 0.8, 0.3])).as_matrix()

    h = 1e-5
    R, dR = product(0.4), (product(0.4 + h) - product(0.4 - h)) / (2 * h)
    S = dR @ R.T
    np.testing.assert_allclose(S, -S.T, atol=1e-9)  # central differences: error h² times a third derivative
    np.testing.assert_allclose(S @ R, dR, atol=1e-12)
    assert np.abs(R @ S - dR).max() > 0.1
    # For one rotation about a fixed axis the two orders agree, so the slip does not show there.
    single = Rotation.from_rotvec([0.4, 0.0, 0.0]).as_matrix()
    np.testing.assert_allclose(S @ single, single @ S, atol=1e-9)


def test_a_link_depends_on_all_joints_below_it():
    robot = Robot.named("fr3_arm")
    link = next(f.name for f in robot.frames if f.joint == 4)
    body = Body(links=[link], weights=[1.0], means=[[0.0, 0.0, 0.0]], covariances=[0.02 * np.eye(3)])
    density = CollisionDensity(robot, body)
    point = robot.pose(ANGLES, link)[:3, 3] + [0.05, 0.03, 0.02]
    slope = density.evaluate(ANGLES, np.zeros(7), Obstacles(point[None])).jacobian[0]
    # psi of link 5 as a function of (q5, q7) alone would have no slope by joints 1 to 4.
    assert np.all(np.abs(slope[[0, 1, 3]]) > 1e-3)
