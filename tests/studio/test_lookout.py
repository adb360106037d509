"""Looking ahead beside the loop."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import sidestep as ss
from sidestep import Scenario
from sidestep.presets import barrier_system
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


def test_it_says_what_the_looks_find_and_never_waits() -> None:
    robot = ss.Robot.named("planar2")
    system = barrier_system(robot, ss.Body.cover(robot))
    lookout = Lookout(ss.Evasion(system, delay=0.1, seed=1), delay=0.1, period=0.002)
    goal, ball = ss.JointGoal(GOAL), ss.Obstacles(CENTRE, np.array([0.1]), SPEED)

    def follow() -> ss.Flight | None:
        found = lookout.follow(goal, GOAL, AT_REST, ball)
        assert lookout._look is not None
        lookout._look.result(timeout=60.0)  # as if every look took no time
        return found

    found = [follow() for _ in range(60)]
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
    gone = [follow() for _ in range(100)]
    assert gone[-1] is None


@pytest.mark.parametrize("method", ["barrier", "reactive"])
def test_an_arm_steps_out_of_the_way_of_what_comes(make_session: Callable[..., Session], method: str) -> None:
    session = make_session(Scenario.from_text(COMING), method=method)
    words = set()
    for k in range(2000):
        session.step()
        lookout = session._pursuit._lookout
        assert (lookout is None) == (method == "reactive")
        if lookout is not None and lookout._look is not None:
            lookout._look.result(timeout=60.0)  # the motion here is faster than time
        if k % 50 == 0:
            words.add(session.snapshot().words.split(":")[0])
    last = session.snapshot()
    assert (last.touched == 0) == (method == "barrier")
    assert ("steps out of the way" in words) == (method == "barrier")
