"""The dense quadratic program of the core against an independent solver."""

import numpy as np
import pytest

from sidestep._core import QuadraticProgramStatus
from sidestep.control import QuadraticProgram

quadprog = pytest.importorskip("quadprog")


def solve_with_quadprog(H, g, lower, upper, A, row_lower, row_upper):
    """The minimiser by quadprog, or None if it finds the program infeasible."""
    identity = np.eye(len(g))
    normals = np.hstack([identity, -identity, A.T, -A.T])
    try:
        return quadprog.solve_qp(H, -g, normals, np.concatenate([lower, -upper, row_lower, -row_upper]))[0]
    except ValueError:
        return None


def test_agrees_with_quadprog_on_random_programs():
    rng = np.random.default_rng(0)
    num_infeasible = 0
    for _ in range(1500):
        n, m = int(rng.integers(1, 15)), int(rng.integers(0, 15))
        B = rng.normal(size=(n, n))
        H = B @ B.T + 10.0 ** rng.uniform(-4, 0) * np.eye(n)
        g = rng.normal(size=n) * 10.0 ** rng.uniform(-2, 3)
        A = rng.normal(size=(m, n))
        lower, upper = -rng.uniform(0, 1, n), rng.uniform(0, 1, n)
        row_lower = rng.normal(size=m) * 0.2 - rng.uniform(0, 1, m)
        row_upper = row_lower + rng.uniform(0, 2, m)
        solution = QuadraticProgram(n, m).solve(
            H, g, lower=lower, upper=upper, A=A, row_lower=row_lower, row_upper=row_upper
        )
        expected = solve_with_quadprog(H, g, lower, upper, A, row_lower, row_upper)
        if expected is None:
            num_infeasible += 1
            assert solution.status == QuadraticProgramStatus.infeasible
            continue
        assert solution.status == QuadraticProgramStatus.solved
        assert solution.residual < 1e-11  # rounding times the conditioning of random active sets
        # Both are exact up to conditioning: 1e-16 times 1e5 of H times about 1e2 of the active set.
        np.testing.assert_allclose(solution.x, expected, atol=1e-8)
    assert 100 < num_infeasible < 1400


def test_none_and_scalars_stand_for_bounds():
    program = QuadraticProgram(2)
    free = program.solve(np.eye(2), [1.0, -3.0])
    np.testing.assert_array_equal(free.x, [-1.0, 3.0])
    bounded = program.solve(np.eye(2), [1.0, -3.0], lower=0.0, upper=[5.0, 2.0])
    np.testing.assert_array_equal(bounded.x, [0.0, 2.0])
    np.testing.assert_array_equal(bounded.multipliers, [-1.0, 1.0])


def test_unusable_data_give_a_status():
    program = QuadraticProgram(1)
    assert str(program.solve([[np.nan]], [0.0]).status) == "not_finite"
    assert str(program.solve([[-1.0]], [0.0]).status) == "not_positive_definite"
    infeasible = program.solve([[1.0]], [0.0], lower=1.0, upper=0.0)
    assert str(infeasible.status) == "infeasible"
    assert np.isnan(infeasible.residual)


def test_wrong_shapes_raise():
    program = QuadraticProgram(2, 1)
    with pytest.raises(ValueError, match=r"H has shape \(3, 3\), expected \(2, 2\)"):
        program.solve(np.eye(3), [0.0, 0.0])
    with pytest.raises(ValueError, match="row_upper"):
        program.solve(np.eye(2), [0.0, 0.0], row_upper=[1.0, 2.0])
    with pytest.raises(ValueError, match="at least 1"):
        QuadraticProgram(0)


def test_slacks_of_what_the_box_just_allows_do_not_go_in_circles():
    # Rows that ask for the most that the box has are met where their slacks are zero, as differences of much larger
    # numbers: such a slack is below its bound by rounding.
    num, rows = 6, 8
    program = QuadraticProgram(num + rows, rows)
    lower = np.r_[np.full(num, -10.0), np.zeros(rows)]
    upper = np.r_[np.full(num, 10.0), np.full(rows, np.inf)]
    for seed in range(3500):
        rng = np.random.default_rng(seed)
        normals = rng.normal(size=(rows, num)) * (rng.random((rows, num)) < 0.5)
        normals[:, 0] += 0.1
        corner = np.sign(normals[0] + 1e-9)  # in which half of the rows are met
        normals[: rows // 2] = np.abs(normals[: rows // 2]) * corner
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        g = np.r_[rng.normal(size=num) * 10 ** rng.uniform(0, 4), np.full(rows, 8e9)]
        solution = program.solve(
            np.eye(num + rows),
            g,
            lower=lower,
            upper=upper,
            A=np.hstack([normals, np.eye(rows)]),
            row_lower=10.0 * np.abs(normals).sum(axis=1),
        )
        assert solution.status == QuadraticProgramStatus.solved, seed
        assert solution.residual < 1e-12
        assert (solution.x >= lower).all()
        assert (solution.x <= upper).all()
