"""How long a motion takes over what TOPP-RA needs on the path that it took."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sidestep.bench import path_timing
from sidestep.bench.executed_path import SHORTEST, ExecutedPath
from sidestep.bench.jerk_limited_optimum import jerk_limited_optimum
from sidestep.bench.topp_ra import Limits, fastest_along

Array = npt.NDArray[np.float64]

KNOTS = 0.05  # [rad | m] of arc length between two knots of the spline
GRID = 10  # points of TOPP-RA per knot


def ratio_to_optimum(q: Array, duration: float, limits: Limits) -> float | None:
    """Time of a motion over that of TOPP-RA on the same path within the same limits [-].

    The path is the motion's own: positions `q` (T, nv), resampled every `KNOTS` of arc length, a cubic spline through
    them. TOPP-RA (Pham and Pham 2018) goes over it from rest to rest, time-optimal within the joints' velocity and
    acceleration limits, without a limit of jerk. `duration` [s] is the motion's. None where the path is shorter than
    four knots, a limit is not finite, or TOPP-RA finds no motion.
    """
    optimum = optimum_over(q, limits)
    return None if optimum is None else duration / optimum


def optimum_over(q: Array, limits: Limits) -> float | None:
    """The duration [s] of TOPP-RA along a motion's path, see `ratio_to_optimum`."""
    from scipy.interpolate import CubicSpline

    if not (np.isfinite(limits.velocity).all() and np.isfinite(limits.acceleration).all()):
        return None
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
    moves = np.concatenate([[True], np.diff(s) > 0.0])
    s, q = s[moves], q[moves]
    knots = round(s[-1] / KNOTS)
    if knots < 4:
        return None
    at = np.linspace(0.0, s[-1], knots + 1)
    way = np.column_stack([np.interp(at, s, column) for column in q.T])
    grid = np.linspace(0.0, s[-1], GRID * knots + 1)
    found = fastest_along(CubicSpline(at, way), grid, limits)
    if found is None:
        return None
    speed, _ = found
    return float(np.sum(2.0 * np.diff(grid) / (speed[1:] + speed[:-1])))


def ratio_to_jerk_limited_optimum(q: Array, duration: float, limits: path_timing.Limits) -> float | None:
    """Time of a motion over the shortest one on its path within velocity, acceleration and jerk limits [-].

    The path is the smooth spline of `ExecutedPath` through positions `q` (T, nv); see `jerk_limited_optimum` for the
    shortest motion over it, from rest to rest. NaN where no such spline or no optimum is found. None where there is
    nothing to find: a path shorter than `SHORTEST`, or a limit that is not finite.
    """
    if not all(np.isfinite(limit).all() for limit in (limits.velocity, limits.acceleration, limits.jerk)):
        return None
    if np.linalg.norm(np.diff(q, axis=0), axis=1).sum() < SHORTEST:
        return None
    path = ExecutedPath.through(q)
    found = None if path is None else jerk_limited_optimum(path, limits)
    return float("nan") if found is None else duration / found.timing.duration
