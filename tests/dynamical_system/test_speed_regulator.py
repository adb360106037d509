"""Regulating the speed along a motion: geodesics keep their path, and limits hold."""

import numpy as np
import pytest

import sidestep as ss
from sidestep import _core


def scene(name: str, seed: int = 3) -> tuple[ss.Robot, ss.Embedding, ss.Obstacles, np.ndarray, np.ndarray]:
    """Wide Gaussians and an obstacle next to the arm: psi is smooth, and strong enough to bend the path."""
    robot = ss.Robot.named(name)
    rng = np.random.default_rng(seed)
    links = [next(f.name for f in robot.frames if f.joint == j) for j in range(len(robot.joints))]
    body = ss.Body(
        links=links,
        weights=np.ones(len(links)),
        means=rng.uniform(-0.1, 0.1, (len(links), 3)),
        covariances=[np.diag(rng.uniform(0.3, 0.45, 3) ** 2) for _ in links],
    )
    q = robot.neutral
    tip = robot.pose(q, links[-1])[:3, 3]
    obstacles = ss.Obstacles(
        np.array([[0.2, 0.1, 0.1], [0.1, -0.2, 0.0]]) + np.outer([1.0, 0.5], tip), [0.05, 0.0]
    )
    v = rng.normal(size=robot.num_coordinates)
    return robot, ss.CollisionDensity(robot, body), obstacles, q, v / np.linalg.norm(v)


def distance_to_curve(points: np.ndarray, curve: np.ndarray) -> float:
    """The largest distance of a point to the polygon of the curve's points."""
    start, edge = curve[:-1], np.diff(curve, axis=0)
    length2 = np.maximum((edge**2).sum(axis=1), 1e-300)
    worst = 0.0
    for point in points:
        along = np.clip(((point - start) * edge).sum(axis=1) / length2, 0.0, 1.0)
        worst = max(worst, float(np.linalg.norm(start + along[:, None] * edge - point, axis=1).min()))
    return worst


@pytest.mark.parametrize("name", ["planar2", "planar3", "ur5", "fr3"])
def test_geodesics_keep_their_path(name: str) -> None:
    robot, density, obstacles, q, direction = scene(name)
    start_ratio = np.max(np.abs(direction) / robot.limits.velocity)
    regulator = ss.SpeedRegulator(joint_fraction=0.6 * start_ratio)  # the start is too fast by two thirds
    free = ss.GeometricSystem([density], switch=ss.GeodesicOnly())
    slowed = ss.GeometricSystem([density], switch=ss.GeodesicOnly(), speed=regulator)
    options = {"period": 0.002, "steps": 700, "integrator": "runge_kutta_4"}
    fast = ss.rollout(free, q, direction, robot.neutral, obstacles, **options)
    slow = ss.rollout(slowed, q, direction, robot.neutral, obstacles, **options)
    curve = np.linalg.norm(fast.v[-1] / np.linalg.norm(fast.v[-1]) - direction)
    assert curve > 0.02  # the path is bent enough for this to say something
    travelled = [np.linalg.norm(np.diff(m.q, axis=0), axis=1).sum() for m in (fast, slow)]
    assert travelled[1] < 0.9 * travelled[0]  # and the motion slower
    # Chords of 2 ms at 1 rad/s stand off the curve by length^2 curvature/8: 5e-7 per 1/rad of curvature.
    assert distance_to_curve(slow.q[::10], fast.q) < 3e-6


def test_a_clipped_acceleration_does_not_keep_the_path() -> None:
    """The guard above can fail: clipping joint by joint, as the bounds of a filter do, leaves the curve."""
    robot, density, obstacles, q, direction = scene("planar2")
    free = ss.GeometricSystem([density], switch=ss.GeodesicOnly())
    fast = ss.rollout(
        free, q, direction, robot.neutral, obstacles, period=0.002, steps=700, integrator="runge_kutta_4"
    )
    at, v, points = q.copy(), direction.copy(), [q.copy()]
    for _ in range(700):
        limit = np.array([1.0, 0.6 * abs(direction[1])])
        v = np.clip(
            v + 0.002 * free.acceleration(at, v, robot.neutral, obstacles).acceleration, -limit, limit
        )
        at = at + 0.002 * v
        points.append(at.copy())
    assert distance_to_curve(np.array(points)[::10], fast.q) > 1e-3


