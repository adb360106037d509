"""Noise models of depth cameras, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sidestep.simulation.depth_effects import Depth
from sidestep.simulation.triangulation_noise import TriangulationNoise


class DepthNoiseModel(Protocol):
    """What turns true depth into measured depth."""

    def apply(self, depth: Depth, fx: float, rng: np.random.Generator) -> Depth:
        """Measured depth (H, W) [m], 0 where none, of true depth (H, W) [m], 0 where nothing is, at the focal length
        `fx` [pixel]."""
        ...


@dataclass(frozen=True, kw_only=True)
class D435(TriangulationNoise):
    """Intel RealSense D435: two infrared cameras 50 mm apart, the image is the left one's.

    sigma_z = z^2 s / (f b) with s = 0.08 pixel (0.05 well textured, 0.1 poorly), disparities in steps of 1/32 pixel,
    from 0.28 m.

    Sources: Keselman et al., "Intel RealSense stereoscopic depth cameras", CVPR workshops 2017 (sensor, steps);
    Grunnet-Jepsen et al., "Best-known-methods for tuning Intel RealSense D400 depth cameras", 2018 (sigma, the blind
    band at the left). The shares at edges and of holes are assumed.
    """

    baseline: float = 0.05
    sigma: float = 0.08
    step: float = 1.0 / 32.0
    near: float = 0.28
    far: float = 10.0
    window: int = 5
    stereo: bool = True
    missing: float = 0.3
    bleeding: float = 0.3
    flying: float = 0.2
    reach: int = 2
    holes: float = 0.001


@dataclass(frozen=True, kw_only=True)
class Kinect(TriangulationNoise):
    """Microsoft Kinect of 2010: one infrared camera and a projector of speckles 75 mm beside it.

    sigma_z = 1.425e-3 z^2 and steps of 2.85e-3 z^2 (z in metres), which are half a step and one step of 1/8 pixel at
    f b = 43.9 pixel m; from 0.5 to 5 m.

    Source: Khoshelham and Oude Elberink, "Accuracy and resolution of Kinect depth data for indoor mapping
    applications", Sensors 12(2), 2012 (in centimetres: 1.425e-5 z^2). The shares at edges and of holes are assumed.
    """

    baseline: float = 0.075
    sigma: float = 1.0 / 16.0
    step: float = 1.0 / 8.0
    near: float = 0.5
    far: float = 5.0
    focal: float | None = 1.0 / (8.0 * 2.85e-3 * 0.075)
    window: int = 3
    missing: float = 0.4
    bleeding: float = 0.2
    flying: float = 0.1
    holes: float = 0.002


@dataclass(frozen=True, kw_only=True)
class StructuredLight(TriangulationNoise):
    """A projector of stripes 100 mm beside one camera: precise inside surfaces, bad at their edges.

    Every pixel is measured for itself (no match window), disparities come in steps of 1/8 pixel, pixels at an edge
    see the stripes of both surfaces and fly between them, and surfaces flatter than 80 degrees or dark give nothing.
    No one device is meant; the values are assumed.
    """

    baseline: float = 0.1
    sigma: float = 0.04
    step: float = 1.0 / 8.0
    near: float = 0.3
    far: float = 3.0
    missing: float = 0.1
    bleeding: float = 0.1
    flying: float = 0.6
    holes: float = 0.01
    steepest: float = float(np.radians(80.0))


class NoNoise:
    """Depth as it is."""

    def apply(self, depth: Depth, fx: float, rng: np.random.Generator) -> Depth:
        """A copy of the true depth."""
        return np.array(depth, dtype=np.float32)


NOISES: dict[str, Callable[[], DepthNoiseModel]] = {
    "none": NoNoise,
    "d435": D435,
    "kinect": Kinect,
    "structured_light": StructuredLight,
}


def noise_model(noise: str | DepthNoiseModel) -> DepthNoiseModel:
    """The noise model of a name, or that which is given.

    Raises:
        ValueError: an unknown name; names those that there are.
    """
    if not isinstance(noise, str):
        return noise
    if noise not in NOISES:
        raise ValueError(f"noise is {noise!r}, allowed: {', '.join(NOISES)}, or a noise model")
    return NOISES[noise]()
