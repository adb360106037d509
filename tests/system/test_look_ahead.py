"""LookAhead: trajectories out of the way of what moves."""

import numpy as np
import pytest

import sidestep as ss
from sidestep.bench.methods import barrier_system
from sidestep.bench.problem import poses_over
from sidestep.bench.problems import balls
from sidestep.distance import ExactClearance
from sidestep.robot import planar_arm
from sidestep.system import AvoidanceTrajectory, GeometricSystem, LookAhead

PERIOD = 0.002
GOAL = np.array([-2.9, 0.0])  # 0.24 rad before the limit of joint 1
CENTRE = np.array([[-0.5, -1.1, 0.0]])
SPEED = np.array([[0.0, 0.5, 0.0]])  # comes and presses the arm against that limit
RADIUS = np.array([0.1])


@pytest.fixture(scope="module")
def robot():
    return ss.Robot.named("planar2")


@pytest.fixture(scope="module")
def system(robot):
    return barrier_system(robot, ss.Body.cover(robot))


def ball(centre=CENTRE, speed=SPEED):
    return ss.Obstacles(centre, RADIUS, speed)


def run(robot, obstacles, steps, *, seed=0, look_ahead=True):
    settings = ss.ControllerSettings(
        period=PERIOD, synchronous=True, planner=None, local_minimum=None, output="acceleration", seed=seed
    )
    if not look_ahead:
        settings.look_ahead = None
    controller = ss.Controller(ss.Arm.from_robot(robot), settings)
    controller.set_goal(GOAL)
    controller.set_obstacles(obstacles, valid_for=np.inf)
    return ss.integrate(controller, GOAL, np.zeros(2), steps=steps)


def exact_clearance(robot, motion):
    objects = balls(CENTRE, RADIUS, SPEED)
    exact = ExactClearance(robot, objects)
    time = PERIOD * np.arange(len(motion.q))
    return exact.decided_minimum(motion.q, poses_over(objects, time), tolerance=1e-3).lower_bound


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_arm_steps_aside_in_time(robot, seed):
    assert exact_clearance(robot, run(robot, ball(), 2500, look_ahead=False)) < 0.0
    motion = run(robot, ball(), 2500, seed=seed)
    assert exact_clearance(robot, motion) > 0.0
    assert np.abs(motion.last_q - GOAL).max() < np.abs(motion.q - GOAL).max() / 2.0
    limits = robot.limits
    assert np.all(np.abs(motion.v) <= limits.velocity + 1e-9)  # rounding
    assert np.all(np.abs(motion.acceleration) <= limits.acceleration + 1e-9)
    again = run(robot, ball(), 2500, seed=seed)
    np.testing.assert_array_equal(motion.q, again.q)


def test_what_rests_or_passes_by_changes_nothing(robot):
    for obstacles in (
        ball(speed=np.zeros((1, 3))),
        ball(centre=np.array([[0.0, 3.0, 0.0]])),
        ss.Obstacles.none(),
    ):
        with_it, without = (run(robot, obstacles, 300, look_ahead=look) for look in (True, False))
        np.testing.assert_array_equal(with_it.q, without.q)


def test_what_a_look_finds_is_followed_one_look_later_and_without_jumps(system, robot):
    evasion, at_rest = LookAhead(system, delay=0.1, seed=1), np.zeros(2)
    flights = [
        evasion.pursue(GOAL, GOAL, at_rest, ball(CENTRE + k * PERIOD * SPEED), PERIOD) for k in range(200)
    ]
    assert flights[:50] == [None] * 50
    first = flights[50]
    assert np.all((first.target >= robot.limits.lower) & (first.target <= robot.limits.upper))
    np.testing.assert_allclose(first.position, GOAL, atol=2e-3)  # nothing draws the arm away before
    expected = AvoidanceTrajectory(robot, first.position, first.velocity, first.target)
    for k, flight in enumerate(flights[51:], start=51):
        np.testing.assert_array_equal(flight.target, first.target)
        expected.advance(PERIOD)
        # A kept trajectory goes on as the look foresaw it, in steps of 0.01 s: off by less than one of these.
        tolerance = 0.0 if k < 100 else 0.9 * robot.limits.acceleration.max() * 0.01
        np.testing.assert_allclose(flight.velocity, expected.velocity, rtol=0.0, atol=tolerance)
        np.testing.assert_allclose(flight.position, expected.position, rtol=0.0, atol=tolerance * 0.1)


def test_what_was_found_is_forgotten_for_another_motion(system):
    evasion, at_rest = LookAhead(system, seed=1), np.zeros(2)
    for k in range(60):
        found = evasion.pursue(GOAL, GOAL, at_rest, ball(CENTRE + k * PERIOD * SPEED), PERIOD)
    assert found is not None
    evasion.reset()
    for _ in range(60):
        assert evasion.pursue(-GOAL, -GOAL, at_rest, ball(), PERIOD) is None


