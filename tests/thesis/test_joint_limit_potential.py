"""The joint-limit potential against its formula (T5.7, T5.11 corrected) and automatic differentiation."""

import casadi as ca
import numpy as np
import pytest

import sidestep as ss
from sidestep import thesis
from sidestep.robot import planar_arm
from support.finite_differences import derivative
from support.random_scene import NUM_STATES, ROBOTS

SLOPE, HEIGHT = 12.0, 3.0
EXACT = 1e-12  # a sum of 14 sigmoids written twice: rounding only


def oracle(robot: ss.Robot) -> ca.Function:
    q = ca.SX.sym("q", robot.num_coordinates)
    zeta = ca.SX(0)
    for j, (lower, upper) in enumerate(zip(robot.limits.lower, robot.limits.upper, strict=True)):
        for distance in (q[j] - upper, lower - q[j]):
            zeta += HEIGHT / (1 + ca.exp(-SLOPE * distance))
    hessian, gradient = ca.hessian(zeta, q)
    return ca.Function("limits", [q], [zeta, gradient, hessian])


@pytest.mark.parametrize("name", ROBOTS)
def test_against_automatic_differentiation_and_finite_differences(name: str) -> None:
    robot = ss.Robot.named(name)
    limits = thesis.JointLimitPotential(robot, slope=SLOPE, height=HEIGHT)
    function = oracle(robot)
    rng = np.random.default_rng(3)
    free = ss.Obstacles.none()
    for _ in range(NUM_STATES):
        q, v = robot.random_configuration(rng), rng.normal(size=robot.num_coordinates)
        q = q + rng.normal(scale=0.3, size=q.size)  # also outside the limits
        zeta, gradient, hessian = (np.array(out) for out in function(q))
        result = limits.evaluate(q, v, free)
        scale = HEIGHT * SLOPE**2  # T5.11: of a second derivative; the first has one factor less
        np.testing.assert_allclose(result.values, zeta[0], rtol=EXACT)
        np.testing.assert_allclose(result.jacobian, gradient.T, rtol=0, atol=EXACT * scale)
        np.testing.assert_allclose(limits.hessian(q, free), hessian, rtol=0, atol=EXACT * scale)
        np.testing.assert_allclose(result.curvatures, [v @ hessian @ v], rtol=0, atol=EXACT * scale * (v @ v))

        def psi(q: np.ndarray, v=v) -> np.ndarray:
            return limits.evaluate(q, v, free).values

        # steps of 1e-4 against a length of 1/12: truncation 1e-11 of the scale; 1e-6 is asked for
        np.testing.assert_allclose(result.jacobian, derivative(psi, q), rtol=0, atol=1e-6 * HEIGHT * SLOPE)


def test_second_derivative_of_one_step() -> None:
    # T5.11 is misprinted in the thesis; the second derivative of s(alpha u) is alpha^2 s (1 - s) (1 - 2 s)
    robot = ss.Robot.named("planar2")
    limits = thesis.JointLimitPotential(robot, slope=30.0, height=1.0)
    upper = robot.limits.upper[0]
    for u in (-0.1, -0.02, 0.0, 0.03):
        s = 1.0 / (1.0 + np.exp(-30.0 * u))
        second = limits.hessian([upper + u, 0.0], ss.Obstacles.none())
        # the other limits are radians away: exp(-30 * 2) and less
        np.testing.assert_allclose(second, np.diag([900.0 * s * (1 - s) * (1 - 2 * s), 0.0]), atol=1e-9)


def test_half_the_height_at_a_limit_and_nothing_at_infinity() -> None:
    robot = ss.Robot.named("planar2")
    limits = thesis.JointLimitPotential(robot, slope=30.0, height=2.0)
    q = np.array([robot.limits.lower[0], 0.0])
    assert limits.evaluate(q, np.zeros(2), ss.Obstacles.none()).values[0] == pytest.approx(1.0, abs=1e-9)

    text = planar_arm(2).replace('type="revolute"', 'type="continuous"')
    unlimited = ss.Robot.from_urdf(text)
    assert np.isinf(unlimited.limits.upper).all()
    result = thesis.JointLimitPotential(unlimited).evaluate([100.0, -100.0], [1.0, 1.0], ss.Obstacles.none())
    assert result.values == [0.0]
    assert not result.jacobian.any()
    assert result.curvatures == [0.0]


@pytest.mark.parametrize("name", ["slope", "height"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.inf, np.nan])
def test_settings_must_be_positive_and_finite(name: str, value: float) -> None:
    robot = ss.Robot.named("planar2")
    with pytest.raises(ValueError, match=f"joint limit potential: {name} is .*, must be positive and finite"):
        thesis.JointLimitPotential(robot, **{name: value})
