"""Settings, goals, obstacles and arms are copied, pickled and compared by what they hold."""

from __future__ import annotations

import copy
import json
import pickle

import numpy as np
import pytest

import sidestep as ss


def changed_settings() -> ss.ControllerSettings:
    settings = ss.ControllerSettings(planner=None, output="position", speed=0.5, seed=7)
    settings.barriers.activation = 0.2
    settings.speed_limits = ss._core.SpeedLimitSettings(near_speed=0.2)
    return settings


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s))])
def test_settings_come_back_equal(again: object) -> None:
    settings = changed_settings()
    other = again(settings)  # type: ignore[operator]
    assert other == settings
    assert other != ss.ControllerSettings()
    assert other.barriers.activation == 0.2
    assert other.planner is None
    other.barriers.activation = 0.3
    assert other != settings  # a copy shares no part
    assert settings.barriers.activation == 0.2


def test_settings_are_a_dict_for_yaml_and_json() -> None:
    yaml = pytest.importorskip("yaml")
    settings = changed_settings()
    document = settings.to_dict()
    assert document["barriers"]["activation"] == 0.2
    assert document["planner"] is None
    assert document["output"] == "position"
    assert ss.ControllerSettings(**document) == settings
    assert ss.ControllerSettings(**yaml.safe_load(yaml.safe_dump(document))) == settings
    assert ss.ControllerSettings(**json.loads(json.dumps(document))) == settings
    assert ss.ControllerSettings(barriers={"activation": 0.2}).barriers.activation == 0.2


def test_a_dict_with_a_wrong_name_lists_the_right_ones() -> None:
    with pytest.raises(TypeError, match="BarrierSettings has no setting 'activatoin'; it has: stiffness"):
        ss.ControllerSettings(barriers={"activatoin": 0.2})
    with pytest.raises(ValueError, match=r"activation is 7"):
        ss.Controller(ss.Arm.load("planar2"), ss.ControllerSettings(barriers={"activation": 7.0}))


def test_settings_have_no_hash_because_they_change() -> None:
    with pytest.raises(TypeError, match="unhashable"):
        hash(ss.ControllerSettings())


def test_goals_and_obstacles_come_back() -> None:
    goal = ss.JointGoal([1.0, 2.0], [0.1, 0.2])
    assert pickle.loads(pickle.dumps(goal)) == goal
    assert copy.deepcopy(goal) != ss.JointGoal([1.0, 2.5], [0.1, 0.2])
    assert hash(copy.deepcopy(goal)) == hash(goal)
    assert ss.JointGoal([0.0] * 7) != ss.JointGoal([0.0] * 3)
    assert ss.JointGoal([0.0] * 3) != ss.JointGoal([0.0] * 7)
    seen = ss.Obstacles([[1.0, 2.0, 3.0], [0.0, 1.0, 0.0]], [0.1, 0.2], [[0.0, 0.0, 1.0]] * 2)
    seen = seen.named(["table", "cup"], [1, 1])
    again = pickle.loads(pickle.dumps(seen))
    np.testing.assert_array_equal(again.points, seen.points)
    np.testing.assert_array_equal(again.radii, seen.radii)
    np.testing.assert_array_equal(again.velocities, seen.velocities)
    assert again.groups == seen.groups == [("table", 1), ("cup", 1)]
    assert again == seen
    assert again != ss.Obstacles(seen.points, seen.radii, seen.velocities)  # without names
    assert again != ss.Obstacles.none()
    assert len(pickle.loads(pickle.dumps(ss.Obstacles.none()))) == 0


def test_an_arm_comes_back_with_what_it_is_prepared_from() -> None:
    arm = ss.Arm.load("fr3")
    again = pickle.loads(pickle.dumps(arm))
    assert again == arm
    assert hash(again) == hash(arm)
    assert again != ss.Arm.load("planar2")
    assert again.content_hash == arm.content_hash
    assert isinstance(again, ss.Arm)
    np.testing.assert_array_equal(again.neutral, arm.neutral)
    assert again.robot.name == "fr3"
    core = pickle.loads(pickle.dumps(ss._core.Arm(arm)))
    assert core.content_hash == arm.content_hash


def test_a_command_comes_back_whole() -> None:
    arm = ss.Arm.load("planar2")
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True, planner=None))
    controller.set_goal(arm.neutral + 0.1)
    controller.set_obstacles(ss.Obstacles([[0.6, 0.3, 0.0]], 0.05))
    command = controller.step(arm.neutral, 0.0 * arm.neutral)
    again = pickle.loads(pickle.dumps(command))
    names = [name for name in dir(command) if not name.startswith("_")]
    assert len(names) > 25
    for name in names:
        np.testing.assert_array_equal(getattr(again, name), getattr(command, name), err_msg=name)
    np.testing.assert_array_equal(copy.deepcopy(command).acceleration, command.acceleration)


def test_a_pose_goal_comes_back_and_is_followed_as_before() -> None:
    arm = ss.Arm.load("fr3")
    X = arm.robot.pose(arm.neutral + 0.1, "fr3_hand_tcp")
    goal = ss.PoseGoal(arm.robot, "fr3_hand_tcp", X, rest=arm.neutral, posture_stiffness=0.2)
    again = pickle.loads(pickle.dumps(goal))
    assert again == goal
    assert again != ss.PoseGoal(arm.robot, "fr3_hand", X)
    commands = []
    for one in (goal, again):
        controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True, seed=1))
        controller.set_obstacles(ss.Obstacles.none())
        controller.set_goal(one)
        commands.append([controller.step(arm.neutral, 0.0 * arm.neutral).acceleration for _ in range(3)][-1])
    np.testing.assert_array_equal(*commands)
