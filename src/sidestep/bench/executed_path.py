"""The path of an executed motion as a smooth curve, which timings along it can be compared on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.interpolate import BSpline, splrep

Array = npt.NDArray[np.float64]

DEVIATION = 1e-3  # [rad | m] between spline and executed samples, at most; 1 mm at a lever of 1 m
SAMPLES = 0.005  # [rad | m] of arc length between two samples that the spline is fitted to
SHORTEST = 0.1  # [rad | m] of a path that is worth timing
ATTEMPTS = 6  # at a spline, each with half the deviation of the last
DEGREE = 5  # of the spline: its third derivative, which jerk depends on, is continuous


@dataclass(frozen=True, eq=False)
class ExecutedPath:
    """Positions q(σ) (nv,) over the share σ in [0, 1] of the arc length of an executed motion.

    Attributes:
        splines: of each joint, of degree `DEGREE`.
        deviation: the largest one from the executed samples, of any joint [rad | m].
    """

    splines: tuple[BSpline, ...]
    deviation: float

    @classmethod
    def through(cls, q: Array) -> ExecutedPath | None:
        """Smooth splines within `DEVIATION` of executed samples (T, nv); None where there are none.

        Samples at equal arc length come first, so that waiting on the path counts for nothing. FITPACK (Dierckx 1981)
        adds knots until the sum of squares of the deviations is small enough.
        """
        s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
        moves = np.concatenate([[True], np.diff(s) > 0.0])
        s, q = s[moves], q[moves]
        if s[-1] <= 0.0:
            return None
        at = np.linspace(0.0, s[-1], max(2 * DEGREE, round(s[-1] / SAMPLES)) + 1)
        fits = [_fit(at / s[-1], np.interp(at, s, joint), s / s[-1], joint) for joint in q.T]
        found = [fit for fit in fits if fit is not None]
        if len(found) < len(fits):
            return None
        return cls(tuple(spline for spline, _ in found), max(deviation for _, deviation in found))

    def __call__(self, sigma: Array, order: int = 0) -> Array:
        """A derivative by σ (K, nv) at shares (K,); of order 0, q itself."""
        return np.stack([spline(sigma, order) for spline in self.splines], axis=-1)

    def derivatives(self, sigma: Array) -> tuple[Array, Array, Array]:
        """q', q'', q''' (K, nv) at shares (K,)."""
        return self(sigma, 1), self(sigma, 2), self(sigma, 3)


def _fit(share: Array, way: Array, executed: Array, q: Array) -> tuple[BSpline, float] | None:
    """A spline through a joint's positions `way` at `share`, and its deviation from `q` at `executed`."""
    rms = 0.5 * DEVIATION
    for _ in range(ATTEMPTS):
        spline = BSpline(*splrep(share, way, k=DEGREE, s=len(share) * rms**2))
        deviation = float(np.abs(spline(executed) - q).max())
        if deviation < DEVIATION:
            return spline, deviation
        rms *= 0.5
    return None
