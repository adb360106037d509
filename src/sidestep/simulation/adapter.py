"""What stands between a simulation and what moves the arm: a `Controller`, or a geometric system with a torque QP."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from sidestep._core import Controller
from sidestep.loop import ModelLoop
from sidestep.obstacles.scene import Seen
from sidestep.simulation.run import status_name

Array = npt.NDArray[np.float64]
NOTHING = np.zeros(0)


@dataclass(frozen=True, eq=False)
class StepRecord:
    """What one step of an adapter gives.

    Attributes:
        torque: (nv,) [Nm | N]. acceleration: (nv,) that it causes in the adapter's model [rad/s^2 | m/s^2].
        wanted: (nv,) before any limit. switch, values: of the geometric system, empty where there is none.
        system_status, controller_status: names.
    """

    torque: Array
    acceleration: Array
    wanted: Array
    system_status: str
    controller_status: str
    switch: Array = field(default_factory=lambda: NOTHING)
    values: Array = field(default_factory=lambda: NOTHING)


StateRecord: TypeAlias = tuple[
    Array, Array, Array, StepRecord
]  # q, v, achieved acceleration (nv,) each, and the step


class Adapter(Protocol):
    """Turns a state into a torque, once a period."""

    def drive(self, time: float, q: Array, v: Array, mass_matrix: Array, bias: Array) -> StepRecord:
        """One step at a time [s], q and v (nv,), with mass matrix (nv, nv) and bias (nv,) there."""


class KinematicAdapter(Protocol):
    """Moves an arm without physics."""

    def integrate(self, q: Array, v: Array, steps: int, period: float) -> Iterator[StateRecord]:
        """So many steps of a period [s] from q and v (nv,)."""


class ControllerAdapter:
    """A `Controller` in the loop of a model (`sidestep.loop.ModelLoop`), told what it sees.

    Args:
        controller: with its goal set.
        obstacles: what it sees, as `Controller.set_obstacles` takes it: it moves them along their velocities itself; or
            a function of time [s] that gives that, or None where it is as it was told before.
    """

    def __init__(self, controller: Controller, obstacles: Seen | Callable[[float], Seen | None]) -> None:
        self.controller, self._loop = controller, ModelLoop(controller)
        self._period = controller.settings.period
        # A simulation may take longer than real time: it tells its own, which goes on from that of one before.
        self._time = None if controller.settings.synchronous else clock.monotonic()
        self._see = obstacles if callable(obstacles) else None
        if not callable(obstacles):
            controller.set_obstacles(obstacles, valid_for=math.inf)  # the world is what it is said to be

    def drive(
        self,
        time: float,
        q: Array,
        v: Array,
        mass_matrix: Array | None = None,
        bias: Array | None = None,
    ) -> StepRecord:
        """One step of the controller; without masses by its own dynamics."""
        seen = None if self._see is None else self._see(time)
        if seen is not None:
            self.controller.set_obstacles(seen, valid_for=math.inf)
        if self._time is not None:
            self._time += self._period
        if self.controller.has_torque and mass_matrix is not None:
            command = self._loop.cycle(q, v, mass_matrix, bias, time=self._time)
        else:
            command = self._loop.cycle(q, v, time=self._time)
        return StepRecord(
            torque=command.torque,
            acceleration=command.acceleration,
            wanted=command.wanted,
            system_status=status_name(command.activity),
            controller_status=status_name(command.status),
            values=self.controller.values,
        )

    def integrate(self, q: Array, v: Array, steps: int, period: float) -> Iterator[StateRecord]:
        """Its accelerations by semi-implicit Euler, see `KinematicAdapter`."""
        for k in range(steps):
            step = self.drive(k * period, q, v)
            yield q, v, step.acceleration, step
            v = v + period * step.acceleration
            q = q + period * v


# Their names in 0.2, when nothing was called a driver but what stands between a controller and a simulation.
Drive: TypeAlias = StepRecord
Driver: TypeAlias = Adapter
KinematicDriver: TypeAlias = KinematicAdapter
ControllerDriver: TypeAlias = ControllerAdapter
