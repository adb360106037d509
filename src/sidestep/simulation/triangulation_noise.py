"""Errors of depth cameras that triangulate: noise, steps, shadows, holes and flying pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import ndtri

from sidestep.simulation.depth_effects import Depth, Mask, correlated, grown, hidden, slopes


@dataclass(frozen=True, kw_only=True)
class TriangulationNoise:
    """Errors of a camera that measures depth z by the disparity d = f b / z between two viewpoints.

    1. Shadow: what the second viewpoint does not see has no depth. It is b to the right, so that the shadow of a
       near object falls on what is left of it and is f b (1 / z_near - 1 / z_far) pixels wide; for two cameras, also
       what is left of the second one's image, d pixels.
    2. Edges: within `reach` pixels of a step in depth, a pixel is compared with one that is drawn from those within
       `reach` of it. Its depth is lost (probability `missing`), becomes that of the other (`bleeding`), or anything
       between the two (`flying`); else it stays.
    3. Noise: d' = d + sigma n, hence sigma_z = z^2 sigma / (f b). The n of two pixels that share a match window of
       w x w pixels are correlated by the share of it that they have in common, (1 - |du| / w) (1 - |dv| / w).
    4. Steps: d' is a multiple of `step`. They cause step^2 / 12 of sigma^2; n makes the rest.
    5. Holes: surfaces seen flatter than `steepest`, and a share `holes` of the others, in patches of `patch` pixels.
    6. Range: what is measured outside `near` to `far` is missing.

    Attributes:
        baseline: b [m].
        focal: f [pixel] of the sensor that measures, where it is not the image's own; None: that of the image.
        sigma: standard deviation of the disparity, steps included [pixel of f].
        step: of the disparity [pixel of f].
        window: side w of the match window [pixel].
        near, far: range [m].
        stereo: by two cameras; else by a projector, whose light is assumed to reach the whole image.
        missing, bleeding, flying: probabilities at edges; reach: how far edges matter [pixel].
        holes: share of the measured pixels that are missing; patch: side of the patches that they form [pixel].
        steepest: angle to the surface normal [rad] beyond which nothing is measured.

    Raises:
        ValueError: a value outside its range.
    """

    baseline: float
    sigma: float
    step: float
    near: float
    far: float
    focal: float | None = None
    window: int = 1
    stereo: bool = False
    missing: float = 0.0
    bleeding: float = 0.0
    flying: float = 0.0
    reach: int = 1
    holes: float = 0.0
    patch: int = 9
    steepest: float = np.pi / 2

    def __post_init__(self) -> None:
        for name in ("baseline", "sigma", "step", "near", "far", "window", "patch", "reach"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise ValueError(f"depth noise: {name} is {getattr(self, name)}, allowed: positive numbers")
        if self.focal is not None and not self.focal > 0.0:
            raise ValueError(f"depth noise: focal is {self.focal}, allowed: positive numbers, or None")
        if not self.near < self.far:
            raise ValueError(f"depth noise: near is {self.near} and far is {self.far}, allowed: near < far")
        if self.step > self.sigma * np.sqrt(12.0):
            raise ValueError(
                f"depth noise: step is {self.step}, allowed: at most sqrt(12) sigma = {self.sigma * np.sqrt(12.0):.4g},"
                " since steps alone cause step / sqrt(12) of sigma"
            )
        shares = (self.missing, self.bleeding, self.flying, self.holes)
        if not all(0.0 <= share <= 1.0 for share in shares) or sum(shares[:3]) > 1.0:
            raise ValueError(
                f"depth noise: missing, bleeding, flying and holes are {shares}, allowed: 0 to 1, the first three "
                "together at most 1"
            )
        if not 0.0 < self.steepest <= np.pi / 2:
            raise ValueError(f"depth noise: steepest is {self.steepest} rad, allowed: up to pi/2")

    def deviation(self, z: npt.ArrayLike, fx: float) -> npt.NDArray[np.float64]:
        """sigma_z [m] at depths z [m]."""
        return np.asarray(z, dtype=float) ** 2 * self.sigma / ((self.focal or fx) * self.baseline)

    def apply(self, depth: Depth, fx: float, rng: np.random.Generator) -> Depth:
        """Measured depth (H, W) [m], 0 where none."""
        shown = np.asarray(depth, dtype=np.float32)
        measured = np.where(hidden(shown, fx * self.baseline, border=self.stereo), np.float32(0.0), shown)
        edges, flat = slopes(shown, float(np.tan(self.steepest)) / fx)
        self._mix(measured, shown, grown(edges, self.reach), rng)
        measured = self._triangulate(measured, fx, rng)
        measured[flat] = 0.0
        if self.holes > 0.0:
            measured[correlated(shown.shape, self.patch, rng) < ndtri(self.holes)] = 0.0
        measured[(measured < self.near) | (measured > self.far)] = 0.0
        return measured

    def _mix(self, measured: Depth, shown: Depth, edges: Mask, rng: np.random.Generator) -> None:
        """Loses, replaces and mixes depths at edges, but for those in the shadow."""
        height, width = shown.shape
        row, column = np.nonzero(edges & ((measured > 0.0) | (shown == 0.0)))
        offset = rng.integers(-self.reach, self.reach + 1, size=(2, len(row)))
        beside = shown[np.clip(row + offset[0], 0, height - 1), np.clip(column + offset[1], 0, width - 1)]
        own = shown[row, column]
        draw, between = rng.random((2, len(row)), dtype=np.float32)
        bleeds = draw < self.missing + self.bleeding
        flies = ~bleeds & (draw < self.missing + self.bleeding + self.flying) & (own > 0.0) & (beside > 0.0)
        mixed = np.where(bleeds & (beside > 0.0), beside, own)
        mixed = np.where(flies, own + between * (beside - own), mixed)
        measured[row, column] = np.where(draw < self.missing, np.float32(0.0), mixed)

    def _triangulate(self, depth: Depth, fx: float, rng: np.random.Generator) -> Depth:
        """Depths whose disparities have noise and are whole steps."""
        steps = np.float32((self.focal or fx) * self.baseline / self.step)  # [steps of disparity times metre]
        spread = np.sqrt((self.sigma / self.step) ** 2 - 1.0 / 12.0)
        seen = depth > 0.0
        disparity = np.divide(steps, depth, out=np.zeros_like(depth), where=seen)
        disparity += np.float32(spread) * correlated(depth.shape, self.window, rng)
        np.rint(disparity, out=disparity)
        return np.divide(steps, disparity, out=np.zeros_like(depth), where=seen & (disparity > 0.0))
