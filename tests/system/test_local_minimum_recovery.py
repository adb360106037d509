"""LocalMinimumRecovery: sub-goals where an arm is stuck."""

import numpy as np
import pytest

import sidestep as ss
from sidestep.controller import LocalMinimumSettings
from sidestep.system import LocalMinimumRecovery

PERIOD = 0.01


GOAL = np.array([0.5, 0.5])
AWAY = np.array([-2.0, 2.0])


def pursue(escape, states):
    """The configurations followed from state to state."""
    return np.array([escape.pursue(GOAL, q, np.nan, PERIOD).position for q in states])


def at_rest(steps):
    return np.tile(AWAY, (steps, 1))


@pytest.fixture
def robot():
    return ss.Robot.named("planar2")


def test_goal_is_followed_while_it_gets_nearer(robot):
    escape = LocalMinimumRecovery(robot, patience=0.1)
    followed = pursue(escape, GOAL + (AWAY - GOAL) * 0.98 ** np.arange(200)[:, None])
    np.testing.assert_array_equal(followed, np.tile(GOAL, (200, 1)))
    assert escape.count == 0


def test_an_arm_that_has_arrived_is_not_stuck(robot):
    escape = LocalMinimumRecovery(robot, patience=0.1)
    followed = pursue(escape, GOAL + np.tile([0.009, -0.009], (500, 1)))
    np.testing.assert_array_equal(followed, np.tile(GOAL, (500, 1)))
    pursue(escape, GOAL + np.tile([0.011, 0.0], (15, 1)))
    assert escape.count == 1


def test_patience_begins_anew_with_another_goal(robot):
    escape = LocalMinimumRecovery(robot, patience=0.2)
    pursue(escape, GOAL + (AWAY - GOAL) * 0.98 ** np.arange(100)[:, None])
    state, other = GOAL + (AWAY - GOAL) * 0.98**100, np.array([-2.5, -2.0])
    pursue(escape, np.tile(state, (15, 1)))  # three quarters of the patience
    followed = [escape.pursue(other, state, np.nan, PERIOD).position for _ in range(19)]
    np.testing.assert_array_equal(followed, np.tile(other, (19, 1)))
    for _ in range(3):
        escape.pursue(other, state, np.nan, PERIOD)
    assert escape.count == 1


def test_sub_goal_comes_after_patience_and_is_given_up_after_half_of_it(robot):
    escape = LocalMinimumRecovery(robot, patience=0.2, leg=10.0, spread=0.7, seed=3)
    followed = pursue(escape, at_rest(45))
    away = np.any(followed != GOAL, axis=1)
    # 20 periods of patience after the first; times that are sums of periods may round below it once.
    first = int(away.argmax())
    assert first in (20, 21)
    assert np.all(np.abs(followed[first] - AWAY) <= 0.7)
    # Half of 20 periods without coming nearer, and the same of rounding.
    assert int((~away[first:]).argmax()) in (11, 12)
    assert escape.count == 1


def test_sub_goal_that_gets_nearer_is_followed_for_its_leg(robot):
    escape = LocalMinimumRecovery(robot, patience=0.1, leg=0.5, seed=3)
    first = next(k for k in range(100) if np.any(pursue(escape, at_rest(1))[0] != GOAL))
    assert first in (10, 11)
    sub_goal = np.array(escape.pursue(GOAL, AWAY, np.nan, PERIOD).position)
    # Comes nearer by 3 % a step, which is more than 5 % of the squared distance, but not within 0.2 rad.
    assert np.abs(AWAY - sub_goal).max() * 0.97**50 > 0.2
    states = sub_goal + (AWAY - sub_goal) * 0.97 ** np.arange(60)[:, None]
    away = np.any(pursue(escape, states) != GOAL, axis=1)
    assert away[:50].sum() in (48, 49)
    assert not away[50]


def test_sub_goals_lie_within_the_limits(robot):
    corner = robot.limits.upper
    for seed in range(5):
        escape = LocalMinimumRecovery(robot, patience=0.1, seed=seed)
        sub_goals = pursue(escape, np.tile(corner, (13, 1)))[-1:]
        assert np.all(sub_goals <= corner)
        assert np.any(sub_goals < corner - 0.01)


def test_sub_goals_repeat_with_the_seed_and_differ_without(robot):
    def run(seed):
        return pursue(LocalMinimumRecovery(robot, patience=0.1, seed=seed), at_rest(40))

    np.testing.assert_array_equal(run(1), run(1))
    assert not np.array_equal(run(1), run(2))


def test_a_pose_is_pursued_by_its_potential():
    robot = ss.Robot.named("fr3_arm")
    q = robot.neutral
    goal = ss.PoseGoal(robot, robot.frames[-1].name, np.eye(4))
    escape = LocalMinimumRecovery(robot, patience=0.1)
    unknown = [escape.pursue(goal, q, np.nan, PERIOD) for _ in range(50)]
    falling = [escape.pursue(goal, q, u, PERIOD) for u in 0.9 ** np.arange(50)]
    assert all(isinstance(followed, ss.PoseGoal) for followed in unknown + falling)
    standing = [escape.pursue(goal, q, 1e-3, PERIOD) for _ in range(15)]
    assert isinstance(standing[-1], ss.JointGoal)
    assert escape.count == 1


