"""TOPP-RA along a curve, from rest to rest, within limits of velocity and acceleration."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Protocol

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Curve = Callable[[Array, int], Array]  # parameters (K,), order of the derivative -> (K, nv)


class Limits(Protocol):
    """Velocity and acceleration limits (nv,) of joints."""

    @property
    def velocity(self) -> Array: ...

    @property
    def acceleration(self) -> Array: ...


def fastest_along(curve: Curve, grid: Array, limits: Limits) -> tuple[Array, Array] | None:
    """Speeds (K + 1,) of the parameter at a grid (K + 1,), and its accelerations (K,) between; None if there is none.

    Time-optimal without a limit of jerk (Pham and Pham 2018). An interval takes 2 (s_k+1 - s_k) / (v_k+1 + v_k).

    Raises:
        MissingExtraError: toppra is not installed.
    """
    from toppra.algorithm import TOPPRA
    from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint
    from toppra.interpolator import AbstractGeometricPath

    class Geometric(AbstractGeometricPath):  # type: ignore[misc]
        """The curve as toppra asks for it."""

        dof = len(limits.velocity)
        path_interval = grid[[0, -1]]

        def __call__(self, path_positions: Array, order: int = 0) -> Array:
            return np.asarray(curve(path_positions, order))

    logging.getLogger("toppra").setLevel(logging.ERROR)
    bounds = [
        JointVelocityConstraint(np.column_stack([-limits.velocity, limits.velocity])),
        JointAccelerationConstraint(np.column_stack([-limits.acceleration, limits.acceleration])),
    ]
    acceleration, speed, *_ = TOPPRA(bounds, Geometric(), gridpoints=grid).compute_parameterization(0.0, 0.0)
    if speed is None or not np.isfinite(speed).all():
        return None
    return np.asarray(speed), np.asarray(acceleration)
