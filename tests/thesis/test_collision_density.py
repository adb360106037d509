"""The collision density against automatic differentiation of the thesis's formula, and finite differences."""

import numpy as np
import pytest

import sidestep as ss
from sidestep import thesis
from sidestep.system import ClearanceBarrier, PlaneBarrier, SelfCollisionBarrier
from support.finite_differences import derivative, second_derivative
from support.random_scene import ROBOTS, scene

# Two exact formulas in double precision, a few thousand operations each: 1e-12 where nothing cancels.
EXACT = 1e-9
# Fourth-order differences over 1e-4 rad, standard deviations above 3 cm: below 1e-9; 1e-6 is asked for.
DIFFERENCES = 1e-6


def assert_near(actual: np.ndarray, expected: np.ndarray, tolerance: float, scale: float = 0.0) -> None:
    """Relative to the largest entry, or to `scale`: the size of the terms that may cancel in it."""
    np.testing.assert_allclose(
        actual, expected, rtol=0, atol=tolerance * max(float(np.abs(expected).max()), scale)
    )


@pytest.mark.parametrize("name", ROBOTS)
def test_against_automatic_differentiation(name: str) -> None:
    case = scene(name)
    density = thesis.CollisionDensity(case.robot, case.body)
    for state in case.states:
        result = density.evaluate(state.q, state.v, state.obstacles)
        assert_near(result.values, np.array([state.psi]), EXACT)
        assert_near(result.jacobian[0], state.gradient, EXACT)
        assert_near(density.hessian(state.q, state.obstacles), state.hessian, EXACT)
        # the curvature adds terms of both signs, each of the size of |H| |v|^2
        scale = float(np.abs(state.hessian).sum() * np.abs(state.v).max() ** 2)
        assert_near(result.curvatures, np.array([state.curvature]), EXACT, scale)


@pytest.mark.parametrize("name", ROBOTS)
def test_against_finite_differences(name: str) -> None:
    case = scene(name)
    density = thesis.CollisionDensity(case.robot, case.body)
    for state in case.states:
        rest = np.zeros_like(state.q)

        def psi(q: np.ndarray, state=state, rest=rest) -> np.ndarray:
            return density.evaluate(q, rest, state.obstacles).values

        def gradient(q: np.ndarray, state=state, rest=rest) -> np.ndarray:
            return density.evaluate(q, rest, state.obstacles).jacobian[0]

        def psi_in_time(time: float, state=state, rest=rest) -> float:
            q, obstacles = state.at(time)
            return float(density.evaluate(q, rest, obstacles).values[0])

        result = density.evaluate(state.q, state.v, state.obstacles)
        hessian = density.hessian(state.q, state.obstacles)
        assert_near(result.jacobian, derivative(psi, state.q), DIFFERENCES)
        assert_near(hessian, derivative(gradient, state.q), DIFFERENCES)
        # 0.3 ms: points and links move below 3 mm, a tenth of the smallest standard deviation
        difference = np.array([second_derivative(psi_in_time, 3e-4)])
        scale = float(np.abs(hessian).sum() * np.abs(state.v).max() ** 2)
        assert_near(result.curvatures, difference, DIFFERENCES, scale)


@pytest.mark.parametrize("name", ROBOTS)
def test_curvature_at_rest_is_the_quadratic_form_of_the_hessian(name: str) -> None:
    case = scene(name)
    density = thesis.CollisionDensity(case.robot, case.body)
    for state in case.states:
        curvature = density.evaluate(state.q, state.v, state.at_rest()).curvatures[0]
        terms = np.outer(state.v, state.v) * state.hessian
        assert abs(curvature - terms.sum()) < EXACT * np.abs(terms).sum()


def one_gaussian(covariance: np.ndarray) -> tuple[ss.Robot, thesis.CollisionDensity, str]:
    robot = ss.Robot.named("planar2")
    link = next(frame.name for frame in robot.frames if frame.joint == 1)
    body = ss.Body(links=[link], weights=[1.0], means=[[0.1, 0.02, 0.0]], covariances=[covariance])
    return robot, thesis.CollisionDensity(robot, body), link


def test_a_radius_convolves_the_density_with_an_isotropic_gaussian() -> None:
    covariance = np.array([[4e-3, 1e-3, 0.0], [1e-3, 2e-3, -5e-4], [0.0, -5e-4, 3e-3]])
    _, density, _ = one_gaussian(covariance)
    q = np.array([0.3, -0.8])
    point, radius = np.array([0.7, -0.1, 0.05]), 0.03
    # Gauss-Hermite quadrature of the integral of N(x + z) N(z | 0, r^2 I) over z, 24 nodes an axis
    nodes, weights = np.polynomial.hermite_e.hermegauss(24)
    weights = weights / weights.sum()
    integral = 0.0
    for i, a in enumerate(nodes):
        for j, b in enumerate(nodes):
            for k, c in enumerate(nodes):
                shifted = ss.Obstacles([point + radius * np.array([a, b, c])])
                value = density.evaluate(q, np.zeros(2), shifted).values[0]
                integral += weights[i] * weights[j] * weights[k] * value
    widened = density.evaluate(q, np.zeros(2), ss.Obstacles([point], radius)).values[0]
    # the radius is three quarters of the smallest standard deviation: 24 nodes are good for 1e-9
    assert widened == pytest.approx(integral, rel=1e-7)


