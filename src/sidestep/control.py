"""Torque control within the limits of an arm (the control folder of the core)."""

from sidestep._core import (
    Limit,
    QuadraticProgram,
    QuadraticProgramStatus,
    QuadraticSolution,
    TorqueController,
    TorqueFault,
    TorqueSolution,
    TorqueStatus,
    acceleration_bounds,
)

__all__ = [
    "Limit",
    "QuadraticProgram",
    "QuadraticProgramStatus",
    "QuadraticSolution",
    "TorqueController",
    "TorqueFault",
    "TorqueSolution",
    "TorqueStatus",
    "acceleration_bounds",
]
