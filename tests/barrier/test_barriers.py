"""Barriers of clearances: derivatives, lower bounds, independence of sampling, and what is refused."""

from collections.abc import Callable

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

import sidestep as ss
from sidestep import _core, thesis
from sidestep.controller import BarrierSettings
from sidestep.distance import SelfCollision
from sidestep.robot import planar_arm
from sidestep.system import (
    ClearanceBarrier,
    ClearanceTable,
    ClearanceTableBarrier,
    CoordinateKind,
    Embedding,
    GeometricSystem,
    JointLimitBarrier,
    PlaneBarrier,
    SelfCollisionBarrier,
)
from support.finite_differences import derivative, second_derivative
from support.random_scene import random_body

ROBOTS = ["planar3", "ur5", "fr3_arm"]
NUM_STATES = 60
# Against differences of fourth order: rounding of values up to 1e2 over a step of 1e-4 rad.
TOLERANCE = 1e-6
# Second differences in time: rounding of values up to 1e2 over (1e-3 s)^2, and a truncation that the small radii of
# curvature of the Boltzmann mean make visible.
TIME_TOLERANCE = 1e-4


def covering(robot: ss.Robot, seed: int) -> ss.Body:
    """A random body with levels; nothing here needs it to cover the meshes."""
    rng = np.random.default_rng(seed)
    body = random_body(robot, rng)
    return _core.Body(
        links=body.links,
        weights=body.weights,
        means=body.means,
        covariances=body.covariances,
        levels=rng.uniform(0.3, 1.5, body.num_components),
    )


def pairs_of(robot: ss.Robot) -> list[tuple[str, str]]:
    first = {frame.joint: frame.name for frame in robot.frames if frame.joint >= 0}
    joints = sorted(first)
    return [(first[joints[0]], first[joints[-1]]), (first[joints[1]], first[joints[-1]])]


def barrier_cases() -> dict[str, Callable[[ss.Robot, ss.Body], Embedding]]:
    """Wide and soft, so that most states are within reach and differences resolve them."""
    wide = {"activation": 0.8, "temperature": 0.02, "floor": 0.02}
    return {
        # Points that come into a narrower window are seen by second differences.
        "obstacles": lambda robot, body: ClearanceBarrier(robot, body, reach=0.8, window=24.0, **wide),
        "self": lambda robot, body: SelfCollisionBarrier(robot, body, pairs_of(robot), **wide),
        "plane": lambda robot, body: PlaneBarrier(
            robot, body, point=[0, 0, -0.4], normal=[0.1, -0.2, 1.0], links=[pairs_of(robot)[0][1]], **wide
        ),
        "limits": lambda robot, body: JointLimitBarrier(robot, activation=2.0, floor=0.02),
        "tables": lambda robot, body: ClearanceTableBarrier(
            robot, [table_of(robot)], activation=0.8, floor=0.02
        ),
    }


def table_of(robot: ss.Robot) -> ClearanceTable:
    """Of random control points, one axis of which is one turn."""
    control = np.random.default_rng(2).uniform(0.15, 1.2, (12, 4))
    turn = 2.0 * np.pi / 4
    return ClearanceTable(
        *pairs_of(robot)[1],
        coordinates=(2, 1),
        begin=(-8.0, 0.1),
        spacing=(1.6, turn),
        periodic=(False, True),
        control=control,
    )


