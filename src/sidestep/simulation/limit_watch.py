"""Limits that a simulated arm exceeds, counted cycle by cycle."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import JointLimits
from sidestep.simulation.evaluation import LIMIT_SLACK

Array = npt.NDArray[np.float64]

COUNTED = ("position", "velocity", "torque", "torque rate")  #: limits that a command must keep
REPORTED = ("acceleration", "jerk")  #: of the motion, to which the physics belongs
RATES = ("velocity", "torque", "torque rate", *REPORTED)  #: all but positions


@dataclass
class Exceeded:
    """How often a limit was exceeded.

    Attributes:
        cycles: in which any joint was beyond it. worst: largest excess, in the limit's unit. largest: largest share of
            the limit that was used, of any joint; of positions 0.
    """

    cycles: int = 0
    worst: float = 0.0
    largest: float = 0.0


class LimitWatch:
    """Compares each cycle with the limits of an arm.

    Args:
        limits: of the arm. period: of a cycle [s].
    """

    def __init__(self, limits: JointLimits, period: float) -> None:
        self._limits, self._period = limits, period
        self.found = {name: Exceeded() for name in (*COUNTED, *REPORTED)}
        self._bounds = np.array(
            [limits.velocity, limits.effort, limits.effort_rate, limits.acceleration, limits.jerk]
        )
        self._allowed = self._bounds + LIMIT_SLACK * np.maximum(self._bounds, 1.0)
        self._largest = np.zeros(len(self._bounds))
        self._before: tuple[Array, Array] | None = None  # torque and acceleration of the cycle before
        # What a start a rounding error outside leaves of it, see `outside_of`.
        self._taken_in: Array | None = None

    def observe(
        self, q: Array, v: Array, torque: Array, acceleration: Array, asked: Array | None = None
    ) -> None:
        """One cycle: state and torque (nv,) at its beginning, acceleration (nv,) over it.

        asked: torque (nv,) before it was clipped to the effort limits; by default nothing was clipped.
        """
        last_torque, last_acceleration = self._before or (torque, acceleration)
        rate, jerk = (torque - last_torque) / self._period, (acceleration - last_acceleration) / self._period
        sizes = np.abs((v, torque if asked is None else asked, rate, acceleration, jerk))
        self._largest = np.maximum(self._largest, (sizes / self._bounds).max(axis=1))
        beyond = sizes > self._allowed
        if beyond.any():
            for name, row, size, bound in zip(RATES, beyond, sizes, self._bounds, strict=True):
                self._note(name, row, size - bound)
        limits = self._limits
        outside = np.maximum(np.maximum(limits.lower - q, q - limits.upper), 0.0)
        if self._taken_in is None:
            self._taken_in = np.where(outside <= JointLimits.rounding, outside, 0.0)
        self._taken_in = np.minimum(self._taken_in, outside)  # 0 once the arm has come in
        excess = outside - self._taken_in
        self._note("position", excess > LIMIT_SLACK, excess)
        self._before = torque, acceleration

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, by name of the limit."""
        for name, share in zip(RATES, self._largest, strict=True):
            self.found[name].largest = float(share)
        return {name: asdict(exceeded) for name, exceeded in self.found.items()}

    @property
    def broken(self) -> tuple[str, ...]:
        """Those of `COUNTED` that were exceeded."""
        return tuple(name for name in COUNTED if self.found[name].cycles)

    def _note(self, name: str, beyond: npt.NDArray[np.bool_], excess: Array) -> None:
        if beyond.any():
            found = self.found[name]
            found.cycles += 1
            found.worst = max(found.worst, float(excess[beyond].max()))
