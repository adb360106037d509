"""Joint positions over time, as recorded."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class JointSamples:
    """Joint positions q_i at times t_i, and between them linearly.

    A joint that turns without end is not unwrapped: where its sensor jumps by a turn, the value between is wrong.

    Attributes:
        joint_names: the joints, in the order of q.
        max_gap: longest time [s] between two samples that is bridged.
    """

    def __init__(
        self, joint_names: Sequence[str], times: npt.ArrayLike, *, positions: npt.ArrayLike, max_gap: float
    ) -> None:
        """Sorts samples by time; the later row counts where two have one time.

        Args:
            joint_names: n names.
            times: (N,) [s].
            positions: (N, n) [rad or m].
            max_gap: [s].
        """
        self.joint_names = tuple(joint_names)
        self.max_gap = max_gap
        t = np.asarray(times, dtype=np.float64)
        q = np.asarray(positions, dtype=np.float64).reshape(len(t), len(self.joint_names))
        if not (np.isfinite(t).all() and np.isfinite(q).all()):
            bad = int(np.argmin(np.isfinite(t) & np.isfinite(q).all(axis=1)))
            raise ValueError(f"joint states: sample {bad} is {q[bad].tolist()} at {t[bad]} s, must be finite")
        order = np.argsort(t, kind="stable")
        last = np.append(np.diff(t[order]) > 0.0, True) if len(t) else np.zeros(0, dtype=bool)
        self._times, self._positions = t[order][last], q[order][last]

    def __len__(self) -> int:
        return len(self._times)

    def at(self, time: float) -> Array | None:
        """q (n,) at a time [s]; None before the first and after the last sample, and inside a longer gap."""
        right = int(np.searchsorted(self._times, time))
        if right == len(self):
            return None
        if self._times[right] == time:
            return np.asarray(self._positions[right])
        if right == 0 or self._times[right] - self._times[right - 1] > self.max_gap:
            return None
        before, after = self._times[right - 1], self._times[right]
        share = (time - before) / (after - before)
        return np.asarray((1.0 - share) * self._positions[right - 1] + share * self._positions[right])
