"""Errata 8 to 12, 14, 17, 19 and 20: the dynamical system."""

import numpy as np
import pinocchio as pin
import pytest

from sidestep import Obstacles, Robot
from sidestep.system import GeometricSystem
from sidestep.thesis import BinarySwitch, DistanceSwitch, GeodesicOnly, JointLimitPotential, rollout
from sidestep.thesis.reproduce import avoidance, planar

REST = np.zeros(2)


def test_signs_of_the_switched_system():
    far = Obstacles([[5.0, 5.0, 0.0]])  # [m] out of reach: the metric is the identity, every weight 1
    system = GeometricSystem(
        [planar.density()], stiffness=1.0, damping=1.5, switch=DistanceSwitch([0.2, 0.2], 20.0)
    )
    goal, q, v = planar.GOAL, np.array([0.2, 0.4]), np.array([0.3, -0.1])
    found = system.acceleration(q, v, goal, far).acceleration
    np.testing.assert_allclose(found, -(q - goal) - 1.5 * v, atol=1e-9)  # weights differ from 1 by exp(-60)
    printed = -((q + goal) - 1.5 * v)
    assert np.abs(found - printed).max() > 0.5
    np.testing.assert_allclose(system.acceleration(goal, REST, goal, far).acceleration, 0.0, atol=1e-15)
    assert np.abs(-(goal + goal)).max() > 1.0  # as printed the goal is no point of rest


def test_second_derivative_of_the_limit_potential():
    robot = planar.arm()
    slope = 5.0  # [1/rad] soft, so that differences resolve it
    zeta = JointLimitPotential(robot, slope=slope, height=1.0)
    q, h = np.array([2.8, -3.0]), 1e-4

    def value(angles):
        return zeta.evaluate(angles, REST, Obstacles.none()).values[0]

    numeric = [(value(q + h * e) - 2 * value(q) + value(q - h * e)) / h**2 for e in np.eye(2)]
    upper = 1.0 / (1.0 + np.exp(slope * (np.pi - q)))
    lower = 1.0 / (1.0 + np.exp(slope * (q + np.pi)))
    right = slope**2 * (upper * (1 - upper) * (1 - 2 * upper) + lower * (1 - lower) * (1 - 2 * lower))
    np.testing.assert_allclose(numeric, right, atol=1e-5)  # rounding of 1e-15 over h²
    np.testing.assert_allclose(np.diag(zeta.hessian(q, Obstacles.none())), right, rtol=1e-10)
    E, F = np.exp(slope * (np.pi - q)), np.exp(slope * (q + np.pi))
    wrong_factor = np.exp(slope * (q - np.pi))  # q+ where q- belongs

    def quotients(exponent, denominator, factor):
        """Both quotients of T5.11: exponents of the first one's last factor and denominator, and q- or q+."""
        first = -(slope**2) * E * (1 + E) ** 2 + 2 * slope**2 * E**2 * (1 + E) ** exponent
        second = slope**2 * F * (1 + factor) ** 2 - 2 * slope**2 * F**2 * (1 + F)
        return first / (1 + E) ** denominator - second / (1 + F) ** 4

    np.testing.assert_allclose(quotients(1, 4, F), right, atol=1e-10)  # rounding, where terms cancel
    for printed in (quotients(4, 1, F), quotients(1, 4, wrong_factor), quotients(4, 1, wrong_factor)):
        assert np.abs(printed - right).max() > 1.0  # each slip by itself, and both together


def test_equation_of_motion():
    robot = Robot.named("fr3_arm")
    rng = np.random.default_rng(5)
    model, data = robot.pinocchio, robot.pinocchio.createData()
    for _ in range(10):
        q, v, a = robot.random_configuration(rng), rng.normal(size=7), rng.normal(size=7)
        M, h = robot.mass_matrix(q), robot.bias(q, v)
        gravity = robot.bias(q, np.zeros(7))
        coriolis = h - gravity
        right = pin.aba(model, data, q, v, M @ a + h)
        np.testing.assert_allclose(right, a, atol=1e-8)  # M has a condition of up to 1e4
        printed = pin.aba(model, data, q, v, M @ a - coriolis)
        assert np.abs(printed - a).max() > 0.5


def test_a_moving_obstacle_changes_the_equations():
    density = planar.density()
    q, v = np.array([0.2, -0.2]), np.array([0.4, 0.3])
    x, s = planar.OBSTACLE, np.array([0.3, -0.5, 0.0])
    h = 1e-4

    def value(t, rate):
        return density.evaluate(q + t * rate, REST, Obstacles((x + t * s)[None])).values[0]

    for rate in (v, REST):
        numeric = (value(h, rate) - 2 * value(0.0, rate) + value(-h, rate)) / h**2
        known = density.evaluate(q, rate, Obstacles(x[None], 0.0, s[None])).curvatures[0]
        ignored = density.evaluate(q, rate, Obstacles(x[None])).curvatures[0]
        assert known == pytest.approx(numeric, rel=1e-4)  # truncation h² times a fourth derivative of 1e4
        assert abs(ignored - numeric) > 0.2 * abs(numeric)


