"""The shortest time along a path within limits of velocity, acceleration and jerk, as a nonlinear program."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep.bench.executed_path import ExecutedPath
from sidestep.bench.path_timing import Limits, PathTiming, smooth_timing, topp_ra_timing

Array = npt.NDArray[np.float64]

INTERVALS = 240  # of constant jerk; twice as many change times by less than 1 %
EXCESS = 0.02  # share of a limit by which a timing may break it between nodes
REFINEMENTS = 4  # times that intervals which break a limit between nodes are divided, most
MOST_PARTS = 6  # that an interval is divided into at once
FINE = 10  # points per interval at which limits are checked
ITERATIONS = 400  # of Ipopt, most; usually 30 to 100
STRETCH = 1.5  # of a guess over TOPP-RA's time
TOLERANCE = 1e-6  # of Ipopt, on residuals that are shares of limits


@dataclass(frozen=True, eq=False)
class JerkLimitedOptimum:
    """What Ipopt found.

    Attributes:
        timing: along the path, in intervals of constant jerk of σ.
        excess: largest share of a limit by which it breaks one, `FINE` points per interval. iterations: of Ipopt.
    """

    timing: PathTiming
    excess: float
    iterations: int


def jerk_limited_optimum(
    path: ExecutedPath, limits: Limits, *, intervals: int = INTERVALS
) -> JerkLimitedOptimum | None:
    """The shortest motion along a path from rest to rest, without acceleration at either end.

    With σ the share of the path and v, a, u its time derivatives, over intervals k of constant u_k and duration h_k
    between fixed σ_k (so that the derivatives of the path are numbers):

        minimise Σ h_k   where   σ_k+1 = σ_k + v_k h_k + a_k h_k²/2 + u_k h_k³/6,   v and a accordingly,
        |q' v| ≤ velocity,   |q' a + q'' v²| ≤ acceleration   at nodes,
        |q' u + 3 q'' v a + q''' v³| ≤ jerk                    at both ends of an interval.

    Ipopt starts from TOPP-RA's timing, stretched; then from a smooth one. Intervals that break a limit between nodes
    by more than `EXCESS` are divided, and the program is solved again. None where Ipopt converges from neither start,
    or an interval still breaks a limit after `REFINEMENTS`.

    Raises:
        MissingExtraError: casadi is not installed.
    """
    smooth = smooth_timing(path, limits)
    fastest = topp_ra_timing(path, limits)
    guesses = [smooth] if fastest is None else [fastest.stretched(STRETCH), smooth]
    for ends in (True, False):  # with nodes close to both ends, or where Ipopt does not converge so, without
        nodes = (fastest or smooth).spread_nodes(path, intervals, ends=ends)
        if (found := _converged(path, limits, nodes, guesses)) is not None:
            return found
    return None


def _converged(
    path: ExecutedPath, limits: Limits, nodes: Array, guesses: Sequence[PathTiming]
) -> JerkLimitedOptimum | None:
    """The optimum at nodes (N + 1,) and at more of them, until limits hold between them; None without one."""
    iterations = 0
    for _ in range(REFINEMENTS + 1):
        found = next((f for f in (_solve(path, limits, nodes, guess) for guess in guesses) if f), None)
        if found is None:
            return None
        timing, count = found
        iterations += count
        excess = timing.excess(path, limits, FINE)
        if excess.max() <= EXCESS:
            return JerkLimitedOptimum(timing, float(excess.max()), iterations)
        nodes = _refined(nodes, excess)
    return None


def _refined(nodes: Array, excess: Array) -> Array:
    """Nodes (N + 1,) and more of them in intervals that break a limit, whose excess goes with their length squared."""
    beside = np.concatenate([[0.0], excess, [0.0]])  # a neighbour's node may be where the limit is broken
    wide = np.max([excess, beside[:-2], beside[2:]], axis=0)
    parts = np.clip(np.ceil(np.sqrt(np.maximum(wide, 0.0) / (0.5 * EXCESS))), 1, MOST_PARTS)
    index = np.concatenate([[0.0], np.cumsum(parts)])
    return np.interp(np.arange(index[-1] + 1.0), index, nodes)


def _solve(
    path: ExecutedPath, limits: Limits, nodes: Array, guess: PathTiming
) -> tuple[PathTiming, int] | None:
    """A timing at nodes (N + 1,), and Ipopt's iterations; None where it does not converge."""
    import casadi

    n = len(nodes) - 1
    step = np.diff(nodes)
    first, second, third = path.derivatives(nodes)
    v0, a0, u0, h0 = guess.at_nodes(nodes)
    # Units in which each variable is about 1.
    slope = np.abs(first).max(axis=0) + 1e-12
    unit_v = float(np.min(limits.velocity / slope))
    unit_a = float(np.min(limits.acceleration / slope))
    unit_u = float(np.min(limits.jerk / slope))
    unit_h = float(h0.mean())

    v_, a_ = casadi.SX.sym("v", n + 1), casadi.SX.sym("a", n + 1)
    u_, h_ = casadi.SX.sym("u", n), casadi.SX.sym("h", n)
    v, a, u, h = unit_v * v_, unit_a * a_, unit_u * u_, unit_h * h_
    v1, a1 = v[:-1], a[:-1]
    dynamics = casadi.vertcat(
        (v1 * h + a1 * h**2 / 2 + u * h**3 / 6 - step) / step,
        (v1 + a1 * h + u * h**2 / 2 - v[1:]) / unit_v,
        (a1 + u * h - a[1:]) / unit_a,
    )
    rows = []
    for i in range(first.shape[1]):
        q1, q2, q3 = first[:, i], second[:, i], third[:, i]
        rows.append((q1 * a + q2 * v**2) / limits.acceleration[i])
        rest = 3 * q2 * v * a + q3 * v**3
        rows.append((q1[:-1] * u + rest[:-1]) / limits.jerk[i])
        rows.append((q1[1:] * u + rest[1:]) / limits.jerk[i])
    within = casadi.vertcat(*rows)

    fastest = np.min(limits.velocity / np.maximum(np.abs(first), 1e-9), axis=1) / unit_v
    fastest[[0, -1]] = 0.0
    free = np.full(n + 1, np.inf)
    free[[0, -1]] = 0.0
    high = np.concatenate([fastest, free, np.full(2 * n, np.inf)])
    low = np.concatenate([np.zeros(n + 1), -free, np.full(n, -np.inf), np.full(n, 1e-4)])
    options: dict[str, Any] = {
        "print_time": False,
        "error_on_fail": False,
        "ipopt": {
            "print_level": 0,
            "sb": "yes",
            "linear_solver": "mumps",
            "max_iter": ITERATIONS,
            "tol": TOLERANCE,
            "mu_strategy": "adaptive",
        },
    }
    program = {
        "x": casadi.vertcat(v_, a_, u_, h_),
        "f": casadi.sum1(h_) / n,
        "g": casadi.vertcat(dynamics, within),
    }
    solver = casadi.nlpsol("optimum", "ipopt", program, options)
    start = np.concatenate([v0 / unit_v, a0 / unit_a, u0 / unit_u, h0 / unit_h])
    bound = np.concatenate([np.zeros(3 * n), np.ones(within.shape[0])])
    found = solver(x0=start, lbx=low, ubx=high, lbg=-bound, ubg=bound)
    statistics = solver.stats()
    if not statistics["success"]:
        return None
    x = np.asarray(found["x"], dtype=np.float64).ravel()
    timing = PathTiming(
        nodes,
        unit_v * x[: n + 1],
        unit_a * x[n + 1 : 2 * n + 2],
        unit_u * x[2 * n + 2 : 3 * n + 2],
        unit_h * x[3 * n + 2 :],
    )
    return timing, int(statistics["iter_count"])
