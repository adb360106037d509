"""A small painter: shaded triangles from a chosen side, far ones first. Needs no graphics driver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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
SUPERSAMPLING = 2  # drawn this many times larger, then averaged down


@dataclass(frozen=True, eq=False)
class Camera:
    """An orthographic view.

    Args:
        azimuth, elevation: side the camera stands on [deg]; azimuth 0 is +x, 90 is +y; elevation 90 is above.
        low, high: (3,) corners of the box that must be visible, world [m].
        size: width and height of the picture [pixel].
    """

    azimuth: float
    elevation: float
    low: Array
    high: Array
    size: tuple[int, int]

    def axes(self) -> Array:
        """(3, 3) rows: right, up, towards the viewer; world."""
        a, e = np.deg2rad(self.azimuth), np.deg2rad(self.elevation)
        towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        return np.stack([right, np.cross(towards, right), towards])

    def project(self, points: Array) -> Array:
        """World points (..., 3) to pixel x, pixel y (down) and depth towards the viewer [m] (..., 3)."""
        axes = self.axes()
        ends = np.array([self.low, self.high])
        corners = np.stack(np.meshgrid(*ends.T), axis=-1).reshape(-1, 3)
        seen = corners @ axes.T
        low, high = seen.min(axis=0), seen.max(axis=0)
        width, height = self.size
        scale = 0.94 * min(width / max(high[0] - low[0], 1e-6), height / max(high[1] - low[1], 1e-6))
        middle = 0.5 * (low + high)
        view = points @ axes.T
        pixels = np.empty_like(view)
        pixels[..., 0] = 0.5 * width + scale * (view[..., 0] - middle[0])
        pixels[..., 1] = 0.5 * height - scale * (view[..., 1] - middle[1])
        pixels[..., 2] = view[..., 2]
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
        axes = camera.axes()
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


def look_at(low: Array, high: Array, *, flat: bool, size: tuple[int, int]) -> tuple[Camera, ...]:
    """Views that suit a box: from above for a flat arm, else from the side and from above."""
    if flat:
        return (Camera(azimuth=-90.0, elevation=90.0, low=low, high=high, size=size),)
    return (
        Camera(azimuth=-35.0, elevation=22.0, low=low, high=high, size=size),
        Camera(azimuth=-90.0, elevation=90.0, low=low, high=high, size=size),
    )
