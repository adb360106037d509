"""Escape: sub-goals where an arm is stuck."""

import numpy as np
import pytest

import sidestep as ss

PERIOD = 0.01


def pursue(escape, goal, q, potentials):
    return [np.array(escape.pursue(goal, q, u, PERIOD).position) for u in potentials]


@pytest.fixture
def robot():
    return ss.Robot.named("planar2")


def test_goal_is_followed_while_the_potential_falls(robot):
    escape = ss.Escape(robot, patience=0.1)
    followed = pursue(escape, [0.5, 0.5], [0.0, 0.0], 0.97 ** np.arange(200))
    np.testing.assert_array_equal(followed, np.full((200, 2), 0.5))
    assert escape.count == 0


def test_sub_goal_after_patience_lies_within_the_limits_and_ends_after_its_leg(robot):
    escape = ss.Escape(robot, patience=0.1, leg=0.5, spread=0.7, seed=3)
    # Falling potentials towards the sub-goal, so that only the length of the leg ends it.
    followed = pursue(escape, [0.5, 0.5], [-2.0, 2.0], [1.0] * 12 + list(0.9 ** np.arange(60)))
    away = np.array([not np.array_equal(row, [0.5, 0.5]) for row in followed])
    first = int(away.argmax())
    # The first potential belongs to no step, the second is the least so far; patience is out ten periods later, and
    # times that are sums of periods may round below it once.
    assert first in (11, 12)
    sub_goal = followed[first]
    assert np.all(np.abs(sub_goal - [-2.0, 2.0]) <= 0.7)
    assert np.any(np.abs(sub_goal - [-2.0, 2.0]) > 0.1)
    assert away.sum() in (50, 51)
    assert not away[-1]
    assert escape.count == 1


def test_sub_goal_that_cannot_be_neared_is_given_up_after_half_the_patience(robot):
    escape = ss.Escape(robot, patience=0.2, leg=10.0)
    followed = pursue(escape, [0.5, 0.5], [-2.0, 2.0], [1.0] * 60)
    away = np.array([not np.array_equal(row, [0.5, 0.5]) for row in followed])
    first = int(away.argmax())
    # Half of 20 periods, one whose potential is another goal's, and one for rounding.
    assert int((~away[first:]).argmax()) in (11, 12)


def test_sub_goals_lie_within_the_limits(robot):
    corner = robot.limits.upper
    for seed in range(5):
        for sub_goal in pursue(ss.Escape(robot, patience=0.1, seed=seed), [0.0, 0.0], corner, [1.0] * 20)[
            -5:
        ]:
            assert np.all(sub_goal <= corner)
            assert np.any(sub_goal < corner - 0.01)


def test_potentials_that_are_unknown_are_no_standstill(robot):
    escape = ss.Escape(robot, patience=0.1)
    pursue(escape, [0.5, 0.5], [-2.0, 2.0], [np.nan] * 100)
    assert escape.count == 0


def test_sub_goals_repeat_with_the_seed_and_differ_without(robot):
    def run(seed):
        return pursue(ss.Escape(robot, patience=0.1, seed=seed), [0.5, 0.5], [-2.0, 2.0], [1.0] * 40)

    np.testing.assert_array_equal(run(1), run(1))
    assert not np.array_equal(run(1), run(2))


def test_escape_leads_an_arm_out_of_a_local_minimum():
    robot = ss.Robot.named("planar2")
    body = ss.Body.cover(robot, components=3)
    system = ss.GeometricSystem(
        [ss.ClearanceBarrier(robot, body)], stiffness=2.0, damping=3.0, pull_form="one_sided"
    )
    # The ball stands between start and goal of an arm that can also fold itself and pass below it.
    obstacles = ss.Obstacles([[0.8, 0.0, 0.0]], radii=0.05)
    start, goal = np.array([0.9, 0.0]), np.array([-0.9, 0.0])
    stuck = ss.rollout(system, start, np.zeros(2), goal, obstacles, steps=20000)
    # An arm of two joints has to fold and turn at once, so its sub-goals have to be far.
    escape = ss.Escape(robot, patience=1.0, leg=3.0, spread=4.0)
    freed = ss.rollout(system, start, np.zeros(2), goal, obstacles, steps=60000, escape=escape)
    assert np.abs(stuck.q[-1] - goal).max() > 0.5
    assert np.abs(freed.q - goal).max(axis=1).min() < 0.05
    assert escape.count >= 1


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"patience": 0.0}, "patience is 0.000000, must be positive"),
        ({"spread": -1.0}, "spread is -1.000000, must be positive"),
        ({"leg": np.nan}, "leg is nan, must be positive"),
        ({"fraction": 1.0}, "fraction is 1.000000, must be between 0 and 1"),
    ],
)
def test_bad_settings_are_named(robot, setting, message):
    with pytest.raises(ValueError, match=message):
        ss.Escape(robot, **setting)


def test_escape_of_another_robot_is_refused(robot):
    flat = ss.GeometricSystem([], robot=ss.Robot.named("planar3"))
    zero = np.zeros(3)
    with pytest.raises(ValueError, match="escape is for 2 coordinates, the system has 3"):
        ss.rollout(flat, zero, zero, zero, ss.Obstacles.none(), steps=1, escape=ss.Escape(robot))
