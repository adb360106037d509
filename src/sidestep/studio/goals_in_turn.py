"""Goals that are visited in turn."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sidestep.studio.adapter import NEAR_GOAL

Array = npt.NDArray[np.float64]

REST = 0.5  # [s] at a goal before the next one
PATIENCE = 6.0  # [s] for which a goal may be out of reach before the next one is tried


class GoalsInTurn:
    """Configurations (nv,), one after the other for ever; none: the goal stays."""

    def __init__(self) -> None:
        self.goals: tuple[Array, ...] = ()
        self.begin(0.0)

    def begin(self, time: float) -> None:
        """Begins the present goal at a time [s]."""
        self._since, self._arrived = time, np.inf

    def set(self, goals: tuple[Array, ...], time: float) -> None:
        """Other goals, from a time on [s]."""
        self.goals, self._since = goals, time

    def after(self, goal: Array) -> Array:
        """The goal after this one; the first, where this one is not among them."""
        present = next((k for k, q in enumerate(self.goals) if np.array_equal(q, goal)), -1)
        return self.goals[(present + 1) % len(self.goals)]

    def due(self, time: float, q: Array, goal: Array) -> Array | None:
        """The next goal, where the arm at q has been at this one for a while or does not get there; else None."""
        if not self.goals:
            return None
        near = float(np.abs(q - goal).max()) < NEAR_GOAL
        if not near:
            self._arrived = np.inf
        elif np.isinf(self._arrived):
            self._arrived = time
        if time - self._arrived < REST and time - self._since < PATIENCE:
            return None
        self.begin(time)
        return self.after(goal)
