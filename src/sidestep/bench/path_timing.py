"""Timings along a path: shares σ of it at nodes, and constant jerk of σ between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from sidestep.bench import topp_ra
from sidestep.bench.executed_path import ExecutedPath
from sidestep.bench.topp_ra import fastest_along

Array = npt.NDArray[np.float64]

GRID = 2000  # intervals of TOPP-RA over a path
ENDS = np.array(
    [0.125, 0.25, 0.5]
)  # shares of the first interval's time: a ramp of acceleration may be shorter
SMOOTH_NODES = 400  # of a smooth timing


class Limits(topp_ra.Limits, Protocol):
    """Velocity, acceleration and jerk limits (nv,) of joints."""

    @property
    def jerk(self) -> Array: ...


@dataclass(frozen=True, eq=False)
class PathTiming:
    """When a motion is where.

    Attributes:
        sigma: (K + 1,) share of the path at nodes. v, a: (K + 1,) its first and second derivative [1/s, 1/s²].
        u: (K,) its third one, constant between nodes [1/s³]. h: (K,) time between nodes [s].
    """

    sigma: Array
    v: Array
    a: Array
    u: Array
    h: Array

    @property
    def duration(self) -> float:
        """Of all of it [s]."""
        return float(self.h.sum())

    @property
    def times(self) -> Array:
        """(K + 1,) of nodes [s]."""
        return np.concatenate([[0.0], np.cumsum(self.h)])

    def stretched(self, factor: float) -> PathTiming:
        """The same motion, slower by a factor."""
        return PathTiming(
            self.sigma, self.v / factor, self.a / factor**2, self.u / factor**3, self.h * factor
        )

    def spread_nodes(self, path: ExecutedPath, intervals: int, *, ends: bool = True) -> Array:
        """Shares of the path: dense where this timing is slow or the path turns, and at both ends; nowhere sparse."""
        first, second, _ = path.derivatives(self.sigma)
        turning = np.linalg.norm(second, axis=1) / np.maximum(np.linalg.norm(first, axis=1), 1e-9)
        turned = np.concatenate([[0.0], np.cumsum(np.diff(self.sigma) * 0.5 * (turning[1:] + turning[:-1]))])
        measure = 0.5 * self.times / self.duration + 0.2 * self.sigma + 0.3 * turned / max(turned[-1], 1e-9)
        found = np.interp(np.linspace(0.0, 1.0, intervals + 1), measure / measure[-1], self.sigma)
        if not ends:
            return np.asarray(found)
        first, last = found[1] * ENDS**3, 1.0 - (1.0 - found[-2]) * ENDS[::-1] ** 3  # σ goes with t³ at rest
        return np.concatenate([[0.0], first, found[1:-1], last, [1.0]])

    def at_nodes(self, nodes: Array) -> tuple[Array, Array, Array, Array]:
        """v, a, u, h of it at other nodes (N + 1,), roughly: where a program may start."""
        h = np.diff(np.interp(nodes, self.sigma, self.times))
        v = np.interp(nodes, self.sigma, self.v)
        a = np.interp(nodes, self.sigma, self.a)
        a[[0, -1]] = 0.0
        return v, a, np.diff(a) / h, h

    def excess(self, path: ExecutedPath, limits: Limits, points: int) -> Array:
        """(K,) largest share of a limit by which each interval breaks one, at so many points; below 0 if none."""
        t = np.linspace(0.0, 1.0, points + 1)[:, None] * self.h
        u = np.broadcast_to(self.u, t.shape)
        a = self.a[:-1] + u * t
        v = self.v[:-1] + self.a[:-1] * t + u * t**2 / 2
        sigma = self.sigma[:-1] + self.v[:-1] * t + self.a[:-1] * t**2 / 2 + u * t**3 / 6
        first, second, third = path.derivatives(np.clip(sigma.ravel(), 0.0, 1.0))
        v, a, u = (column.ravel()[:, None] for column in (v, a, u))
        shares = (
            np.abs(first * v) / limits.velocity,
            np.abs(first * a + second * v**2) / limits.acceleration,
            np.abs(first * u + 3 * second * v * a + third * v**3) / limits.jerk,
        )
        largest = np.max([share.max(axis=1) for share in shares], axis=0)
        return np.asarray(largest.reshape(t.shape).max(axis=0) - 1.0)


def smooth_timing(path: ExecutedPath, limits: Limits) -> PathTiming:
    """σ = 35 τ⁴ - 84 τ⁵ + 70 τ⁶ - 20 τ⁷ over τ = t/T, with T so long that no limit is broken.

    At both ends velocity, acceleration and jerk are 0.
    """
    tau = np.linspace(0.0, 1.0, SMOOTH_NODES + 1)
    law = np.polynomial.Polynomial([0, 0, 0, 0, 35, -84, 70, -20])
    sigma, v, a, jerk = law(tau), law.deriv(1)(tau), law.deriv(2)(tau), law.deriv(3)(tau)
    first, second, third = path.derivatives(np.clip(sigma, 0.0, 1.0))
    v_, a_, jerk_ = v[:, None], a[:, None], jerk[:, None]
    velocity = np.abs(first * v_) / limits.velocity
    acceleration = np.abs(first * a_ + second * v_**2) / limits.acceleration
    rate = np.abs(first * jerk_ + 3 * second * v_ * a_ + third * v_**3) / limits.jerk
    duration = float(max(velocity.max(), np.sqrt(acceleration.max()), np.cbrt(rate.max())))
    plain = PathTiming(sigma, v, a, 0.5 * (jerk[1:] + jerk[:-1]), np.diff(tau))
    return plain.stretched(duration)


def topp_ra_timing(path: ExecutedPath, limits: Limits) -> PathTiming | None:
    """The shortest motion without a limit of jerk, see `fastest_along`; None where TOPP-RA finds none."""
    grid = np.linspace(0.0, 1.0, GRID + 1)
    found = fastest_along(path, grid, limits)
    if found is None:
        return None
    v, a = found
    if np.any(v[1:] + v[:-1] <= 0.0):  # it stands still on the way
        return None
    h = 2.0 * np.diff(grid) / (v[1:] + v[:-1])
    return PathTiming(grid, v, np.append(a, a[-1]), np.zeros(GRID), h)