@pytest.mark.parametrize("name", ["ur5", "fr3"])
def test_joint_speeds_stay_below_their_limits(name: str) -> None:
    robot = ss.Robot.named(name)
    rng = np.random.default_rng(0)
    for joint_fraction in (0.3, 0.9):
        system = ss.GeometricSystem(
            [],
            robot=robot,
            stiffness=10.0,
            damping=2.0,
            speed=ss.SpeedRegulator(joint_fraction=joint_fraction),
        )
        for _ in range(3):
            q, goal = robot.random_configuration(rng), robot.random_configuration(rng)
            motion = ss.rollout(system, q, 0.0 * q, goal, ss.Obstacles.none(), period=0.001, steps=1500)
            ratio = np.abs(motion.v) / (joint_fraction * robot.limits.velocity)
            assert np.max(ratio) > 0.7  # eight joints at the same ratio make the smooth maximum 30 % higher
            # rho is convex: a step of dt overshoots by (a dt)^2/2 over the limit squared, with a up to 120 /s^2.
            assert np.max(ratio) < 1.02


def test_drag_by_value() -> None:
    robot = ss.Robot.named("planar2")
    limits = robot.limits.velocity
    system = ss.GeometricSystem(
        [], robot=robot, stiffness=0.0, damping=0.0, speed=ss.SpeedRegulator(joint_fraction=0.5, rate=4.0)
    )
    q = np.zeros(2)

    def step(ratio: float) -> ss.Step:
        return system.acceleration(q, [-ratio * 0.5 * limits[0], 0.0], q, ss.Obstacles.none())

    assert step(0.0).speed_drag == 0.0
    assert step(0.999).speed_drag == 0.0  # nothing accelerates
    np.testing.assert_allclose(step(0.7).speed_ratio, 0.7, rtol=1e-14)
    np.testing.assert_allclose(step(2.0).speed_drag, 4.0 * (1.0 - 2.0) / 2.0, rtol=1e-14)
    np.testing.assert_allclose(
        step(2.0).acceleration, [2.0 * limits[0], 0.0], rtol=1e-14
    )  # beta v = -2 (-limit)


def clearance_scene() -> tuple[ss.Robot, ss.Embedding, ss.Obstacles, np.ndarray]:
    robot = ss.Robot.named("planar3")
    links = [next(f.name for f in robot.frames if f.joint == j) for j in range(3)]
    body = _core.Body(
        links=links,
        weights=np.ones(3),
        means=np.zeros((3, 3)),
        covariances=[np.diag([0.05, 0.04, 0.06]) ** 2] * 3,
        levels=np.ones(3),
    )
    goal = robot.neutral
    obstacles = ss.Obstacles(robot.pose(goal, links[-1])[None, :3, 3], [0.05])
    return robot, _core.ClearanceBarrier(robot, body, activation=0.05, reach=2.0), obstacles, goal


def test_closing_speeds_stay_below_what_the_clearance_allows() -> None:
    _, barrier, obstacles, goal = clearance_scene()
    allowed_at = (0.1, 1.0)  # 0.1 m/s + 1/s times the clearance
    regulator = ss.SpeedRegulator(closing_speed=allowed_at[0], closing_slope=allowed_at[1])
    worst = {}
    for name, speed in (("free", None), ("regulated", regulator)):
        system = ss.GeometricSystem([barrier], stiffness=20.0, damping=2.0, speed=speed)
        q, v, worst[name] = goal + np.array([0.5, 0.5, -0.3]), np.zeros(3), 0.0
        for _ in range(3000):
            step = system.acceleration(q, v, goal, obstacles)
            near = np.asarray(step.clearances.nearest) >= 0
            allowed = allowed_at[0] + allowed_at[1] * np.maximum(step.clearances.values[near], 0.0)
            ratio = -step.clearances.rates[near] / allowed
            worst[name] = max(worst[name], np.max(ratio, initial=0.0))
            v = v + 0.001 * step.acceleration
            q = q + 0.001 * v
    assert worst["free"] > 1.5
    assert worst["regulated"] > 0.8
    assert worst["regulated"] < 1.01  # one step of 1 ms at 20 rad/s^2 over 0.1 m/s


def test_settings_are_checked() -> None:
    for setting, value in [
        ("joint_fraction", 0.0),
        ("rate", -1.0),
        ("closing_speed", 0.0),
        ("closing_slope", -0.5),
    ]:
        with pytest.raises(ValueError, match=f"speed regulator: {setting} is"):
            ss.SpeedRegulator(**{setting: value})
