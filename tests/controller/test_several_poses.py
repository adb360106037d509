"""Goals of several frames at once, and of some of them alone: two arms on a torso."""

import numpy as np
import pytest

import sidestep as ss

LINK = """<link name="{n}"><inertial><origin xyz="0.12 0 0"/><mass value="1"/>
  <inertia ixx="0.001" iyy="0.006" izz="0.006" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><origin xyz="0.12 0 0"/><geometry><sphere radius="0.05"/></geometry></collision></link>"""
JOINT = """<joint name="{n}" type="revolute"><origin xyz="{xyz}"/><parent link="{p}"/><child link="{c}"/>
  <axis xyz="{axis}"/>
  <limit lower="-2.5" upper="2.5" velocity="2" effort="60"/></joint>"""


def two_arms():
    parts = ['<robot name="twins"><link name="base"/>', LINK.format(n="torso")]
    parts.append(JOINT.format(n="waist", xyz="0 0 0", p="base", c="torso", axis="0 0 1"))
    for side, y in (("left", 0.25), ("right", -0.25)):
        parent, place = "torso", f"0.2 {y} 0"
        for k, axis in enumerate(("0 0 1", "0 1 0", "0 1 0", "1 0 0"), 1):
            parts += [LINK.format(n=f"{side}{k}")]
            parts.append(JOINT.format(n=f"{side}_j{k}", xyz=place, p=parent, c=f"{side}{k}", axis=axis))
            parent, place = f"{side}{k}", "0.25 0 0"
    return "".join(parts) + "</robot>"


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path_factory.mktemp("cache")))
        yield ss.Arm.load(two_arms(), draft=True)


def goals(arm, q, sides=("left", "right")):
    robot = arm.robot
    return [ss.PoseGoal(robot, f"{s}4", robot.pose(q, f"{s}4")[:3, 3], position_only=True) for s in sides]


def run(arm, goal, q, steps=6000, **settings):
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True, **settings))
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(goal)
    v, least = np.zeros_like(q), np.inf
    for _ in range(steps):
        command = controller.step(q, v)
        least = min(least, command.clearance)
        v = v + 0.001 * command.acceleration
        q = q + 0.001 * v
    return q, least, controller


def distance(arm, goal, q):
    return float(np.linalg.norm(arm.robot.pose(q, goal.frame)[:3, 3] - goal.pose[:3, 3]))


@pytest.mark.slow
@pytest.mark.parametrize("planner", [True, False])
def test_two_arms_reach_a_pose_each(arm, planner):
    wanted = np.array([0.3, 0.4, 0.5, -0.6, 0.2, -0.4, 0.6, -0.5, 0.1])
    both = goals(arm, wanted)
    q, least, controller = run(arm, both, np.zeros(9), **({} if planner else {"planner": None}))
    assert controller.command.activity.name == "arrived"
    for goal in both:
        assert distance(arm, goal, q) < 1e-3
    assert least > 0.0


def test_an_arm_without_a_goal_stays(arm):
    start = np.zeros(9)
    (left,) = goals(arm, np.array([0.0, 0.4, 0.5, -0.6, 0.2, 0.0, 0.0, 0.0, 0.0]), ("left",))
    q, _, _ = run(arm, left, start)
    assert distance(arm, left, q) < 1e-3
    assert np.abs(q[5:]).max() < 1e-3  # the right one; the waist may turn


def test_poses_that_move_are_followed_at_the_same_time(arm):
    robot, start = arm.robot, np.array([0.0, 0.3, 0.5, -0.6, 0.0, -0.3, 0.5, -0.6, 0.0])
    moving = [
        ss.PoseGoal(
            robot,
            f"{side}4",
            robot.pose(start, f"{side}4")[:3, 3],
            position_only=True,
            twist=[0.0, 0.0, speed, 0.0, 0.0, 0.0],
        )
        for side, speed in (("left", 0.05), ("right", -0.05))
    ]
    q, _, _ = run(arm, moving, start, steps=2000)
    for goal, rise in zip(moving, (0.1, -0.1), strict=True):
        assert robot.pose(q, goal.frame)[2, 3] - goal.pose[2, 3] == pytest.approx(rise, abs=0.01)


def test_goals_that_cannot_be_one_are_refused(arm):
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True))
    left, right = goals(arm, np.zeros(9))
    with pytest.raises(ValueError, match="frame 'left4' has two poses"):
        controller.set_goal([left, right, left])
    other = ss.PoseGoal(ss.Arm.load("fr3").robot, "fr3_hand", np.eye(4))
    with pytest.raises(ValueError, match="other joints"):
        controller.set_goal([left, other])
    with pytest.raises(TypeError, match="pose goals alone"):
        controller.set_goal([left, np.zeros(9)])
