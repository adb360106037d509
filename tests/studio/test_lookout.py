"""Looking ahead beside the loop."""

from __future__ import annotations

import copy
import threading
from collections.abc import Callable
from concurrent.futures import wait

import numpy as np
import pytest

import sidestep as ss
from sidestep import Scenario
from sidestep.presets import barrier_system
from sidestep.studio import messages as m
from sidestep.studio.lookout import Lookout
from sidestep.studio.session import Session

GOAL, AT_REST = np.array([-2.9, 0.0]), np.zeros(2)
CENTRE, SPEED = np.array([[-0.5, -1.1, 0.0]]), np.array([[0.0, 0.5, 0.0]])

COMING = """\
format: 1
name: coming
method: barrier
robot: {name: planar2}
start: {unit: rad, position: [-2.9, 0.0]}
goal: {unit: rad, position: [-2.9, 0.0]}
barriers: {ellipsoids: 2}
obstacles:
  - {name: ball, shape: {type: sphere, radius: 0.1}, position: [-0.5, -1.1, 0.0], velocity: [0, 0.5, 0]}
simulation: {mode: torque, period: 0.002, duration: 5.0}
"""  # it presses the arm against the limit of joint 1


class Slow:
    """Looks that end when they are told to, and keep what is followed, or find what they are given."""

    def __init__(self, found: ss.Flight | None = None, error: Exception | None = None) -> None:
        self.found, self.error, self.begun, self.go_on = found, error, 0, threading.Event()

    def look(self, goal: object, q: object, v: object, seen: object, followed: ss.Flight | None) -> object:
        self.begun += 1
        assert self.go_on.wait(timeout=60.0)
        if self.error is not None:
            raise self.error
        return self.found if followed is None else followed


def lookout_of(evasion: object) -> Lookout:
    return Lookout(evasion, delay=0.1, period=0.01)  # type: ignore[arg-type]


def follow(lookout: Lookout) -> ss.Flight | None:
    return lookout.follow(ss.JointGoal(GOAL), GOAL, AT_REST, ss.Obstacles.none())


def ended(lookout: Lookout) -> None:
    assert lookout._look is not None
    wait([lookout._look], timeout=60.0)


def test_it_never_waits_and_a_look_that_comes_late_is_caught_up_with() -> None:
    flight = ss.Flight(ss.Robot.named("planar2"), GOAL, AT_REST, GOAL + 0.5)
    slow = Slow(copy.copy(flight))
    lookout = lookout_of(slow)
    assert [follow(lookout) for _ in range(15)] == [None] * 15  # 0.05 s longer than a look may take
    assert slow.begun == 1
    slow.go_on.set()
    ended(lookout)
    found = follow(lookout)
    for _ in range(5):
        flight.advance(0.01)
    assert found is not None
    np.testing.assert_array_equal(found.position, flight.position)
    ended(lookout)
    assert slow.begun == 2


def test_what_a_look_raises_is_raised_once() -> None:
    slow = Slow(error=RuntimeError("no way to look"))
    slow.go_on.set()
    lookout = lookout_of(slow)
    follow(lookout)
    ended(lookout)
    for _ in range(9):
        follow(lookout)
    with pytest.raises(RuntimeError, match="no way to look"):
        follow(lookout)
    slow.error = None
    assert [follow(lookout) for _ in range(5)] == [None] * 5
    ended(lookout)
    assert slow.begun == 2


def test_it_says_what_the_looks_find() -> None:
    robot = ss.Robot.named("planar2")
    system = barrier_system(robot, ss.Body.cover(robot))
    lookout = Lookout(ss.Evasion(system, delay=0.1, seed=1), delay=0.1, period=0.002)
    goal, ball = ss.JointGoal(GOAL), ss.Obstacles(CENTRE, np.array([0.1]), SPEED)

    def follow_quickly() -> ss.Flight | None:
        found = lookout.follow(goal, GOAL, AT_REST, ball)
        ended(lookout)  # as if every look took no time
        return found

    found = [follow_quickly() for _ in range(60)]
    assert found[:50] == [None] * 50  # what the first look found is followed one look later
    flight = ss.Evasion(system, delay=0.1, seed=1).look(goal, GOAL, AT_REST, ball)
    assert flight is not None
    for k, followed in enumerate(found[50:]):
        assert followed is not None
        if k > 0:
            flight.advance(0.002)
        np.testing.assert_array_equal(followed.refuge, flight.refuge)
    assert found[-1] is not None
    np.testing.assert_array_equal(found[-1].position, flight.position)
    ball = ss.Obstacles.none()
    gone = [follow_quickly() for _ in range(100)]
    assert gone[-1] is None


def pressed(session: Session, *, goals: Callable[[int], bool] = lambda k: False) -> tuple[int, set[str]]:
    """How many steps touched, and what was said, in four seconds; where asked a goal very near the same is given."""
    words = set()
    for k in range(2000):
        if goals(k):
            session.handle(m.SetJointGoal(GOAL + 1e-4 * (k % 7)))
        session.step()
        lookout = session._pursuit._lookout
        if lookout is not None:
            ended(lookout)  # the motion here is faster than time
        if k % 50 == 0:
            words.add(session.snapshot().words.split(":")[0])
    return session.snapshot().touched, words


def test_an_arm_steps_out_of_the_way_of_what_comes(make_session: Callable[..., Session]) -> None:
    touched, words = pressed(make_session(Scenario.from_text(COMING), method="barrier"))
    assert touched == 0
    assert "steps out of the way" in words
    touched, words = pressed(make_session(Scenario.from_text(COMING), method="reactive"))
    assert touched > 0
    assert "steps out of the way" not in words


def test_it_does_so_while_its_goal_is_drawn_about(make_session: Callable[..., Session]) -> None:
    session = make_session(Scenario.from_text(COMING), method="barrier")
    touched, words = pressed(session, goals=lambda k: k % 25 == 0)
    assert touched == 0
    assert "steps out of the way" in words


def test_after_a_restart_nothing_is_flown(make_session: Callable[..., Session]) -> None:
    session = make_session(Scenario.from_text(COMING), method="barrier")
    for _ in range(2000):
        session.step()
        assert session._pursuit._lookout is not None
        ended(session._pursuit._lookout)
        if session._pursuit._lookout.flight is not None:
            break
    else:
        raise AssertionError("nothing was flown")
    session.handle(m.Restart())
    session.step()
    assert session._pursuit._lookout.flight is None