def test_links_that_are_usually_near_have_short_barriers() -> None:
    robot = ss.Robot.named("planar3")
    usual = (0.004, 0.0105, 0.02, -0.001)

    def table(median: float) -> ClearanceTable:
        control = np.full((9, 9), median)
        control[:4] = 0.3
        return ClearanceTable(
            "link1",
            "link3",
            coordinates=(1, 2),
            begin=(-4.0, -4.0),
            spacing=(1.0, 1.0),
            periodic=(False, False),
            control=control,
        )

    barrier = ClearanceTableBarrier(robot, [table(h) for h in usual], activation=0.05)
    at = barrier.evaluate(np.array([0.0, 2.0, 0.0]), np.zeros(3), ss.Obstacles.none())
    assert at.clearances == pytest.approx(usual)
    assert list(at.values > 0.0) == [False, False, True, True]


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("kind", ["obstacles", "self", "plane", "limits", "tables"])
def test_derivatives(name: str, kind: str) -> None:
    robot = ss.Robot.named(name)
    barrier = barrier_cases()[kind](robot, covering(robot, 0))
    rng = np.random.default_rng(1)
    seen, errors = 0, []
    for _ in range(NUM_STATES):
        q = robot.random_configuration(rng)
        v = rng.normal(size=q.size)
        points, speeds = rng.uniform(-0.9, 0.9, (12, 3)), rng.normal(scale=0.3, size=(12, 3))
        radii = rng.uniform(0.0, 0.05, 12)

        def at(
            t: float, q: np.ndarray = q, v: np.ndarray = v, points: np.ndarray = points,
            radii: np.ndarray = radii, speeds: np.ndarray = speeds,
        ) -> np.ndarray:  # fmt: skip
            moved = ss.Obstacles(points + t * speeds, radii, speeds)
            return barrier.evaluate(q + t * v, v, moved).values

        obstacles = ss.Obstacles(points, radii, speeds)
        e = barrier.evaluate(q, v, obstacles)
        near = e.clearances < 0.1 if kind != "limits" else np.zeros(barrier.num_coordinates, bool)
        good = ~near & (e.values < 1e2)  # steeper ones are beyond what differences resolve
        seen += int(np.count_nonzero(good & (e.values > 0.0)))
        numeric = derivative(lambda x, v=v, o=obstacles: barrier.evaluate(x, v, o).values, q)
        scale = 1.0 + np.abs(numeric[good])
        assert np.max(np.abs(e.jacobian - numeric)[good] / scale, initial=0.0) < TOLERANCE
        curvature = np.array(
            [second_derivative(lambda t, k=k, at=at: at(t)[k], 1e-3) for k in np.flatnonzero(good)]
        )
        errors.append(np.abs(e.curvatures[good] - curvature) / (1.0 + np.abs(curvature)))
    # Where the motion crosses the activation distance within the step, d2psi/dt2 jumps (power 2): few do.
    assert np.quantile(np.concatenate(errors), 0.99) < TIME_TOLERANCE
    assert seen > NUM_STATES // 4  # the states do exercise the barrier


