"""The path from a depth image to the obstacles of a controller; the core computes it."""

from sidestep._core import (
    ArmResidual,
    CameraCheck,
    CameraCorrection,
    DepthCamera,
    DepthNoise,
    Perception,
    PerceptionReport,
    PerceptionSettings,
    PixelLabel,
)

__all__ = [
    "ArmResidual",
    "CameraCheck",
    "CameraCorrection",
    "DepthCamera",
    "DepthNoise",
    "Perception",
    "PerceptionReport",
    "PerceptionSettings",
    "PixelLabel",
]