def test_value_at_the_mean_of_one_gaussian() -> None:
    covariance = np.diag([1e-2, 4e-2, 9e-2])
    robot, density, link = one_gaussian(covariance)
    q = np.array([0.3, -0.8])
    pose = robot.pose(q, link)
    at_mean = ss.Obstacles([pose[:3, 3] + pose[:3, :3] @ [0.1, 0.02, 0.0]])
    result = density.evaluate(q, np.zeros(2), at_mean)
    # (2 pi)^(-3/2) / (0.1 * 0.2 * 0.3): the dimension is 3, that of the task space (T4.2 corrected)
    assert result.values[0] == pytest.approx(1.0 / ((2 * np.pi) ** 1.5 * 6e-3), rel=1e-12)
    # rounding of the place of the mean, times the precision
    np.testing.assert_allclose(result.jacobian, 0.0, atol=1e-10)


def test_average_divides_by_the_number_of_points() -> None:
    case = scene("fr3")
    summed = thesis.CollisionDensity(case.robot, case.body)
    mean = thesis.CollisionDensity(case.robot, case.body, average=True)
    for state in case.states[:20]:
        num = len(state.obstacles)
        expected = summed.evaluate(state.q, state.v, state.obstacles)
        actual = mean.evaluate(state.q, state.v, state.obstacles)
        for name in ("values", "jacobian", "curvatures"):
            # one multiplication apart
            np.testing.assert_allclose(getattr(actual, name) * num, getattr(expected, name), rtol=1e-12)


def test_a_free_workspace_has_no_density() -> None:
    case = scene("fr3")
    density = thesis.CollisionDensity(case.robot, case.body)
    result = density.evaluate(case.states[0].q, case.states[0].v, ss.Obstacles.none())
    assert result.values == [0.0]
    assert not result.jacobian.any()
    assert result.curvatures == [0.0]


def test_a_density_needs_a_body_that_moves() -> None:
    robot = ss.Robot.named("fr3")
    base = next(frame.name for frame in robot.frames if frame.joint < 0)
    fixed = ss.Body(links=[base], weights=[1.0], means=[np.zeros(3)], covariances=[np.eye(3)])
    with pytest.raises(
        ValueError, match="no Gaussian of the body lies on a link that a joint of robot 'fr3'"
    ):
        thesis.CollisionDensity(robot, fixed)
    unknown = ss.Body(links=["tail"], weights=[1.0], means=[np.zeros(3)], covariances=[np.eye(3)])
    with pytest.raises(ValueError, match=r"robot 'fr3' has no link 'tail'; its links are: .*fr3_link3"):
        thesis.CollisionDensity(robot, unknown)


def test_shapes_of_q_and_v_are_checked() -> None:
    case = scene("planar2")
    density = thesis.CollisionDensity(case.robot, case.body)
    obstacles = case.states[0].obstacles
    with pytest.raises(ValueError, match=r"q has shape \(3,\), expected \(2,\)"):
        density.evaluate(np.zeros(3), np.zeros(2), obstacles)
    with pytest.raises(ValueError, match=r"v has shape \(2, 1\), expected \(2,\)"):
        density.evaluate(np.zeros(2), np.zeros((2, 1)), obstacles)
    with pytest.raises(ValueError, match=r"q has shape \(1,\), expected \(2,\)"):
        density.hessian(np.zeros(1), obstacles)
    with pytest.raises(TypeError, match="q must be an array of real numbers"):
        density.evaluate(["a", "b"], np.zeros(2), obstacles)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_values_that_are_not_finite_are_named(value: float) -> None:
    """Outside the loop; inside it they are a status of `GeometricSystem.acceleration`."""
    robot = ss.Robot.named("planar2")
    density = thesis.CollisionDensity(robot, ss.Body.fit(robot, components=1))
    obstacles = ss.Obstacles([[0.5, 0.5, 0.0]])
    bad, zero = [0.0, value], np.zeros(2)
    with pytest.raises(ValueError, match=rf"q\[1\] is {value}, must be a finite number"):
        density.evaluate(bad, zero, obstacles)
    with pytest.raises(ValueError, match=r"v\[1\] is .*, must be a finite number"):
        density.evaluate(zero, bad, obstacles)
    with pytest.raises(ValueError, match=r"q\[1\] is"):
        density.hessian(bad, obstacles)
    with pytest.raises(ValueError, match=r"q\[1\] is"):
        robot.pose(bad, "link1")
    with pytest.raises(ValueError, match=r"v\[1\] is"):
        robot.bias_acceleration(zero, bad, "link1")


def test_a_body_of_another_robot_with_the_same_links_is_refused() -> None:
    """The links of two sizes of one arm have the same names."""
    short, long = ss.Robot.from_urdf(_arm(0.3)), ss.Robot.from_urdf(_arm(0.6))
    body = ss.Body.fit(short, components=1, cache=False)
    assert thesis.CollisionDensity(short, body).num_coordinates == 1
    message = r"fitted to robot 'arm' \(fingerprint \w{12}\) and cannot be used with robot 'arm'"
    for make in (
        lambda: thesis.CollisionDensity(long, body),
        lambda: ClearanceBarrier(long, body),
        lambda: SelfCollisionBarrier(long, body, []),
        lambda: PlaneBarrier(long, body, point=[0, 0, 0], normal=[0, 0, 1], links=["b"]),
    ):
        with pytest.raises(ValueError, match=message):
            make()


def _arm(length: float) -> str:
    return f"""<robot name="arm"><link name="a"/>
      <link name="b"><collision><geometry><box size="{length} 0.1 0.1"/></geometry></collision></link>
      <joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
        <limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>"""
