"""A goal that is unusable does not switch avoidance off."""

import numpy as np
import pytest

import sidestep as ss
from sidestep._core import StepStatus

# Of the hand, from where nothing of the arm itself is in a ball's way.
FREE_SIDES = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]


@pytest.fixture(scope="module")
def robot() -> ss.Robot:
    return ss.Robot.named("fr3")


def bad_goals(robot: ss.Robot) -> dict[str, object]:
    outside = robot.neutral.copy()
    outside[1] = robot.limits.upper[1] + 0.1
    drifts = np.zeros(7)
    drifts[3] = 0.1
    at_limit = robot.neutral.copy()
    at_limit[3] = robot.limits.upper[3] - 0.05
    return {
        "not finite": np.full(7, np.nan),
        "outside the limits": outside,
        "drifts over a limit": ss.JointGoal(at_limit, drifts),
    }


@pytest.mark.slow
@pytest.mark.parametrize("side", FREE_SIDES)
@pytest.mark.parametrize("kind", ["not finite", "outside the limits", "drifts over a limit"])
def test_a_slow_ball_does_not_touch_an_arm_with_a_bad_goal(
    robot: ss.Robot, kind: str, side: tuple[float, float, float]
) -> None:
    # A ball of 5 cm comes at the hand by 0.1 m/s from 30 cm away, and passes where the hand was.
    q = robot.neutral
    hand = robot.pose(q, "fr3_hand")[:3, 3]
    away = np.array(side)
    ball = ss.Obstacles([hand + 0.3 * away], radii=[0.05], velocities=[-0.1 * away])
    settings = ss.ControllerSettings(synchronous=True, planner=None, look_ahead=None)
    controller, goal = ss.Controller(ss.Arm.from_robot(robot), settings), bad_goals(robot)[kind]
    if kind == "drifts over a limit":
        controller.set_goal(goal)
    else:
        with pytest.raises(ValueError, match="controller: "):
            controller.set_goal(goal)
    controller.set_obstacles(ball, valid_for=np.inf)
    motion = ss.integrate(controller, q, np.zeros(7), steps=4500)
    exact = ss.ExactClearance(robot, [ss.SceneObject("ball", "sphere", size=(0.05,))])
    times = np.arange(0, len(motion.q), 20)
    least = min(
        exact.distance(motion.q[k], [[*(hand + (0.3 - 1e-4 * k) * away), 1.0, 0.0, 0.0, 0.0]]).distance
        for k in times
    )
    assert least > 0.0


def test_the_controller_keeps_the_clearances_with_a_bad_goal(robot: ss.Robot) -> None:
    q, v, goals = robot.neutral, np.full(7, 0.2), bad_goals(robot)
    hand = robot.pose(q, "fr3_hand")[:3, 3]
    controller = ss.Controller(ss.Arm.from_robot(robot), ss.ControllerSettings(synchronous=True))
    controller.set_obstacles(ss.Obstacles([hand + np.array([0.0, 0.12, 0.0])], radii=[0.05]))

    def begins_anew() -> ss.Command:
        controller.step(np.full(7, np.nan), v)
        return controller.step(q, v)

    for kind in ("not finite", "outside the limits"):
        with pytest.raises(ValueError, match="controller: "):
            controller.set_goal(goals[kind])
        assert begins_anew().bound_by >= 0
    controller.set_goal(goals["drifts over a limit"])
    for _ in range(350):
        command = begins_anew()
        assert command.bound_by >= 0
    assert controller.geometric_step.status == StepStatus.goal_outside_limits
    assert command.activity == ss.Activity.blocked