def test_escape_leads_an_arm_out_of_a_local_minimum(robot):
    body = ss.Body.cover(robot, components=3)
    # The ball stands between start and goal of an arm that can also fold itself and pass below it.
    obstacles = ss.Obstacles([[0.8, 0.0, 0.0]], radii=0.05)
    start, goal = np.array([0.9, 0.0]), np.array([-0.9, 0.0])

    def motion(local_minimum, steps):
        settings = ss.ControllerSettings(synchronous=True, planner=None, local_minimum=local_minimum)
        controller = ss.Controller(ss.Arm.from_robot(robot, body), settings)
        controller.set_goal(goal)
        controller.set_obstacles(obstacles)
        return ss.integrate(controller, start, np.zeros(2), steps=steps, goal=goal, tolerance=0.05)

    stuck = motion(None, 20000)
    assert not stuck.arrived
    assert np.abs(stuck.last_q - goal).max() > 0.5
    # An arm of two joints has to fold and turn at once, so its sub-goals have to be far.
    assert motion(LocalMinimumSettings(patience=1.0, leg=3.0, spread=4.0), 60000).arrived


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"patience": 0.0}, "local_minimum: patience is 0 s, allowed: 0.05 to 60 s"),
        ({"spread": -1.0}, "local_minimum: spread is -1 rad, allowed: 0.01 to 20 rad"),
        ({"leg": np.nan}, "local_minimum: leg is nan s, allowed: 0.1 to 60 s"),
        ({"fraction": 1.0}, "local_minimum: fraction is 1, allowed: 0.0001 to 0.99"),
    ],
)
def test_bad_settings_are_named(robot, setting, message):
    with pytest.raises(ValueError, match=message):
        LocalMinimumRecovery(robot, **setting)


def test_sub_goals_for_one_goal_lie_farther_off_one_by_one():
    robot = ss.Robot.named("fr3_arm")
    spread, period = 0.1, 0.01
    escape = LocalMinimumRecovery(robot, patience=0.1, leg=0.1, spread=spread, seed=1)
    middle = 0.5 * (robot.limits.lower + robot.limits.upper)
    goal, elsewhere = ss.JointGoal(middle + 0.4), ss.JointGoal(middle - 0.8)

    def farthest_of_next_sub_goal(goal: ss.JointGoal) -> float:
        count = escape.count
        while escape.count == count:
            followed = escape.pursue(goal, middle, np.nan, period)
        return float(np.abs(followed.position - middle).max())

    offs = [farthest_of_next_sub_goal(goal) for _ in range(6)]
    # The largest of seven uniform draws within n spreads is above half of that but for one in 2^7.
    for n, off in enumerate(offs, start=1):
        assert 0.5 * n * spread < off <= n * spread
    while escape.escaping:
        escape.pursue(goal, middle, np.nan, period)
    escape.pursue(goal, middle, np.nan, period)
    assert farthest_of_next_sub_goal(elsewhere) <= spread  # another goal begins anew


def until_escaping(escape, step):
    """Steps until a sub-goal is followed, and returns it."""
    for _ in range(50):
        followed = step()
        if escape.escaping:
            return followed
    raise AssertionError("no sub-goal")


def test_another_goal_is_followed_at_once_and_one_that_moves_is_not_another(robot):
    escape = LocalMinimumRecovery(robot, patience=0.1, leg=10.0, seed=3)

    def followed(goal):
        return np.array(escape.pursue(goal, AWAY, np.nan, PERIOD).position)

    sub_goal = until_escaping(escape, lambda: followed(GOAL))
    np.testing.assert_array_equal(followed(GOAL + 0.19), followed(GOAL))
    assert escape.escaping
    for other in (np.array([0.5, 0.71]), np.array([-1.7, 2.0])):
        np.testing.assert_array_equal(followed(other), other)
        until_escaping(escape, lambda goal=other: followed(goal))
    assert escape.count == 3
    assert np.any(sub_goal != GOAL)


def test_another_pose_is_followed_at_once():
    robot = ss.Robot.named("fr3_arm")
    q, tip = robot.neutral, robot.frames[-1].name
    here, turned, shifted = np.eye(4), np.eye(4), np.eye(4)
    turned[:2, :2] = [[np.cos(0.25), -np.sin(0.25)], [np.sin(0.25), np.cos(0.25)]]
    shifted[2, 3] = 0.25
    escape = LocalMinimumRecovery(robot, patience=0.1, leg=10.0)

    def followed(goal):
        return escape.pursue(goal, q, 1e-3, PERIOD)

    for other in (here, turned, shifted @ turned):
        goal = ss.PoseGoal(robot, tip, other)
        assert isinstance(followed(goal), ss.PoseGoal)
        until_escaping(escape, lambda goal=goal: followed(goal))
    np.testing.assert_array_equal(followed(ss.JointGoal(q + 0.1)).position, q + 0.1)
    assert not escape.escaping
