"""Goals, recovery and diagnosis from Python, on a real arm."""

import numpy as np
import pytest

import sidestep as ss
from sidestep import thesis
from sidestep._core import MotionState, StepStatus
from sidestep.obstacles import pose_at
from sidestep.system import ClearanceBarrier, CoordinateKind, GeometricSystem, JointLimitBarrier, is_fallback


@pytest.fixture(scope="module")
def robot() -> ss.Robot:
    return ss.Robot.named("fr3")


@pytest.fixture(scope="module")
def system(robot: ss.Robot) -> GeometricSystem:
    """Balls of 8 cm around the origins of four links."""
    links = ["fr3_link4", "fr3_link5", "fr3_link6", "fr3_link7"]
    covariances = [0.08**2 * np.eye(3)] * 4
    body = ss.Body(
        links=links, weights=np.ones(4), means=np.zeros((4, 3)), covariances=covariances, levels=np.ones(4)
    )
    return GeometricSystem([ClearanceBarrier(robot, body), JointLimitBarrier(robot)])


def test_a_goal_as_an_array_is_a_joint_goal(robot: ss.Robot, system: GeometricSystem) -> None:
    q, v, free = robot.neutral, np.full(7, 0.1), ss.Obstacles.none()
    plain = system.acceleration(q, v, q + 0.1, free)
    goal = system.acceleration(q, v, ss.JointGoal(q + 0.1), free)
    np.testing.assert_array_equal(plain.acceleration, goal.acceleration)
    moving = system.acceleration(q, v, ss.JointGoal(q + 0.1, np.full(7, 0.2)), free)
    # damping 1.5 acts on v - v* instead of v
    np.testing.assert_allclose(moving.acceleration - plain.acceleration, 1.5 * 0.2, rtol=1e-12)


def test_the_pull_of_a_pose_is_the_gradient_of_its_potential(
    robot: ss.Robot, system: GeometricSystem
) -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        pose = robot.pose(robot.random_configuration(rng), "fr3_hand")
        goal, q = ss.PoseGoal(robot, "fr3_hand", pose), robot.random_configuration(rng)

        def potential(at: np.ndarray, goal: ss.PoseGoal = goal) -> float:
            return system.acceleration(at, np.zeros(7), goal, ss.Obstacles.none()).goal_potential

        slopes = [(potential(q + d) - potential(q - d)) / 2e-6 for d in 1e-6 * np.eye(7)]
        step = system.acceleration(q, np.zeros(7), goal, ss.Obstacles.none())
        if step.diagnosis.rotation_error < 3.1:  # not on the ridge of half turns
            np.testing.assert_allclose(step.goal_gradient, slopes, atol=1e-7)  # rounding of U over the step


def test_a_rotation_of_three_digits_is_normalised_with_a_warning(robot: ss.Robot) -> None:
    x, y, z, w = 0.924, -0.383, 0.01, 0.005  # as in a message, used as if its norm were 1
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    off = np.abs(rotation.T @ rotation - np.eye(3)).max()
    with pytest.warns(
        RuntimeWarning, match=rf"an entry of R\^T R - 1 is {off:.2g}; the nearest rotation is taken"
    ):
        goal = ss.PoseGoal(robot, "fr3_hand", pose_at([0.4, 0.0, 0.4], rotation))
    R = np.asarray(goal.pose)[:3, :3]
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)  # rounding
    assert np.abs(R - rotation).max() < off  # no farther than it was off
    with pytest.warns(RuntimeWarning, match="the nearest rotation is taken"):
        box = ss.Box((0.1, 0.1, 0.1), pose_at([0.4, 0.0, 0.4], rotation))
    np.testing.assert_allclose(box.pose[:3, :3], R, atol=1e-12)  # rounding
    with pytest.raises(ValueError, match=r"an entry of R\^T R - 1 is 0.0"):  # two digits: 1 degree is lost
        ss.PoseGoal(robot, "fr3_hand", pose_at([0.4, 0.0, 0.4], np.diag([1.0, 0.99, 0.99])))


def test_a_bad_pose_is_named(robot: ss.Robot, system: GeometricSystem) -> None:
    with pytest.raises(ValueError, match="fr3_hand"):  # lists the known ones
        ss.PoseGoal(robot, "gripper", np.eye(4))
    with pytest.raises(
        ValueError,
        match=r"no joint of robot 'fr3' moves frame 'fr3_link0'; those that one moves: .*fr3_link1",
    ):
        ss.PoseGoal(robot, "fr3_link0", np.eye(4))
    with pytest.raises(ValueError, match=r"not a rotation: an entry of R\^T R - 1 is 3, "):
        ss.PoseGoal(robot, "fr3_hand", 2.0 * np.eye(4))
    with pytest.raises(ValueError, match="mirrors, so it is not a rotation"):
        ss.PoseGoal(robot, "fr3_hand", np.diag([1.0, 1.0, -1.0, 1.0]))
    q, free = robot.neutral, ss.Obstacles.none()
    with pytest.raises(ValueError, match=r"pose\[0, 0\] is nan, must be a finite number"):
        ss.PoseGoal(robot, "fr3_hand", np.full((4, 4), np.nan))
    far = ss.PoseGoal(robot, "fr3_hand", [3.0, 0.0, 0.0], position_only=True)
    assert system.acceleration(q, np.zeros(7), far, free).status == StepStatus.goal_out_of_reach


def test_an_arm_found_inside_moves_out_and_says_so(robot: ss.Robot, system: GeometricSystem) -> None:
    q = robot.neutral
    # Not link5 or link6, whose origins coincide: rounding tells which of them is nearer.
    beside = robot.pose(q, "fr3_link7")[:3, 3] + [0.0, 0.09, 0.0]
    ball = ss.Obstacles([beside], 0.04)  # 3 cm deep
    step = system.acceleration(q, np.zeros(7), q, ball)
    assert step.status == StepStatus.inside_barrier
    assert not is_fallback(step.status)
    assert step.diagnosis.state == MotionState.inside_barrier
    assert step.diagnosis.kind == CoordinateKind.obstacle
    assert (step.diagnosis.name, step.diagnosis.point) == ("fr3_link7", 0)
    assert step.diagnosis.clearance == pytest.approx(-0.03)
    assert str(step.diagnosis) == (
        "link fr3_link7 is inside the barrier of obstacle point 0, 30 mm deep, and moves out"
    )
    motion = thesis.rollout(system, q, np.zeros(7), q, ball, steps=5000)
    assert motion.statuses[-1] == StepStatus.ok
    # the push asks for 2 m/s^2 along h, and the rebound for about 1 rad/s
    assert np.linalg.norm(motion.acceleration, axis=1).max() < 40.0
    assert np.linalg.norm(motion.v, axis=1).max() < 3.0


def test_a_blocked_goal_has_a_clearance_below_the_floor(robot: ss.Robot, system: GeometricSystem) -> None:
    q = robot.neutral
    on_it = ss.Obstacles([robot.pose(q, "fr3_link6")[:3, 3] + [0.0, 0.1, 0.0]], 0.03)
    assert system.goal_clearance(q, on_it) == pytest.approx(-0.01, abs=2e-3)  # another link may be nearer
    assert system.goal_clearance(q, ss.Obstacles.none()) > 0.0