@pytest.mark.slow
def test_the_unswitched_system_stalls_although_a_way_exists():
    system = GeometricSystem([planar.density(thickness=planar.HIGH)], stiffness=1.0, damping=1.5)

    def move(q, v, goal, duration, period=2e-3):
        return rollout(
            system,
            q,
            v,
            goal,
            planar.point(),
            period=period,
            steps=round(duration / period),
            integrator="runge_kutta_4",
        )

    ends = []
    for start in (planar.START, np.array([-0.6, -0.4]), np.array([-0.5, 0.0])):
        run = move(start, REST, planar.GOAL, 600.0)
        ends.append(run.q[-1])
        assert np.linalg.norm(run.q[-1] - planar.GOAL) > 0.9  # [rad]
        assert np.abs(run.v[-1]).max() < 1e-4  # [rad/s]
        assert planar.least_clearance(run.q, count=300) > 0.25  # [m] far from touching
    assert np.ptp(ends, axis=0).max() < 1e-3  # all three gather at one point
    # Yet it is no point of rest: from rest the acceleration there is G^-1 K (q* - q), small but not zero.
    at_rest = system.acceleration(ends[0], REST, planar.GOAL, planar.point()).acceleration
    assert 1e-6 < np.abs(at_rest).max() < 1e-3
    # And a way exists: by three via points the same system arrives, without contact.
    q, v = planar.START, REST
    for target, duration in (
        (np.array([-0.2, -2.6]), 8.0),
        (np.array([2.0, -2.6]), 8.0),
        (np.array([1.8, -0.5]), 8.0),
        (planar.GOAL, 20.0),
    ):
        leg = move(q, v, target, duration, period=1e-3)
        q, v = leg.q[-1], leg.v[-1]
        assert planar.least_clearance(leg.q, count=300) > 0.3
    np.testing.assert_allclose(q, planar.GOAL, atol=1e-4)


def test_every_rest_above_the_threshold_is_an_equilibrium_of_the_switched_system():
    system = GeometricSystem([planar.density()], stiffness=1.0, damping=1.5, switch=BinarySwitch(0.5))
    for q in ([0.3, 0.0], [0.2, 0.3], [0.5, -0.5]):
        step = system.acceleration(q, REST, planar.GOAL, planar.point())
        assert step.values[0] > 0.5
        np.testing.assert_array_equal(step.acceleration, 0.0)


def test_a_bounded_wall_only_delays_a_geodesic():
    robot = planar.arm()
    height, speed = 10.0, 0.5
    system = GeometricSystem([JointLimitPotential(robot, slope=30.0, height=height)], switch=GeodesicOnly())
    run = rollout(
        system,
        [2.5, 0.0],
        [speed, 0.0],
        REST,
        Obstacles.none(),
        period=1e-3,
        steps=30_000,
        integrator="runge_kutta_4",
    )
    assert run.q[-1, 0] > np.pi + 0.5  # [rad] beyond the limit
    assert run.v[-1, 0] == pytest.approx(speed, rel=1e-6)  # and as fast as before
    beyond = run.time[np.argmax(run.q[:, 0] > np.pi + 0.3)]
    flat = (np.pi + 0.3 - 2.5) / speed
    # The wall is as long as it is high, and a little longer for its width.
    assert height / speed < beyond - flat + 0.6 / speed < (height + 0.7) / speed


@pytest.mark.slow
def test_the_switch_adds_energy():
    switched = avoidance.energy(avoidance.move(BinarySwitch(0.5), duration=4.0, period=1e-4))
    assert switched.max() > 4.0 * switched[0]
    finer = avoidance.energy(avoidance.move(BinarySwitch(0.5), duration=4.0, period=2e-5))
    assert finer.max() > 4.0 * finer[0]  # so it is not the step of the integration
    unswitched = avoidance.energy(avoidance.move(avoidance.Unswitched(), duration=10.0))
    assert np.diff(unswitched).max() < 1e-9  # never grows, up to the error of Runge-Kutta


def test_unequal_gains_bend_the_path_in_flat_space():
    def bend(stiffness):
        system = GeometricSystem([], stiffness=stiffness, damping=1.5, robot=planar.arm())
        run = rollout(system, planar.START, REST, planar.GOAL, Obstacles.none(), period=1e-3, steps=10_000)
        along = planar.GOAL - planar.START
        offset = run.q - planar.START
        return np.abs(offset[:, 0] * along[1] - offset[:, 1] * along[0]).max() / np.linalg.norm(along)

    assert bend([1.0, 1.0]) < 1e-12
    assert bend([1.0, 4.0]) > 0.1


def test_the_update_is_not_eulers():
    system = GeometricSystem([], stiffness=1.0, damping=1.5, robot=planar.arm())
    dt, v = 0.01, np.array([0.2, -0.1])
    a = system.acceleration(planar.START, v, planar.GOAL, Obstacles.none()).acceleration

    def step(integrator):
        return rollout(
            system, planar.START, v, planar.GOAL, Obstacles.none(), period=dt, steps=1, integrator=integrator
        ).q[1]

    np.testing.assert_allclose(step("second_order"), planar.START + v * dt + 0.5 * a * dt**2, atol=1e-15)
    np.testing.assert_allclose(step("semi_implicit_euler"), planar.START + (v + a * dt) * dt, atol=1e-15)
    assert np.abs(step("second_order") - step("semi_implicit_euler")).max() > 1e-5
