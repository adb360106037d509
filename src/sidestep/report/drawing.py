"""A small painter: shaded triangles from a chosen side, far ones first. Needs no graphics driver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw

Array = npt.NDArray[np.float64]
Colour = tuple[int, int, int]

BACKGROUND: Colour = (255, 255, 255)
ARM: Colour = (150, 165, 185)
OBSTACLE: Colour = (213, 94, 0)  # Okabe and Ito's vermillion: told apart from grey and blue by everyone
PATH: Colour = (0, 114, 178)
GOAL: Colour = (0, 158, 115)
FILLED = 0.94  # share of the picture that the visible points fill
SUPERSAMPLING = 2  # drawn this many times larger, then averaged down


@dataclass(frozen=True, eq=False)
class Camera:
    """An orthographic view.

    Args:
        azimuth, elevation: side the camera stands on [deg]; azimuth 0 is +x, 90 is +y; elevation 90 is above.
        visible: (N, 3) points that must be in the picture, world [m].
        size: width and height of the picture [pixel].
    """

    azimuth: float
    elevation: float
    visible: Array
    size: tuple[int, int]

    @cached_property
    def axes(self) -> Array:
        """(3, 3) rows: right, up, towards the viewer; world."""
        a, e = np.deg2rad(self.azimuth), np.deg2rad(self.elevation)
        towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        return np.stack([right, np.cross(towards, right), towards])

    @cached_property
    def _window(self) -> tuple[float, Array]:
        """Pixels per metre, and the middle (2,) of what is visible along right and up [m]."""
        seen = self.visible @ self.axes[:2].T
        low, high = seen.min(axis=0), seen.max(axis=0)
        scale = FILLED * float(np.min(np.array(self.size) / np.maximum(high - low, 1e-6)))
        return scale, 0.5 * (low + high)

    def project(self, points: Array) -> Array:
        """World points (..., 3) to pixel x, pixel y (down) and depth towards the viewer [m] (..., 3)."""
        scale, middle = self._window
        width, height = self.size
        pixels = points @ self.axes.T
        pixels[..., 0] = 0.5 * width + scale * (pixels[..., 0] - middle[0])
        pixels[..., 1] = 0.5 * height - scale * (pixels[..., 1] - middle[1])
        return pixels


def paint(
    camera: Camera,
    surfaces: Sequence[tuple[Array, Colour]],
    *,
    lines: Sequence[tuple[Array, Colour]] = (),
) -> Image.Image:
    """A picture of sets of triangles (F, 3, 3) [m], under polylines (n, 3) [m]; world frame."""
    width, height = camera.size
    image = Image.new("RGB", (SUPERSAMPLING * width, SUPERSAMPLING * height), BACKGROUND)
    draw = ImageDraw.Draw(image)
    filled = [(triangles, colour) for triangles, colour in surfaces if len(triangles)]
    if filled:
        triangles = np.concatenate([t for t, _ in filled])
        colours = np.concatenate([np.tile(np.array(c, dtype=float), (len(t), 1)) for t, c in filled])
        normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        axes = camera.axes
        light = axes.T @ np.array([-0.35, 0.55, 0.76])  # from above, left of the viewer
        shade = 0.45 + 0.55 * np.abs(normals @ light)
        pixels = SUPERSAMPLING * camera.project(triangles)
        fills = np.clip(colours * shade[:, None], 0, 255).astype(int)
        corners = pixels[:, :, :2].round().astype(int)
        for index in np.argsort(pixels[:, :, 2].mean(axis=1)):
            draw.polygon(corners[index].ravel().tolist(), fill=tuple(fills[index].tolist()))
    for line, colour in lines:
        pixels = SUPERSAMPLING * camera.project(line)[:, :2]
        draw.line([tuple(p) for p in pixels.tolist()], fill=colour, width=2 * SUPERSAMPLING, joint="curve")
    return image.resize(camera.size, Image.Resampling.LANCZOS)


def look_at(visible: Array, *, flat: bool, size: tuple[int, int]) -> tuple[Camera, ...]:
    """Views of points (N, 3) [m]: from above for a flat arm, else from the side and from above."""
    above = Camera(azimuth=-90.0, elevation=90.0, visible=visible, size=size)
    return (above,) if flat else (Camera(azimuth=-35.0, elevation=22.0, visible=visible, size=size), above)
