"""Steps of a motion beyond limits: how many, how far, and whether in free space."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sidestep._core import JointLimits
from sidestep.bench.motion import Motion
from sidestep.distance import ExactClearance

Array = npt.NDArray[np.float64]
Chosen = npt.NDArray[np.bool_]
Broken = dict[str, tuple[int, float]]

ROUNDING = 1e-6  # relative, and absolute below 1: how far beyond a limit counts as kept
FREE = 0.1  # [m] of exact clearance above which an arm is in free space
LOOK_EVERY = 10  # periods between two looks at the clearance


def excesses(
    motion: Motion, limits: JointLimits, *, period: float, commanded: Array | None = None
) -> dict[str, Array]:
    """By limit what it is exceeded by in each step (T,), 0 where it is kept: a ratio, of positions the way [rad | m].

    Position and velocity are the arm's; acceleration, jerk, torque, its rate and "commanded position" the controller's.

    Args:
        period: for which the controller holds a command, by which changes are divided [s].
        commanded: (T, nv) positions [rad | m].
    """
    found: dict[str, Array] = {}

    def put(name: str, values: Array, limit: Array) -> None:
        size = np.abs(values)
        with np.errstate(invalid="ignore"):
            ratio = np.where(size > limit * (1.0 + ROUNDING) + ROUNDING, size / limit, 0.0)
        found[name] = np.pad(ratio.max(axis=1), (len(motion.q) - len(ratio), 0))

    def put_position(name: str, q: Array) -> None:
        outside = np.fmax(q - limits.upper, limits.lower - q).max(axis=1)
        found[name] = np.where(outside > ROUNDING, outside, 0.0)

    put_position("position", motion.q)
    if commanded is not None:
        put_position("commanded position", commanded)
    put("velocity", motion.v, limits.velocity)
    put("acceleration", motion.a, limits.acceleration)
    put("jerk", np.diff(motion.a, axis=0) / period, limits.jerk)
    if motion.torque is not None:
        put("torque", motion.torque, limits.effort)
        put("torque rate", np.diff(motion.torque, axis=0) / period, limits.effort_rate)
    return found


def count(found: dict[str, Array], *, where: Chosen) -> Broken:
    """By broken limit: steps beyond it among those that are chosen (T,), and the worst."""
    chosen = {name: excess[where] for name, excess in found.items()}
    return {
        name: (int((excess > 0.0).sum()), round(float(excess.max()), 6 if "position" in name else 4))
        for name, excess in chosen.items()
        if (excess > 0.0).any()
    }


def in_free_space(exact: ExactClearance, motion: Motion, steps: Chosen) -> Chosen:
    """Of chosen steps (T,) those at which nothing is nearer than `FREE`, (T,); to within `LOOK_EVERY` periods."""
    free = np.zeros(len(steps), dtype=bool)
    for begin in range(0, len(steps), LOOK_EVERY):
        block = slice(begin, begin + LOOK_EVERY)
        if steps[block].any():
            clearance = exact.distance(motion.q[begin], motion.object_poses[begin])
            free[block] = steps[block] & (clearance.distance > FREE)
    return free
