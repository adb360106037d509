"""Motions of the system: what they conserve, what they lose, and how fast the integrators converge."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import sidestep as ss
from sidestep import thesis
from sidestep._core import StepStatus
from sidestep.system import GeometricSystem

ROBOTS = ["planar2", "planar3", "ur5", "fr3"]


def wide_scene(name: str) -> tuple[ss.Robot, thesis.CollisionDensity, ss.Obstacles, np.ndarray, np.ndarray]:
    """One wide Gaussian per link and two obstacles next to the arm: psi is smooth over a long motion."""
    robot = ss.Robot.named(name)
    rng = np.random.default_rng(11)
    links = [next(f.name for f in robot.frames if f.joint == j) for j in range(len(robot.joints))]
    body = ss.Body(
        links=links,
        weights=np.ones(len(links)),
        means=rng.uniform(-0.1, 0.1, (len(links), 3)),
        covariances=[np.diag(rng.uniform(0.3, 0.45, 3) ** 2) for _ in links],
    )
    q = robot.neutral
    tip = robot.pose(q, links[-1])[:3, 3]
    beside = np.array([[0.2, 0.1, 0.1], [0.1, -0.2, 0.0]])
    obstacles = ss.Obstacles(beside + np.outer([1.0, 0.5], tip), [0.05, 0.0])
    v = rng.normal(size=robot.num_coordinates)
    return robot, thesis.CollisionDensity(robot, body), obstacles, q, 0.7 * v / np.linalg.norm(v)


def kinetic_energies(
    motion: thesis.Rollout, density: thesis.CollisionDensity, obstacles: ss.Obstacles
) -> np.ndarray:
    """v^T G v / 2 of every row."""
    energies = []
    for q, v in zip(motion.q, motion.v, strict=True):
        slope = density.evaluate(q, v, obstacles).jacobian @ v
        energies.append(0.5 * (v @ v + slope @ slope))
    return np.array(energies)


@pytest.mark.parametrize("name", ROBOTS)
def test_geodesics_keep_their_energy(name: str) -> None:
    robot, density, obstacles, q, v = wide_scene(name)
    system = GeometricSystem([density], switch=thesis.GeodesicOnly())
    drifts, turns = [], []
    for steps in (100, 200, 2000):
        motion = thesis.rollout(
            system,
            q,
            v,
            robot.neutral,
            obstacles,
            period=2.0 / steps,
            steps=steps,
            integrator="runge_kutta_4",
        )
        energy = kinetic_energies(motion, density, obstacles)
        drifts.append(np.abs(energy / energy[0] - 1.0).max())
        turns.append(np.linalg.norm(motion.v[-1] - motion.v[0]))
    assert min(turns) > 0.05  # the space is curved enough for this to say something
    # fourth order: halving dt divides the drift by 16; 12 leaves room for the next order
    assert drifts[0] / drifts[1] > 12.0
    assert drifts[2] < 1e-8


@pytest.mark.parametrize("name", ROBOTS)
def test_a_geodesic_runs_backwards_through_the_same_states(name: str) -> None:
    robot, density, obstacles, q, v = wide_scene(name)
    system = GeometricSystem([density], switch=thesis.GeodesicOnly())
    settings = {"period": 1e-3, "steps": 1000, "integrator": "runge_kutta_4"}
    there = thesis.rollout(system, q, v, robot.neutral, obstacles, **settings)
    back = thesis.rollout(system, there.q[-1], -there.v[-1], robot.neutral, obstacles, **settings)
    # the integrator's error over a second, see the drift above
    np.testing.assert_allclose(back.q[::-1], there.q, atol=1e-8)
    np.testing.assert_allclose(-back.v[::-1], there.v, atol=1e-8)
    speeds = kinetic_energies(there, density, obstacles), kinetic_energies(back, density, obstacles)[::-1]
    np.testing.assert_allclose(*speeds, rtol=1e-8)


@pytest.mark.parametrize("name", ROBOTS)
def test_metric_damping_loses_energy_all_the_way(name: str) -> None:
    robot, density, obstacles, q, v = wide_scene(name)
    rng = np.random.default_rng(2)
    factors = rng.normal(size=(2, robot.num_coordinates, robot.num_coordinates))
    K, D = (np.eye(len(f)) + 0.1 * f @ f.T for f in factors)
    goal = q + 0.25 * (robot.limits.upper - robot.limits.lower).clip(max=3.0) * rng.uniform(-1, 1, q.size)
    system = GeometricSystem([density], stiffness=K, damping=D, damping_form="metric")
    motion = thesis.rollout(
        system, q, v, goal, obstacles, period=2e-3, steps=3000, integrator=thesis.Integrator.runge_kutta_4
    )
    away = motion.q - goal
    spring = 0.5 * np.einsum("ki,ij,kj->k", away, K, away)
    energy = kinetic_energies(motion, density, obstacles) + spring
    # dV/dt = -v^T D v: the loss of a step is its integral, here by Simpson's rule over pairs of steps
    power = np.einsum("ki,ij,kj->k", motion.v, D, motion.v)
    loss = 2e-3 / 3.0 * (power[:-2:2] + 4.0 * power[1:-1:2] + power[2::2])
    # both rules are of fourth order in 2 ms
    np.testing.assert_allclose(energy[:-2:2] - energy[2::2], loss, rtol=0, atol=1e-8 * energy[0])
    assert (np.diff(energy) < 1e-12 * energy[0]).all()
    assert energy[-1] < 0.5 * energy[0]  # it has moved, slowly where the metric is large


@pytest.mark.parametrize(
    ("integrator", "order", "steps"),
    # second_order has a second-order q within one step, but the v of explicit Euler: the motion is of first
    [("semi_implicit_euler", 1, 200), ("second_order", 1, 200), ("runge_kutta_4", 4, 50)],
)
def test_orders_of_convergence(integrator: str, order: int, steps: int) -> None:
    _, density, obstacles, q, v = wide_scene("planar3")
    moving = ss.Obstacles(obstacles.points, obstacles.radii, [[0.1, -0.2, 0.0], [0.0, 0.3, 0.1]])
    system = GeometricSystem([density], stiffness=2.0, damping=1.0)
    goal = q + 0.5
    nv = q.size

    def rate(time: float, state: np.ndarray) -> np.ndarray:
        at = ss.Obstacles(moving.points + time * moving.velocities, moving.radii, moving.velocities)
        step = system.acceleration(state[:nv], state[nv:], goal, at)
        return np.concatenate([state[nv:], step.acceleration])

    reference = solve_ivp(rate, (0.0, 1.0), np.concatenate([q, v]), method="DOP853", rtol=1e-12, atol=1e-13)
    errors = []
    for num in (steps, 2 * steps):
        motion = thesis.rollout(
            system, q, v, goal, moving, period=1.0 / num, steps=num, integrator=integrator
        )
        end = np.concatenate([motion.q[-1], motion.v[-1]])
        errors.append(np.linalg.norm(end - reference.y[:, -1]))
    # the next order of the error is felt at these steps; 0.6 still tells 4 from 3 and 5
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.6)


def test_rows_are_times_states_and_what_the_system_says_there() -> None:
    _, density, obstacles, q, v = wide_scene("planar3")
    moving = ss.Obstacles(obstacles.points, obstacles.radii, [[0.1, -0.2, 0.0], [0.0, 0.3, 0.1]])
    switch = thesis.SigmoidSwitch(2.0, 1.0)
    system = GeometricSystem([density], switch=switch)
    goal, dt = q + 0.3, 0.01
    updates = {
        "semi_implicit_euler": lambda q, v, a: (q + dt * (v + dt * a), v + dt * a),
        "second_order": lambda q, v, a: (q + dt * v + 0.5 * dt**2 * a, v + dt * a),
    }
    for integrator, update in updates.items():
        motion = thesis.rollout(system, q, v, goal, moving, period=dt, steps=20, integrator=integrator)
        np.testing.assert_allclose(motion.time, dt * np.arange(21), atol=1e-15)
        state = q, v
        for k in range(21):
            at = ss.Obstacles(moving.points + k * dt * moving.velocities, moving.radii, moving.velocities)
            step = system.acceleration(*state, goal, at)
            # the same operations; the obstacles are moved step by step there, in one go here
            np.testing.assert_allclose(motion.q[k], state[0], rtol=0, atol=1e-13)
            np.testing.assert_allclose(motion.v[k], state[1], rtol=0, atol=1e-13)
            np.testing.assert_allclose(motion.acceleration[k], step.acceleration, rtol=0, atol=1e-11)
            np.testing.assert_allclose(motion.values[k], step.values, rtol=1e-11)
            np.testing.assert_allclose(motion.switch[k], step.switch, rtol=1e-11)
            assert motion.statuses[k] == step.status
            state = update(*state, step.acceleration)


def test_the_callers_obstacles_stay_where_they_are() -> None:
    _, density, obstacles, q, v = wide_scene("planar2")
    moving = ss.Obstacles(obstacles.points, obstacles.radii, np.ones((2, 3)))
    thesis.rollout(GeometricSystem([density]), q, v, q, moving, steps=10)
    np.testing.assert_array_equal(moving.points, obstacles.points)


def test_a_fallback_brakes_and_is_reported_in_every_row() -> None:
    _, density, obstacles, q, v = wide_scene("fr3")
    motion = thesis.rollout(GeometricSystem([density]), np.full(7, np.nan), v, q, obstacles, steps=1000)
    assert set(motion.statuses) == {StepStatus.invalid_state}
    # v decays with 10/s for a second
    np.testing.assert_allclose(motion.v[-1], v * (1 - 10 * 1e-3) ** 1000, rtol=1e-9)
    # what the equations would have said is not known in these rows
    assert np.isnan(motion.values).all()
    assert np.isnan(motion.switch).all()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"steps": 0}, "steps is 0, must be at least 1"),
        ({"steps": 1, "period": 0.0}, "period is 0.0* s, must be positive and finite"),
        ({"steps": 1, "period": np.nan}, "period is nan s, must be positive and finite"),
        (
            {"steps": 1, "integrator": "euler"},
            "integrator is 'euler', must be one of: semi_implicit_euler, second_o",
        ),
        ({"steps": 1, "q": np.zeros(3)}, r"q has shape \(3,\), expected \(2,\)"),
        ({"steps": 1, "v": np.zeros(3)}, r"v has shape \(3,\), expected \(2,\)"),
        ({"steps": 1, "goal": np.zeros(3)}, r"goal has shape \(3,\), expected \(2,\)"),
    ],
)
def test_a_bad_argument_is_named(settings: dict, message: str) -> None:
    _, density, obstacles, q, v = wide_scene("planar2")
    given = {"q": q, "v": v, "goal": q, "obstacles": obstacles} | settings
    with pytest.raises(ValueError, match=message):
        thesis.rollout(GeometricSystem([density]), **given)
