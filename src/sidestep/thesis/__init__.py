"""The thesis that Sidestep began with (Bosc 2024): what only its methods need, and `reproduce`, which repeats it."""

from sidestep._core import (
    BinarySwitch,
    CollisionDensity,
    DampingForm,
    DistanceSwitch,
    GeodesicOnly,
    HarmonicOnly,
    Integrator,
    JointLimitPotential,
    Rollout,
    SigmoidSwitch,
    Sum,
    Unswitched,
    christoffel_symbols,
    geodesic_acceleration,
    metric_matrix,
    rollout,
    rollout_batch,
)
from sidestep.thesis.system import ThesisNumbers, thesis_system

__all__ = [
    "BinarySwitch",
    "CollisionDensity",
    "DampingForm",
    "DistanceSwitch",
    "GeodesicOnly",
    "HarmonicOnly",
    "Integrator",
    "JointLimitPotential",
    "Rollout",
    "SigmoidSwitch",
    "Sum",
    "ThesisNumbers",
    "Unswitched",
    "christoffel_symbols",
    "geodesic_acceleration",
    "metric_matrix",
    "rollout",
    "rollout_batch",
    "thesis_system",
]
