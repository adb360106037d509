"""Metric, geodesic term and Christoffel symbols of the graph."""

from fractions import Fraction

import numpy as np
import pytest

import sidestep as ss
from sidestep import thesis
from sidestep.system import GeometricSystem
from support.finite_differences import derivative
from support.random_scene import ROBOTS, State, scene


def limits_of(robot: ss.Robot) -> thesis.JointLimitPotential:
    return thesis.JointLimitPotential(
        robot, slope=4.0, height=2.0
    )  # wide steps, so that they are felt everywhere


def stacked(state: State, limits: thesis.JointLimitPotential, unit: float) -> tuple[np.ndarray, ...]:
    """J (2, nv), Hessians (2, nv, nv), curvatures (2,) of the density, in `unit` [1/m^3], and the limits."""
    zeta = limits.evaluate(state.q, state.v, ss.Obstacles.none())
    jacobian = np.vstack([state.gradient / unit, zeta.jacobian])
    hessians = np.stack([state.hessian / unit, limits.hessian(state.q, ss.Obstacles.none())])
    return jacobian, hessians, np.einsum("aij,i,j->a", hessians, state.v, state.v)


@pytest.mark.slow
@pytest.mark.parametrize("num_coordinates", [1, 2])
@pytest.mark.parametrize("name", ROBOTS)
def test_closed_form_agrees_with_dense_christoffel_symbols(name: str, num_coordinates: int) -> None:
    case = scene(name)
    limits = limits_of(case.robot)
    for state in case.states:
        # The dense symbols invert G, whose condition is 1 + |grad psi|^2; scaled to a gradient of 10 they are
        # exact to 1e-12. The closed form has no such limit (see below).
        unit = max(1.0, float(np.linalg.norm(state.gradient)) / 10.0)
        jacobian, hessians, curvatures = (a[:num_coordinates] for a in stacked(state, limits, unit))
        symbols = thesis.christoffel_symbols(jacobian, hessians)
        dense = -np.einsum("kij,i,j->k", symbols, state.v, state.v)
        closed = thesis.geodesic_acceleration(jacobian, curvatures)
        scale = np.abs(np.outer(state.v, state.v) * hessians).sum()  # of the terms that are added
        np.testing.assert_allclose(closed, dense, rtol=1e-9, atol=1e-9 * scale)


@pytest.mark.parametrize("name", ROBOTS)
def test_the_system_uses_this_geodesic_term(name: str) -> None:
    case = scene(name)
    density, limits = thesis.CollisionDensity(case.robot, case.body), limits_of(case.robot)
    goal = case.robot.neutral
    for embeddings in ([density], [density, limits], [thesis.Sum([density, limits])]):
        system = GeometricSystem(embeddings, switch=thesis.GeodesicOnly())
        for state in case.states:
            step = system.acceleration(state.q, state.v, goal, state.obstacles)
            parts = [e.evaluate(state.q, state.v, state.obstacles) for e in embeddings]
            J = np.vstack([e.jacobian for e in parts])
            c = np.concatenate([e.curvatures for e in parts])
            np.testing.assert_allclose(step.jacobian, J, rtol=1e-13)
            np.testing.assert_allclose(step.curvatures, c, rtol=1e-13)
            # -G^-1 J^T c = -J^T (I + J J^T)^-1 c, as a least-squares problem: min |a|^2 + |J a + c|^2
            nv, m = J.shape[1], J.shape[0]
            expected = np.linalg.lstsq(np.vstack([np.eye(nv), J]), np.concatenate([np.zeros(nv), -c]))[0]
            # lstsq loses the condition of J, 1e5 at most here
            np.testing.assert_allclose(
                step.geodesic, expected, rtol=0, atol=1e-9 * max(1.0, np.abs(expected).max())
            )
            assert m == len(embeddings)


# With more embedding than joint coordinates G is factorised, and |J|^2 times rounding is lost: 1e-4 at 1e6.
@pytest.mark.parametrize(
    ("num_coordinates", "size"),
    [(m, size) for m in (1, 2, 3, 7) for size in (1.0, 1e3, 1e6, 1e9)] + [(12, 1.0), (12, 1e3)],
)
def test_the_geodesic_term_stays_exact_next_to_an_obstacle(num_coordinates: int, size: float) -> None:
    # A thin Gaussian has gradients of 1e6 and more; I + J^T J alone would then have lost 12 digits.
    rng = np.random.default_rng(5)
    for _ in range(20):
        J = rng.normal(size=(num_coordinates, 7))
        J[0] *= size
        c = rng.normal(size=num_coordinates)
        c[0] *= size**2
        reference = exact_geodesic(J, c)
        np.testing.assert_allclose(
            thesis.geodesic_acceleration(J, c), reference, rtol=0, atol=1e-6 * np.abs(reference).max()
        )


