"""The thesis that Sidestep began with (Bosc 2024): what only its methods need, and `reproduce`, which repeats it."""

from typing import TYPE_CHECKING

import lazy_loader

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

if TYPE_CHECKING:
    from sidestep.thesis.system import ThesisNumbers, thesis_system

# Imported on first use, so that the command line starts at once: a system needs what fits bodies.
__getattr__, _, _ = lazy_loader.attach(__name__, submod_attrs={"system": ["ThesisNumbers", "thesis_system"]})

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
