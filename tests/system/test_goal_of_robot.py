"""A pose goal is for the robot that it was made for."""

import pytest

import sidestep as ss
from sidestep import thesis
from sidestep._core import StepStatus
from sidestep.system import GeometricSystem


def pose_goal(robot: ss.Robot) -> ss.PoseGoal:
    frame = next(f.name for f in robot.frames if f.joint == len(robot.joints) - 1)
    return ss.PoseGoal(robot, frame, robot.pose(robot.neutral, frame))


def status(robot: ss.Robot, goal: ss.PoseGoal) -> StepStatus:
    system = GeometricSystem([], robot=robot)
    q = robot.neutral
    step = system.acceleration(q, 0 * q, goal, ss.Obstacles.none())
    motion = thesis.rollout(system, q, 0 * q, goal, ss.Obstacles.none(), steps=2)
    assert set(motion.statuses) == {step.status}
    return step.status


@pytest.mark.parametrize(("name", "other"), [("fr3", "panda"), ("ur5", "ur10")])
def test_another_robot_with_as_many_joints_is_an_invalid_goal(name, other):
    one, two = ss.Robot.named(name), ss.Robot.named(other)
    assert one.num_coordinates == two.num_coordinates
    assert len(one.joints) == len(two.joints)
    assert status(one, pose_goal(two)) == StepStatus.invalid_goal
    assert status(two, pose_goal(one)) == StepStatus.invalid_goal


def test_the_same_robot_made_again_is_the_same():
    one, again = ss.Robot.named("ur5"), ss.Robot.named("ur5")
    assert status(again, pose_goal(one)) == StepStatus.ok
