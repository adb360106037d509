"""Why the arm moves, events, and goals in turn, without a page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from sidestep import Scenario
from sidestep._core import Activity, Limit, SafetyStatus
from sidestep.studio import messages as m
from sidestep.studio.gallery import ends_of
from sidestep.studio.goals_in_turn import REST
from sidestep.studio.reason import AGAIN, EVENTS, LASTING, EventRecord, Events, limit_in_words, path_from
from sidestep.studio.session import Session

MakeSession = Callable[..., Session]


def run(session: Session, seconds: float) -> m.Snapshot:
    for _ in range(round(seconds / session.period)):
        session.step()
    return session.snapshot()


def test_goals_are_visited_in_turn_until_somebody_sets_one(
    make_session: MakeSession, scenario: Scenario
) -> None:
    bare = replace(scenario, obstacles=())
    robot = make_session(bare).robot
    goal, start = ends_of(bare, robot)
    session = make_session(bare, goals=(goal, start))
    np.testing.assert_array_equal(session.snapshot().goal, goal)  # type: ignore[arg-type]
    times, last = [], session.snapshot()
    while len(times) < 2 and last.time < 12.0:
        before, last = last, run(session, 0.05)
        if not np.array_equal(before.goal, last.goal):  # type: ignore[arg-type]
            times.append(last.time)
            assert (
                np.abs(last.q - before.goal).max() < 0.06
            )  # [rad] was there, and has moved on for 0.05 s at most
    assert times[0] > REST
    np.testing.assert_array_equal(last.goal, goal)  # type: ignore[arg-type]  there and back
    words = [event for _, event in last.events]
    assert "arrived" in words
    assert "new goal" in words
    session.handle(m.SetJointGoal(start))
    assert session.snapshot().visited == ()
    session.handle(m.VisitGoals((goal, start)))
    np.testing.assert_array_equal(session.snapshot().goal, goal)  # type: ignore[arg-type]  the one after the present
    session.handle(m.Restart())
    assert len(session.snapshot().visited) == 2
    np.testing.assert_array_equal(session.snapshot().goal, goal)  # type: ignore[arg-type]
    assert session.snapshot().goal_written


def test_a_goal_out_of_the_limits_is_refused(make_session: MakeSession, scenario: Scenario) -> None:
    session = make_session(scenario)
    with pytest.raises(ValueError, match="goals"):
        session.handle(m.VisitGoals((np.array([100.0, 0.0]),)))
    assert session.snapshot().visited == ()


def test_the_reason_names_path_pull_and_what_binds(make_session: MakeSession, scenario: Scenario) -> None:
    session = make_session(scenario)
    seen = []
    for _ in range(40):
        seen.append(run(session, 0.05))
    first = seen[0]
    assert first.posture is not None
    np.testing.assert_allclose(first.reason.path[-1], first.posture.q, atol=1e-3)
    np.testing.assert_allclose(first.reason.path[0], first.q, atol=0.02)  # [rad] of a period before
    assert first.reason.pull @ (first.posture.q - first.q) > 0.0  # towards the goal, with nothing in the way
    bound = [one for one in seen if one.reason.obstacle]
    assert bound  # it passes the ball 10 cm beside it, where barriers begin
    middle, radius = bound[0].poses[0][:3, 3], bound[0].things[0].obstacle.shape.radius
    for one in bound:
        assert one.reason.obstacle == "ball"
        assert one.reason.link in ("link1", "link2")
        np.testing.assert_allclose(one.reason.point, middle, atol=1e-9)  # the ball is one point with a radius
        assert one.reason.radius == radius
    assert any("keeps off ball" in event for _, event in seen[-1].events)
    assert seen[-1].activity in ("moving", "arrived")


def test_of_a_path_what_is_left_is_told() -> None:
    found = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    q = np.array([0.5, 0.1])
    np.testing.assert_array_equal(path_from(q, found, found[-1]), [q, found[1], found[2]])
    late = np.array([1.1, 0.5])
    np.testing.assert_array_equal(path_from(late, found, found[-1]), [late, found[2]])
    other = np.array([-1.0, 0.0])  # the path belongs to an earlier goal
    np.testing.assert_array_equal(path_from(q, found, other), [q, other])
    assert len(path_from(q, found, None)) == 0


def test_events_are_changes_and_not_told_twice_in_a_second() -> None:
    events, still = Events(), EventRecord(Activity.moving, False, 1, "", "")
    events.take(0.0, still)
    events.take(0.1, replace(still, searches=2, stepping_aside=True, obstacle="ball", link="hand"))
    assert [word for _, word in events.told] == ["planned anew", "stepped aside from ball"]
    events.take(0.1 + LASTING, replace(still, searches=2, obstacle="ball", link="hand"))
    assert events.told[-1] == (0.1 + LASTING, "hand keeps off ball")
    events.take(0.3, replace(still, searches=3))
    assert len(events.told) == 3  # planned anew once in a second
    events.take(0.2 + AGAIN, replace(still, searches=4, activity=Activity.arrived))
    assert [word for _, word in events.told[-2:]] == ["arrived", "planned anew"]
    limited = replace(still, searches=4, activity=Activity.arrived, limit="torque of joint2")
    for time in (1.5, 1.6, 1.7):
        events.take(time, limited)
    assert events.told[-1] == (1.7, "limited by torque of joint2")
    events.take(1.8, replace(limited, status=SafetyStatus.margin_lost))
    assert events.told[-1] == (1.8, "a safety margin is lost")
    for k in range(EVENTS + 2):
        events.tell(2.0 + k, f"event {k}")
    assert [word for _, word in events.told] == [f"event {k}" for k in range(2, EVENTS + 2)]


def test_a_limit_is_named_with_its_joint() -> None:
    names = ("joint1", "joint2")
    speed, torque = Limit.velocity_upper | Limit.jerk_upper, Limit.torque_lower
    assert limit_in_words([speed, torque], names) == "torque of joint2"
    assert limit_in_words([speed, Limit.jerk_lower], names) == "speed of joint1"
    assert limit_in_words([Limit.acceleration_upper, Limit(0)], names) == ""


def test_a_box_gets_other_sides_where_it_is(make_session: MakeSession, scenario: Scenario) -> None:
    from sidestep.studio.scene_obstacle import box

    session = make_session(scenario)
    session.handle(m.AddObstacle(box("crate", np.array([2.0, 0.0, 0.0]), np.full(3, 0.1))))
    session.handle(m.SetRunning(False))
    place = session.actor("crate").pose.copy()
    place[:3, 3] = [0.0, 2.0, 0.1]
    session.handle(m.DragObstacle("crate", place))
    session.handle(m.ReplaceObstacle(box("crate", np.zeros(3), np.array([0.1, 0.2, 0.3]))))
    last = session.snapshot()
    assert [thing.name for thing in last.things] == ["ball", "crate"]
    assert last.things[1].obstacle.shape.size == (0.1, 0.2, 0.3)
    np.testing.assert_allclose(last.poses[1], place, atol=1e-12)
    with pytest.raises(ValueError, match="no obstacle 'other'"):
        session.handle(m.ReplaceObstacle(box("other", np.zeros(3), np.full(3, 0.1))))