def test_a_look_says_what_to_follow(system):
    evasion, at_rest = LookAhead(system, seed=1), np.zeros(2)
    found = evasion.look(GOAL, GOAL, at_rest, ball())
    assert evasion.count == 1
    ahead = ball(CENTRE + 0.1 * SPEED)
    kept = evasion.look(GOAL, GOAL, at_rest, ahead, found)  # still good
    np.testing.assert_array_equal(kept.target, found.target)
    for _ in range(10):
        found.advance(0.01)
    np.testing.assert_array_equal(kept.position, found.position)
    assert evasion.count == 1
    gone = ball(centre=CENTRE + 4.0 * SPEED)
    assert evasion.look(GOAL, GOAL, at_rest, gone, kept) is None
    assert evasion.look(GOAL, GOAL * np.nan, at_rest, ball()) is None


def test_steps_are_made_to_go_into_the_delay(system):
    evasion, at_rest = LookAhead(system, delay=0.1, period=0.04, seed=1), np.zeros(2)
    found = evasion.look(GOAL, GOAL, at_rest, ball())
    kept = evasion.look(GOAL, GOAL, at_rest, ball(CENTRE + 0.1 * SPEED), found)
    for _ in range(3):
        found.advance(0.1 / 3.0)
    np.testing.assert_allclose(kept.position, found.position, rtol=1e-12)


def test_an_arm_that_can_only_brake_is_taken_to_do_so(system):
    at_rest = np.zeros(2)
    beyond = ss.JointGoal(np.array([-4.0, 0.0]))  # outside the limits
    leaving = ss.JointGoal(GOAL, np.array([-1.0, 0.0]))  # a goal that moves out of them
    for goal in (beyond, leaving):
        evasion = LookAhead(system, seed=1)
        assert evasion.look(goal, GOAL, at_rest, ball()) is not None
        assert evasion.look(goal, GOAL, at_rest, ball(centre=np.array([[0.0, 3.0, 0.0]]))) is None


def test_flights_of_joints_without_limits_are_finite():
    text = planar_arm(2).replace('name="joint2" type="revolute"', 'name="joint2" type="continuous"')
    robot = ss.Robot.from_urdf(text)
    assert np.isinf(robot.limits.upper[1])
    system = barrier_system(robot, ss.Body.cover(robot))
    evasion = LookAhead(system, seed=1)
    for k in range(5):
        found = evasion.look(GOAL, GOAL, np.zeros(2), ball(CENTRE + 0.1 * k * SPEED))
        assert np.isfinite(found.target).all()
        assert np.isfinite(found.acceleration(GOAL, np.zeros(2), PERIOD)).all()
    assert evasion.count > 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"horizon": 0.0}, "look_ahead: horizon is 0 s, allowed: 0.1 to 30 s"),
        ({"period": np.inf}, "look_ahead: period is inf s, allowed: 0.0005 to 0.2 s"),
        ({"delay": -1.0}, "look_ahead: delay is -1 s, allowed: 0.005 to 5 s"),
        ({"clearance": np.nan}, "look_ahead: clearance is nan m, allowed: -0.1 to 0.5 m"),
        ({"tries": 0}, "look_ahead: tries is 0, allowed: 1 to 100000"),
        ({"delay": 3.0}, "look_ahead: delay is 3.0*, must be no longer than the horizon"),
        ({"period": 0.2}, "look_ahead: period is 0.20*, must be no longer than the delay"),
        ({"period": 1e-9}, "look_ahead: period is 1e-09 s, allowed: 0.0005 to 0.2 s"),
        ({"horizon": 2e4, "period": 0.1}, "look_ahead: horizon is 20000 s, allowed: 0.1 to 30 s"),
    ],
)
def test_settings_are_checked(system, change, message):
    with pytest.raises(ValueError, match=message):
        LookAhead(system, **change)


def test_what_does_not_go_together_is_named(system):
    evasion, other = LookAhead(system), ss.Robot.named("planar3")
    flat, q = GeometricSystem([], robot=other), np.zeros(3)
    with pytest.raises(ValueError, match="the system has no clearances to obstacles"):
        LookAhead(flat)
    for period in (0.0, np.nan):
        with pytest.raises(ValueError, match=f"period is {period}.*, must be positive and finite"):
            evasion.pursue(GOAL, GOAL, GOAL, ss.Obstacles.none(), period)
    foreign = AvoidanceTrajectory(other, q, q, q)
    with pytest.raises(ValueError, match="the trajectory is for 3 coordinates, the system has 2"):
        evasion.look(GOAL, GOAL, GOAL, ss.Obstacles.none(), foreign)
    with pytest.raises(ValueError, match=r"q has shape \(3,\), expected \(2,\)"):
        evasion.look(GOAL, q, GOAL, ss.Obstacles.none())