def distances(shape: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Of points outside an ellipsoid, by halving the interval of the multiplier t (docs/theory, 5.1)."""
    squared, axes = np.linalg.eigh(shape)
    e = offsets @ axes
    low, high = np.zeros(len(e)), np.full(len(e), 10.0)
    for _ in range(80):
        t = 0.5 * (low + high)
        beyond = (squared * (e / (squared + t[:, None])) ** 2).sum(axis=1) > 1.0
        low, high = np.where(beyond, t, low), np.where(beyond, high, t)
    return low * np.linalg.norm(e / (squared + low[:, None]), axis=1)


def test_clearances_above_a_dense_wall_are_the_mean_over_all_points() -> None:
    """Hundreds of points weigh for one ellipsoid; sums over more than there was room for were wrong by centimetres."""
    robot = ss.Robot.named("panda")
    body = covering(robot, 0)
    rng = np.random.default_rng(4)
    points = np.column_stack([rng.uniform(-0.7, 0.7, (60_000, 2)), rng.normal(0.1, 0.001, 60_000)])
    window, temperature, activation = 12.0, 0.002, 0.1
    barrier = ClearanceBarrier(robot, body, activation=activation, temperature=temperature)
    obstacles = ss.Obstacles(points)
    compared = crowded = 0
    for _ in range(20):
        q = robot.random_configuration(rng)
        e = barrier.evaluate(q, rng.normal(size=q.size), obstacles)
        for found, k in zip(e.clearances, barrier.components, strict=True):
            if not found < activation:
                continue
            X = robot.pose(q, body.links[k])
            offsets = (points - X[:3, 3]) @ X[:3, :3] - body.means[k]
            shape, away = body.covariances[k] * body.levels[k], np.linalg.norm(offsets, axis=1)
            longest = np.sqrt(np.linalg.eigvalsh(shape)[-1])
            h = distances(shape, offsets[away < away.min() + longest + window * temperature])
            near = h[h < h.min() + window * temperature]
            weights = np.exp(-(near - near.min()) / temperature)
            mean = (weights @ near) / weights.sum()
            if near.min() > 0.0 and mean < activation - 1e-6:  # beyond what approaches is told
                assert found == pytest.approx(mean, abs=1e-12)
                compared += 1
                crowded += len(near) > 512
    assert compared > 20
    assert crowded > 5


def test_a_point_beyond_single_precision_hides_none_that_is_near() -> None:
    """Cameras mark what they do not see by the largest number; squares of it overflow in bounds of its node."""
    robot = ss.Robot.named("panda")
    barrier = ClearanceBarrier(robot, covering(robot, 0), activation=0.1)
    rng = np.random.default_rng(6)
    wall = np.column_stack([rng.uniform(-0.7, 0.7, (2000, 2)), np.full(2000, 0.1)])
    largest = float(np.finfo(np.float32).max)
    marked = ss.Obstacles(np.vstack([wall, [[largest, 0.0, 0.0], [0.0, -1e25, 0.0]]]))
    seen = 0
    for _ in range(20):
        q = robot.random_configuration(rng)
        for v in (np.zeros(q.size), rng.normal(size=q.size)):
            found = barrier.evaluate(q, v, marked).clearances
            expected = barrier.evaluate(q, v, ss.Obstacles(wall)).clearances
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-13)  # the order of sums
            seen += int((expected < 0.1).sum())
    assert seen > 20


@pytest.mark.parametrize("window", [6.0, 12.0])
def test_points_beyond_the_window_hardly_matter(window: float) -> None:
    robot = ss.Robot.named("panda")
    body = covering(robot, 0)
    rng = np.random.default_rng(3)
    temperature, num_points = 0.002, 3000
    points = np.column_stack([rng.uniform(-0.8, 0.8, (num_points, 2)), np.full(num_points, 0.35)])
    obstacles = ss.Obstacles(points)
    narrow = ClearanceBarrier(robot, body, window=window)
    wide = ClearanceBarrier(robot, body, window=30.0)
    seen, differs = 0, 0.0
    for _ in range(20):
        q, v = robot.random_configuration(rng), rng.normal(size=robot.num_coordinates)
        e, f = narrow.evaluate(q, v, obstacles), wide.evaluate(q, v, obstacles)
        near = np.isfinite(f.clearances) & np.isfinite(e.clearances)
        seen += int(near.sum())
        difference = f.clearances[near] - e.clearances[near]
        # The weighted mean of what is left out, which is farther than the window: more, and by no more than all of it.
        assert np.all(difference >= -1e-15)
        assert np.all(difference < num_points * window * np.exp(-window) * temperature)
        differs = max(differs, float(difference.max(initial=0.0)))
    assert seen > 20
    # It is window exp(-window) temperature where as many points lie at every clearance, and more lie farther off here.
    assert 0.0 < differs < 4.0 * window * np.exp(-window) * temperature


def test_clearance_is_a_lower_bound_exact_on_the_axes() -> None:
    robot = ss.Robot.named("planar2")
    semi_axes = np.array([0.10, 0.05, 0.02])
    R = Rotation.from_euler("xyz", [0.3, -0.5, 0.9]).as_matrix()
    link = robot.frames[-1].name
    body = _core.Body(
        links=[link],
        weights=[1.0],
        means=[[0.0, 0.0, 0.0]],
        covariances=[R @ np.diag(semi_axes**2) @ R.T],
        levels=[1.0],
    )
    barrier = ClearanceBarrier(robot, body, activation=0.2, reach=0.5)
    q = np.zeros(2)
    X = robot.pose(q, link)

    def clearance(y: np.ndarray) -> float:
        world = X[:3, :3] @ (R @ y) + X[:3, 3]
        return float(barrier.evaluate(q, q, ss.Obstacles([world])).clearances[0])

    for axis in range(3):
        y = (semi_axes[axis] + 0.07) * np.eye(3)[axis]
        assert clearance(y) == pytest.approx(0.07, abs=1e-12)  # rounding
    sphere = trimesh.creation.icosphere(subdivisions=5).vertices
    surface = sphere * semi_axes
    rng = np.random.default_rng(0)
    for _ in range(200):
        y = rng.normal(size=3)
        y *= rng.uniform(0.03, 0.25) / np.linalg.norm(y)
        if np.sum((y / semi_axes) ** 2) > 1.0:
            nearest = np.linalg.norm(
                surface - y, axis=1
            ).min()  # at most the sampling above the true distance
            assert 0.0 < clearance(y) <= nearest
        else:
            assert clearance(y) <= 0.0


def test_self_clearance_is_a_lower_bound_of_the_distance() -> None:
    robot = ss.Robot.named("planar3")
    body = covering(robot, 3)
    pair = pairs_of(robot)[0]
    barrier = SelfCollisionBarrier(robot, body, [pair], activation=2.0, temperature=1e-5)
    directions = trimesh.creation.icosphere(subdivisions=3).vertices

    def surface(q: np.ndarray, link: str) -> np.ndarray:
        X = robot.pose(q, link)
        parts = []
        for name, mean, covariance, level in zip(
            body.links, body.means, body.covariances, body.levels, strict=True
        ):
            if name == link:
                root = np.linalg.cholesky(level * covariance)
                parts.append((directions @ root.T + mean) @ X[:3, :3].T + X[:3, 3])
        return np.concatenate(parts)

    rng = np.random.default_rng(4)
    for _ in range(30):
        q = robot.random_configuration(rng)
        h = barrier.evaluate(q, np.zeros(3), ss.Obstacles.none()).clearances[0]
        a, b = surface(q, pair[0]), surface(q, pair[1])
        distance = np.sqrt(((a[:, None] - b[None]) ** 2).sum(-1)).min()
        # The Boltzmann mean exceeds the smallest gap by a few temperatures (1e-5 m) at most.
        assert h <= distance + 1e-4


def wall(spacing: float) -> ss.Obstacles:
    """A wall beside the arm, whose points cover it as a camera would see it."""
    y, z = np.meshgrid(np.arange(-0.3, 0.3, spacing), np.arange(-0.06, 0.06, spacing))
    x = np.full(y.size, 0.62)
    return ss.Obstacles(np.stack([x, y.ravel(), z.ravel()], axis=1))


def test_a_wall_sampled_finely_moves_the_arm_as_one_sampled_coarsely() -> None:
    robot = ss.Robot.from_urdf(planar_arm(2, link_length=0.35))
    links = [frame.name for frame in robot.frames if frame.joint >= 0]
    body = _core.Body(
        links=links,
        weights=np.ones(len(links)),
        means=np.tile([0.175, 0.0, 0.0], (len(links), 1)),
        covariances=np.tile(np.diag([0.2, 0.04, 0.04]) ** 2, (len(links), 1, 1)),
        levels=np.ones(len(links)),
    )
    system = GeometricSystem(
        [ClearanceBarrier(robot, body, activation=0.2, strength=0.05)], stiffness=2.0, damping=3.0
    )
    start, goal = np.array([-1.3, 0.2]), np.array([1.3, -0.2])
    motions = [
        thesis.rollout(system, start, np.zeros(2), goal, wall(spacing), period=0.004, steps=750)
        for spacing in (0.01, 0.002)
    ]
    straight = thesis.rollout(system, start, np.zeros(2), goal, ss.Obstacles.none(), period=0.004, steps=750)
    bent = np.abs(motions[0].q - straight.q).max()
    assert bent > 0.1  # rad: the wall is in the way
    # A soft minimum would be lower by T log 25 = 6.4 mm on the finer cloud; here the arms agree to what a spacing of
    # 1 cm leaves open at 5 cm from the wall, (5 mm)^2 / (2 * 50 mm) = 0.25 mm, over a lever of about 0.1 m.
    assert np.abs(motions[0].q - motions[1].q).max() < 0.01


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda r, b: ClearanceBarrier(r, ss.Body.fit(r, components=1)), "the body is not calibrated"),
        (lambda r, b: ClearanceBarrier(r, b, activation=0.0), "activation is 0.0*, must be positive"),
        (lambda r, b: ClearanceBarrier(r, b, strength=-1.0), "strength is -1.0*, must be positive"),
        (lambda r, b: ClearanceBarrier(r, b, power=1.0), "power is 1.0*, must be at least 2"),
        (lambda r, b: ClearanceBarrier(r, b, floor=0.2), "floor is 0.2.*, must be positive and below"),
        (lambda r, b: ClearanceBarrier(r, b, temperature=np.nan), "temperature is nan"),
        (lambda r, b: ClearanceBarrier(r, b, window=0.5), "window is 0.5.* temperatures, must be from 1"),
        (lambda r, b: SelfCollisionBarrier(r, b, []), "there is no pair of links"),
        (lambda r, b: SelfCollisionBarrier(r, b, [("link1", "link9")]), "has no link 'link9'"),
        (lambda r, b: SelfCollisionBarrier(r, b, [("link1", "link1")]), "rigidly connected"),
        (lambda r, b: PlaneBarrier(r, b, point=[0, 0, 0], normal=[0, 0, 0], links=["link1"]), "not zero"),
        (lambda r, b: PlaneBarrier(r, b, point=[0, 0, 0], normal=[0, 0, 1], links=[]), "there is no link"),
    ],
)
def test_what_is_wrong_is_named(make: Callable[[ss.Robot, ss.Body], Embedding], message: str) -> None:
    robot = ss.Robot.named("planar2")
    with pytest.raises(ValueError, match=message):
        make(robot, covering(robot, 0))


@pytest.mark.parametrize("name", ROBOTS)
def test_lowered_barriers_leave_the_goal_flat_and_keep_what_is_far(name: str) -> None:
    robot = ss.Robot.named(name)
    rng = np.random.default_rng(1)
    wide = BarrierSettings(activation=0.5, limit_activation=0.5, floor=0.01)
    arm = _core.Arm(
        robot=robot,
        body=covering(robot, 1),
        pairs=[],
        tables=[],
        inertials=(),
        proof=[],
        allowed_pairs=[],
        provenance=_core.Provenance(source="", fingerprint="", sidestep_version="", date=""),
    )
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True, planner=None, barriers=wide))
    system = controller.system
    goal, rest = robot.random_configuration(rng), np.zeros(robot.num_coordinates)
    obstacles = ss.Obstacles(rng.uniform(-1.0, 1.0, (10, 3)), radii=0.02)
    before = system.acceleration(goal, rest, goal, obstacles)
    controller.set_goal(goal)
    controller.set_obstacles(obstacles)
    controller.step(goal, rest)
    activations = controller.activations
    after = system.acceleration(goal, rest, goal, obstacles, activations)
    np.testing.assert_array_equal(after.values, controller.values)
    clearances, margins = np.array(before.clearances.values), np.array(before.clearances.margins)
    # 0.9 of a clearance of more than two floors / 0.9 is below it, so the barrier is not active there.
    free = clearances > 2.0 * 0.01 / 0.9
    assert np.any(free & (before.values > 0.0))
    np.testing.assert_array_equal(after.values[free], 0.0)
    # What is seen keeps its safety margin, of what is known no more is kept than half the activation distance.
    kinds = np.array([label.kind for label in controller.labels])
    seen, joints = kinds == CoordinateKind.obstacle, kinds == CoordinateKind.joint_limit
    np.testing.assert_array_equal(margins[seen], np.inf)
    np.testing.assert_array_equal(after.clearances.margins[seen], np.inf)
    np.testing.assert_allclose(after.clearances.margins[joints], 0.5 * activations[joints], rtol=1e-12)
    np.testing.assert_allclose(
        activations[joints], np.clip(0.9 * clearances[joints], 2.0 * 0.01, 2.0 * margins[joints]), rtol=1e-12
    )
    # Where nothing is within reach of the goal the activation distance is what it was: elsewhere nothing changes.
    other = robot.random_configuration(rng)
    unchanged = ~np.isfinite(clearances)
    values = [
        system.acceleration(other, rest, goal, obstacles, lowered).values for lowered in (None, activations)
    ]
    np.testing.assert_array_equal(values[0][unchanged], values[1][unchanged])


def test_a_goal_at_which_links_almost_touch_is_reached() -> None:
    """Links 5 and 7 of the panda are 0.8 mm apart there, within the safety margin: it is relaxed with the barrier."""
    robot = ss.Robot.named("panda")
    goal = np.array([2.461, -0.181, 0.521, -2.76, -2.88, 0.094, -2.072])
    start = goal + np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.4, 0.0])
    exact = SelfCollision(robot)
    assert 0.0 < exact.distance(goal).distance < 0.001
    errors = {}
    for name, lowered in (("stiff", False), ("relaxed", True)):
        settings = ss.ControllerSettings(
            synchronous=True,
            output="acceleration",
            planner=None,
            local_minimum=None,
            local_activation=lowered,
        )
        controller = ss.Controller(ss.Arm.from_robot(robot), settings)
        controller.set_obstacles(ss.Obstacles.none())
        controller.set_goal(goal)
        motion = ss.integrate(controller, start, 0.0 * start, steps=4000)
        assert exact.minimum_over(motion.q[::20], tolerance=1e-4).distance > 0.0
        errors[name] = np.abs(motion.last_q - goal).max()
    assert errors["relaxed"] < 0.05 < errors["stiff"]
