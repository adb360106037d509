import numpy as np
import pytest

from sidestep import Obstacles, Robot
from sidestep._core import Body
from sidestep.bench.peers import dense_analytic, torch_autograd
from sidestep.bench.peers.serial_chain import SerialChain
from sidestep.system import GeometricSystem
from sidestep.thesis import CollisionDensity


def body_of(robot, rng):
    """Two Gaussians on every moved link, of the size of a link, so that points nearby see the arm."""
    links = [frame.name for frame in robot.frames if frame.joint >= 0 for _ in range(2)]
    roots = rng.normal(0.0, 0.1, (len(links), 3, 3))
    return Body(
        links=links,
        weights=np.full(len(links), 0.5),
        means=rng.normal(0.0, 0.1, (len(links), 3)),
        covariances=roots @ roots.transpose(0, 2, 1) + 0.02 * np.eye(3),
    )


def states(robot, rng, count):
    for _ in range(count):
        yield robot.random_configuration(rng), rng.normal(0.0, 1.0, robot.num_coordinates)


@pytest.fixture(params=["planar2", "planar3", "fr3_arm"])
def scene(request):
    rng = np.random.default_rng(7)
    robot = Robot.named(request.param)
    body = body_of(robot, rng)
    point = np.array([0.4, 0.2, 0.3 if robot.num_coordinates == 7 else 0.0])
    return robot, body, point, rng


def test_gradient_and_hessian_are_the_cores(scene):
    robot, body, point, rng = scene
    density = CollisionDensity(robot, body)
    chain = SerialChain.of(robot, body)
    for q, v in states(robot, rng, 100):
        ours = dense_analytic.psi(chain, q, point)
        core = density.evaluate(q, v, Obstacles(point[None]))
        hessian = density.hessian(q, Obstacles(point[None]))
        # Two exact formulas in double precision: only rounding differs.
        assert ours.value == pytest.approx(core.values[0], rel=1e-10)
        scale = np.abs(hessian).max() + 1e-12
        np.testing.assert_allclose(ours.gradient, core.jacobian[0], rtol=0, atol=1e-8 * scale)
        np.testing.assert_allclose(ours.hessian, hessian, rtol=0, atol=1e-8 * scale)
        np.testing.assert_allclose(v @ ours.hessian @ v, core.curvatures[0], atol=1e-8 * scale * (v @ v))


def test_acceleration_is_the_cores(scene):
    robot, body, point, rng = scene
    system = GeometricSystem([CollisionDensity(robot, body)], stiffness=0.5, damping=1.5)
    chain = SerialChain.of(robot, body)
    goal = robot.neutral
    for q, v in states(robot, rng, 50):
        core = system.acceleration(q, v, goal, Obstacles(point[None])).acceleration
        ours = dense_analytic.acceleration(chain, q, v, goal, point)
        # The dense inverse of a metric of condition up to 1e4 costs some of the sixteen digits.
        np.testing.assert_allclose(ours, core, rtol=0, atol=1e-8 * (1.0 + np.abs(core).max()))


def test_autograd_agrees(scene):
    pytest.importorskip("torch")
    robot, body, point, rng = scene
    chain = SerialChain.of(robot, body)
    automatic = torch_autograd.AutogradSystem(chain, point)
    for q, v in states(robot, rng, 3):
        ours = dense_analytic.psi(chain, q, point)
        value, gradient, hessian = automatic.derivatives(q)
        scale = np.abs(hessian).max() + 1e-12
        assert value == pytest.approx(ours.value, rel=1e-10)
        np.testing.assert_allclose(gradient, ours.gradient, rtol=0, atol=1e-8 * scale)
        np.testing.assert_allclose(hessian, ours.hessian, rtol=0, atol=1e-8 * scale)
        expected = dense_analytic.acceleration(chain, q, v, robot.neutral, point)
        found = automatic.acceleration(q, v, robot.neutral)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8 * (1.0 + np.abs(expected).max()))


def test_branching_or_coupled_joints_are_refused():
    robot = Robot.named("fr3")
    if robot.num_coordinates == 7 and all(j.parent == i - 1 for i, j in enumerate(robot.joints)):
        pytest.skip("this robot is serial")
    with pytest.raises(ValueError, match="serial revolute"):
        SerialChain.of(robot, body_of(robot, np.random.default_rng(0)))
