"""What drives an arm by a geometric system alone, as the thesis does: no clearances are kept."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from sidestep._core import GeometricSystem, rollout
from sidestep.simulation.adapter import StateRecord, StepRecord
from sidestep.simulation.run import ObstacleSource, obstacles_over_time, status_name

Array = npt.NDArray[np.float64]

CHUNK = 200  # steps of one rollout where obstacles move by themselves


class SystemAdapter:
    """A geometric system, whose acceleration a torque QP tracks, or that is integrated; nothing keeps clearances.

    Args:
        system: anything with `acceleration(q, v, goal, obstacles)`. goal: (nv,).
        obstacles: what the system sees, as for `ControllerAdapter`.
        torque_qp: anything with `solve`; None: without physics alone.
        integrator: of the core's `rollout`, without physics.
    """

    def __init__(
        self,
        system: GeometricSystem | Any,
        goal: Array,
        obstacles: ObstacleSource,
        torque_qp: Any = None,
        *,
        integrator: Literal["semi_implicit_euler", "second_order", "runge_kutta_4"] = "semi_implicit_euler",
    ) -> None:
        self._system, self._torque_qp, self._goal, self._integrator = system, torque_qp, goal, integrator
        self._see = obstacles_over_time(obstacles)
        self._chunk = 1 if callable(obstacles) else CHUNK

    def drive(self, time: float, q: Array, v: Array, mass_matrix: Array, bias: Array) -> StepRecord:
        """One step of the system, and of the torque QP."""
        step = self._system.acceleration(q, v, self._goal, self._see(time))
        solution = self._torque_qp.solve(q, v, step.acceleration, mass_matrix, bias)
        return StepRecord(
            torque=np.asarray(solution.torque),
            acceleration=np.asarray(solution.acceleration),
            wanted=np.asarray(step.acceleration),
            system_status=status_name(step.status),
            controller_status=status_name(solution.status),
            switch=np.atleast_1d(getattr(step, "switch", ())),
            values=np.atleast_1d(getattr(step, "values", ())),
        )

    def integrate(self, q: Array, v: Array, steps: int, period: float) -> Iterator[StateRecord]:
        """Its accelerations by the core's `rollout`, see `KinematicAdapter`."""
        nothing = np.zeros(0)
        for done in range(0, steps, self._chunk):
            count = min(self._chunk, steps - done)
            part = rollout(
                self._system,
                q,
                v,
                self._goal,
                self._see(done * period),
                period=period,
                steps=count,
                integrator=self._integrator,
            )
            achieved = np.diff(part.v, axis=0) / period
            for k in range(count):
                status = status_name(part.statuses[k])
                step = StepRecord(
                    nothing, achieved[k], part.acceleration[k], status, "", part.switch[k], part.values[k]
                )
                yield part.q[k], part.v[k], achieved[k], step
            q, v = part.q[count], part.v[count]
