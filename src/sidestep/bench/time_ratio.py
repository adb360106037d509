"""How long a motion takes over what TOPP-RA needs on the path that it took."""

from __future__ import annotations

import logging
from typing import Protocol

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

KNOTS = 0.05  # [rad | m] of arc length between two knots of the spline
GRID = 10  # points of TOPP-RA per knot


class Limits(Protocol):
    """Velocity and acceleration limits (nv,) of joints."""

    @property
    def velocity(self) -> Array: ...

    @property
    def acceleration(self) -> Array: ...


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
    import toppra
    from toppra.algorithm import TOPPRA
    from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

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
    logging.getLogger("toppra").setLevel(logging.ERROR)
    bounds = [
        JointVelocityConstraint(np.column_stack([-limits.velocity, limits.velocity])),
        JointAccelerationConstraint(np.column_stack([-limits.acceleration, limits.acceleration])),
    ]
    grid = np.linspace(0.0, s[-1], GRID * knots + 1)
    found = TOPPRA(bounds, toppra.SplineInterpolator(at, way), gridpoints=grid).compute_trajectory(0.0, 0.0)
    return None if found is None else float(found.duration)
