"""What drives an arm in a simulation: a `Controller`, or a geometric system with a torque program (the thesis's)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from sidestep._core import Controller, GeometricSystem
from sidestep.obstacles.scene import Seen
from sidestep.simulation.pose_aim import PoseAim
from sidestep.simulation.run import ObstacleSource, obstacles_over_time, status_name

Array = npt.NDArray[np.float64]
NOTHING = np.zeros(0)


@dataclass(frozen=True, eq=False)
class Drive:
    """What one step of a driver gives.

    Attributes:
        torque: (nv,) [Nm | N]. acceleration: (nv,) that it causes in the driver's model [rad/s^2 | m/s^2].
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


class Driver(Protocol):
    """Turns a state into a torque, once a period."""

    def drive(self, time: float, q: Array, v: Array, mass_matrix: Array, bias: Array) -> Drive:
        """One step at a time [s], q and v (nv,), with mass matrix (nv, nv) and bias (nv,) there."""


class ControllerDriver:
    """A `Controller`, told what it sees.

    Args:
        controller: with its goal set.
        obstacles: what it sees, as `Controller.set_obstacles` takes it: it moves them along their velocities itself; or
            a function of time [s] that gives that, or None where it is as it was told before.
    """

    def __init__(self, controller: Controller, obstacles: Seen | Callable[[float], Seen | None]) -> None:
        self.controller = controller
        self._see = obstacles if callable(obstacles) else None
        if not callable(obstacles):
            controller.set_obstacles(obstacles)

    def drive(
        self,
        time: float,
        q: Array,
        v: Array,
        mass_matrix: Array | None = None,
        bias: Array | None = None,
    ) -> Drive:
        """One step of the controller; without masses by its own dynamics."""
        seen = None if self._see is None else self._see(time)
        if seen is not None:
            self.controller.set_obstacles(seen)
        if self.controller.has_torque and mass_matrix is not None:
            command = self.controller.step(q, v, mass_matrix, bias)
        else:
            command = self.controller.step(q, v)
        return Drive(
            torque=command.torque,
            acceleration=command.acceleration,
            wanted=command.wanted,
            system_status=status_name(command.activity),
            controller_status=status_name(command.status),
            values=self.controller.values,
        )


class SystemDriver:
    """A geometric system, whose acceleration a torque program tracks; nothing keeps clearances.

    Args:
        system: anything with `acceleration(q, v, goal, obstacles)`. program: anything with `solve`.
        goal: (nv,), or a pose. obstacles: what the system sees, as for `ControllerDriver`.
    """

    def __init__(
        self, system: GeometricSystem | Any, program: Any, goal: Array | PoseAim, obstacles: ObstacleSource
    ) -> None:
        self._system, self._program, self._goal = system, program, goal
        self._see = obstacles_over_time(obstacles)

    def drive(self, time: float, q: Array, v: Array, mass_matrix: Array, bias: Array) -> Drive:
        """One step of the system, and of the program."""
        goal = self._goal.at(q) if isinstance(self._goal, PoseAim) else self._goal
        step = self._system.acceleration(q, v, goal, self._see(time))
        solution = self._program.solve(q, v, step.acceleration, mass_matrix, bias)
        return Drive(
            torque=np.asarray(solution.torque),
            acceleration=np.asarray(solution.acceleration),
            wanted=np.asarray(step.acceleration),
            system_status=status_name(step.status),
            controller_status=status_name(solution.status),
            switch=np.atleast_1d(getattr(step, "switch", NOTHING)),
            values=np.atleast_1d(getattr(step, "values", NOTHING)),
        )
