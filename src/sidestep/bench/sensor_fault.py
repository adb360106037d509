"""A moment from which a tracker tells nothing that is new, and what its faults may cost."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sidestep._core import JointLimits
from sidestep.bench.motion import Motion
from sidestep.distance import ExactClearance

Array = npt.NDArray[np.float64]

SLOW = 0.05  # [rad/s | m/s] of the fastest joint below which an arm counts as stopped
USUAL = ("ok", "limited")  # statuses that say nothing about a fault


@dataclass(frozen=True)
class SensorFault:
    """Data that is not new: the last true set was captured when it began.

    Attributes:
        begins: [s]. ends: [s], from when true sets come again; inf: never.
        valid_for: time for which the controller may believe a set [s].
    """

    begins: float
    ends: float
    valid_for: float

    def is_on(self, time: float) -> bool:
        """Whether what comes at a time [s] is not true."""
        return self.begins < time < self.ends

    def stopped_by(self, motion: Motion, limits: JointLimits, period: float) -> float:
        """The time [s] at which the arm has to stand: begins + valid_for + max_j (|v_j| / a_j + a_j / jerk_j).

        v: of the arm when the data became too old; a, jerk: the limits.
        """
        at = min(math.ceil((self.begins + self.valid_for) / period), len(motion.v) - 1)
        braking = np.abs(motion.v[at]) / limits.acceleration + limits.acceleration / limits.jerk
        return float(self.begins + self.valid_for + braking.max())


def fastest_contact(
    exact: ExactClearance, motion: Motion, begin: float, end: float, *, period: float, stride: int
) -> float | None:
    """Speed of the fastest joint in any contact from `begin` to `end` [s]; None: none above `SLOW`.

    Looks at every stride-th sample.
    """
    speeds = np.abs(motion.v).max(axis=1)
    last = min(end, period * len(motion.q))
    fastest = None
    for k in range(math.ceil(begin / period), math.ceil(last / period), stride):
        if speeds[k] <= (fastest or SLOW):
            continue
        if exact.distance(motion.q[k], motion.object_poses[k]).distance <= 0.0:
            fastest = float(speeds[k])
    return fastest


def first_word(statuses: Sequence[str], begin: int) -> tuple[int, str] | None:
    """The first status from step `begin` on that is not a usual one, and when; None: it said nothing."""
    return next(((k, word) for k, word in enumerate(statuses) if k >= begin and word not in USUAL), None)
