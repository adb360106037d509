"""Motion within the limits of an arm and its clearances (the constraints folder of the core)."""

from typing import Any

from sidestep._core import (
    Clearances,
    Limit,
    MotionProgram,
    MotionSolution,
    QuadraticProgram,
    QuadraticProgramData,
    QuadraticSolution,
    Robot,
    SafetyRow,
    SafetySettings,
    acceleration_bounds,
)

__all__ = [
    "AccelerationFilter",
    "Clearances",
    "Limit",
    "MotionProgram",
    "MotionSolution",
    "QuadraticProgram",
    "QuadraticProgramData",
    "QuadraticSolution",
    "SafetyRow",
    "SafetySettings",
    "TorqueController",
    "TorqueSolution",
    "acceleration_bounds",
]

TorqueController = MotionProgram
"""The name of `MotionProgram` in 0.2."""

TorqueSolution = MotionSolution
"""The name of `MotionSolution` in 0.2."""


class AccelerationFilter(MotionProgram):
    """`MotionProgram` of an arm that is not moved by torque, as in 0.2: the same with `by_torque=False`."""

    def __init__(self, robot: Robot, **settings: Any) -> None:
        super().__init__(robot, by_torque=False, **settings)

    apply = MotionProgram.solve
