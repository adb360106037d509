"""Torque control within the limits of an arm (the control folder of the core)."""

from sidestep._core import (
    AccelerationFilter,
    Clearances,
    Limit,
    QuadraticProgram,
    QuadraticProgramData,
    QuadraticProgramStatus,
    QuadraticSolution,
    SafetyRow,
    SafetySettings,
    TorqueController,
    TorqueFault,
    TorqueSolution,
    TorqueStatus,
    acceleration_bounds,
)

__all__ = [
    "AccelerationFilter",
    "Clearances",
    "Limit",
    "QuadraticProgram",
    "QuadraticProgramData",
    "QuadraticProgramStatus",
    "QuadraticSolution",
    "SafetyRow",
    "SafetySettings",
    "TorqueController",
    "TorqueFault",
    "TorqueSolution",
    "TorqueStatus",
    "acceleration_bounds",
]