def exact_geodesic(jacobian: np.ndarray, curvatures: np.ndarray) -> np.ndarray:
    """-G^-1 J^T c in rational arithmetic."""
    J = [[Fraction(x) for x in row] for row in jacobian]
    c = [Fraction(x) for x in curvatures]
    m, nv = len(J), len(J[0])
    # S y = c with S = I + J J^T by Gauss-Jordan, then a = -J^T y
    rows = [
        [Fraction(int(i == j)) + sum(a * b for a, b in zip(J[i], J[j], strict=True)) for j in range(m)]
        + [c[i]]
        for i in range(m)
    ]
    for i in range(m):
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for k in range(m):
            if k != i:
                rows[k] = [x - rows[k][i] * y for x, y in zip(rows[k], rows[i], strict=True)]
    return np.array([-float(sum(J[i][n] * rows[i][m] for i in range(m))) for n in range(nv)])


@pytest.mark.parametrize("num_coordinates", [1, 2])
@pytest.mark.parametrize("name", ROBOTS)
def test_christoffel_symbols_are_those_of_the_metric(name: str, num_coordinates: int) -> None:
    case = scene(name)
    density, limits = thesis.CollisionDensity(case.robot, case.body), limits_of(case.robot)
    for state in case.states[:20]:
        unit = max(1.0, float(np.linalg.norm(state.gradient)) / 10.0)

        def jacobian(q: np.ndarray, state=state, unit=unit) -> np.ndarray:
            rest = np.zeros_like(q)
            psi = density.evaluate(q, rest, state.obstacles).jacobian / unit
            return np.vstack([psi, limits.evaluate(q, rest, state.obstacles).jacobian])[:num_coordinates]

        def metric(q: np.ndarray, jacobian=jacobian) -> np.ndarray:
            return thesis.metric_matrix(jacobian(q))

        dG = derivative(metric, state.q)  # [i, j, k] = d_k G_ij
        first_kind = 0.5 * (dG.transpose(0, 2, 1) + dG - dG.transpose(2, 0, 1))  # [l, i, j]
        expected = np.linalg.solve(metric(state.q), first_kind.reshape(len(state.q), -1))
        hessians = stacked(state, limits, unit)[1][:num_coordinates]
        symbols = thesis.christoffel_symbols(jacobian(state.q), hessians)
        # differences of G over 1e-4 rad, see test_collision_density; G is 100 at most
        np.testing.assert_allclose(
            symbols.reshape(expected.shape), expected, rtol=0, atol=1e-6 * np.abs(dG).max()
        )
        np.testing.assert_allclose(symbols, symbols.transpose(0, 2, 1), rtol=0, atol=1e-9 * np.abs(dG).max())


@pytest.mark.parametrize("name", ROBOTS)
def test_metric_is_symmetric_and_at_least_the_identity(name: str) -> None:
    case = scene(name)
    limits = limits_of(case.robot)
    for state in case.states:
        for num in (1, 2):
            jacobian = stacked(state, limits, 1.0)[0][:num]
            metric = thesis.metric_matrix(jacobian)
            assert np.array_equal(metric, metric.T)
            # T2.9; eigenvalues are exact to rounding of the largest
            values = np.linalg.eigvalsh(metric)
            assert values.min() >= 1.0 - 1e-13 * values.max()
            np.testing.assert_allclose(
                metric, np.eye(len(state.q)) + jacobian.T @ jacobian, rtol=1e-13, atol=1e-13 * values.max()
            )


def test_flat_space() -> None:
    assert np.array_equal(thesis.metric_matrix(np.zeros((0, 3))), np.eye(3))
    assert np.array_equal(thesis.geodesic_acceleration(np.zeros((0, 3)), []), np.zeros(3))
    assert not thesis.christoffel_symbols(np.zeros((1, 3)), np.zeros((1, 3, 3))).any()


def test_no_joints() -> None:
    assert thesis.metric_matrix(np.zeros((3, 0))).shape == (0, 0)
    assert thesis.geodesic_acceleration(np.zeros((3, 0)), np.zeros(3)).shape == (0,)


def test_shapes_are_checked() -> None:
    with pytest.raises(ValueError, match=r"jacobian must have shape \(m, nv\)"):
        thesis.metric_matrix(np.zeros(3))
    with pytest.raises(ValueError, match=r"curvatures has shape \(1,\), expected \(2,\)"):
        thesis.geodesic_acceleration(np.zeros((2, 3)), [0.0])
    with pytest.raises(ValueError, match=r"hessians must have shape \(m, nv, nv\)"):
        thesis.christoffel_symbols(np.zeros((2, 3)), np.zeros((1, 3, 3)))
