"""The controller on a path: it arrives behind concave obstacles, and barriers leave room where the path is narrow."""

import time as clock

import numpy as np
import pytest

import sidestep as ss
from sidestep import _core
from sidestep._core import PlanStatus
from sidestep.controller import BarrierSettings, OnlinePlannerSettings
from sidestep.planning import PlannerSettings

PERIOD = 0.005
START, GOAL, REST = np.array([0.8, 0.0, 0.0]), np.array([-0.8, 0.0, 0.0]), np.zeros(3)
# A row of points in the way of the stretched arm: it has to fold.
WALL = ss.Obstacles(np.column_stack([np.linspace(1.0, 1.5, 12), np.zeros(12), np.zeros(12)]), 0.03)


def planner(**search: float) -> OnlinePlannerSettings:
    settings = OnlinePlannerSettings()
    settings.search = PlannerSettings(**search)
    return settings


@pytest.fixture
def make(robot: ss.Robot, body: _core.Body):  # type: ignore[no-untyped-def]
    arm = _core.Arm(
        robot=robot,
        body=body,
        pairs=[],
        tables=[],
        inertials=(),
        proof=[],
        allowed_pairs=[],
        provenance=_core.Provenance(source="", fingerprint="", sidestep_version="", date=""),
    )

    def controller(seen: ss.Obstacles, **settings: object) -> ss.Controller:
        usual = {"synchronous": True, "output": "acceleration", "period": PERIOD, "local_minimum": None}
        barriers = BarrierSettings(activation=0.06)
        made = ss.Controller(arm, ss.ControllerSettings(**usual | {"barriers": barriers} | settings))
        made.set_goal(GOAL)
        made.set_obstacles(seen)
        return made

    return controller


def height(controller: ss.Controller, q: np.ndarray, seen: ss.Obstacles, *, lowered: bool = True) -> float:
    """The highest psi at q, with barriers as they are now, or as they are set."""
    activations = controller.activations if lowered else None
    return float(controller.system.acceleration(q, REST, q, seen, activations).values.max())


def test_it_arrives_where_barriers_alone_are_stuck(make) -> None:  # type: ignore[no-untyped-def]
    alone = ss.integrate(make(WALL, planner=None), START, REST, steps=4000)
    assert np.abs(alone.last_q - GOAL).max() > 0.3  # it hangs at the wall
    controller = make(WALL)
    motion = ss.integrate(controller, START, REST, steps=4000)
    assert motion.activities[-1] == ss.Activity.arrived
    assert controller.plan.status == PlanStatus.found


def test_a_blocked_goal_is_named_and_reached_when_it_clears(make) -> None:  # type: ignore[no-untyped-def]
    controller = make(ss.Obstacles([[np.cos(-0.8), np.sin(-0.8), 0.0]], 0.1))
    motion = ss.integrate(controller, START, REST, steps=800)
    assert motion.activities[-1] == ss.Activity.blocked
    assert controller.plan.obstruction.link in ("link2", "link3")  # at 1 m, where the two meet
    controller.set_obstacles(ss.Obstacles.none())
    motion = ss.integrate(controller, motion.last_q, motion.last_v, steps=2000)
    assert motion.activities[-1] == ss.Activity.arrived


def test_it_finds_the_way_in_its_thread(make) -> None:  # type: ignore[no-untyped-def]
    controller = make(WALL, synchronous=False)
    assert controller.step(START, REST).activity == ss.Activity.moving  # at once, by barriers alone
    while controller.plan.status != PlanStatus.found:  # however slow the machine is
        clock.sleep(0.001)
        controller.step(START, REST)
    assert controller.searches > 0


def test_barriers_leave_a_goal_free_once_it_is_free(make) -> None:  # type: ignore[no-untyped-def]
    def ball(above: float) -> ss.Obstacles:
        return ss.Obstacles([[np.cos(-0.8), np.sin(-0.8), above]], 0.1)

    at = GOAL + np.array([0.02, 0.0, 0.0])
    controller = make(ball(0.0))
    controller.step(at, REST)
    # 2.5 cm from the ellipsoids, within the activation of 6 cm: barriers made for the blocked goal hold the arm back
    controller.set_obstacles(ball(0.15))
    for _ in range(5):  # until the next look at the scene
        controller.step(at, REST)
    assert height(controller, at, ball(0.15), lowered=False) > 0.0
    assert height(controller, at, ball(0.15)) == 0.0


def test_barriers_leave_room_at_the_narrow_places_of_the_path_and_at_its_end(make) -> None:  # type: ignore[no-untyped-def]
    along, across = np.array([np.cos(0.8), -np.sin(0.8), 0.0]), np.array([-np.sin(0.8), -np.cos(0.8), 0.0])
    beside = ss.Obstacles(np.vstack([WALL.points, 0.9 * along + 0.1 * across]), 0.03)
    controller = make(beside, planner=planner(margin=0.01, floor=0.01), seed=2)
    q, v, heights = START, REST, []
    for _ in range(4000):
        command = controller.step(q, v)
        if command.on_path and height(controller, q, beside, lowered=False) > 0.0:
            heights.append([height(controller, q, beside, lowered=lowered) for lowered in (True, False)])
        if command.activity == ss.Activity.arrived:
            break
        q, v = command.position, command.velocity
    assert command.activity == ss.Activity.arrived
    assert len(heights) > 10
    lowered, full = np.array(heights).T
    assert np.all(lowered <= full)
    assert np.median(lowered) < 0.5 * np.median(full)
    assert height(controller, GOAL, beside, lowered=False) > 0.0
    assert height(controller, GOAL, beside) == 0.0


def test_what_moves_far_away_leaves_the_goal_free(make) -> None:  # type: ignore[no-untyped-def]
    """Near it, barriers are whole: what room they leave is for what rests."""
    # 2.5 cm from the ellipsoids at the goal, within the activation of 6 cm, rests a ball; another moves.
    resting = [np.cos(-0.8), np.sin(-0.8), 0.15]
    at = GOAL + np.array([0.02, 0.0, 0.0])
    alone = ss.Obstacles([resting], 0.1)
    controller = make(alone, look_ahead=None)

    def value(away: float, speed: float) -> float:
        seen = ss.Obstacles([resting, [away, 0.0, 2.0]], 0.1, velocities=[[0.0] * 3, [0.0, 0.0, -speed]])
        controller.set_obstacles(seen, valid_for=np.inf)
        for _ in range(5):
            controller.step(at, REST)
        return height(controller, at, alone)

    full = height(controller, at, alone, lowered=False)
    assert full > 0.0
    assert value(5.0, 0.2) == 0.0
    assert value(5.1, 0.2) == 0.0  # it has moved, what rests has not
    assert value(0.5, 0.2) == 0.0  # at most 1.7 m away after a second
    assert value(0.5, 2.0) == pytest.approx(full, rel=1e-12)
    assert value(5.0, 0.2) == 0.0
