"""What simulated cameras truly had in view, and when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from sidestep._core import DepthCamera

if TYPE_CHECKING:
    from sidestep.simulation.depth_camera import SimulatedImage

Array = npt.NDArray[np.float64]

SHOWN = 20  # pixels that must truly show something that is in view
ON_SURFACE, ON_SURFACE_SHARE = 0.01, 0.01  # [m] and of the depth, by which a depth may be off what it shows
TOUCHED = 0.03  # [m] around a contact: what of a surface must have been seen


class SightLog:
    """When images showed an object.

    Args:
        geom: its number in MuJoCo's model. far: range of the cameras [m], by their names.
    """

    def __init__(self, geom: int, far: Mapping[str, float]) -> None:
        self._geom, self._far = geom, far
        self.times: list[float] = []
        self.pixels: list[int] = []

    def add(self, image: SimulatedImage) -> None:
        """Counts the pixels of an image that truly show it, within the range of the camera and with a depth."""
        shows = (
            (image.geom == self._geom) & (image.depth > 0.0) & (image.true_depth < self._far[image.camera])
        )
        self.times.append(image.time)
        self.pixels.append(int(np.count_nonzero(shows)))

    @property
    def first_seen(self) -> float | None:
        """Time of the first image that shows it [s]; None: none does."""
        return next((t for t, pixels in zip(self.times, self.pixels, strict=True) if pixels >= SHOWN), None)

    def in_view_before(self, time: float, *, gap: float) -> float:
        """For how long it was in view before a time [s]: shown at least once in every stretch of `gap` [s]."""
        shown = [
            t for t, pixels in zip(self.times, self.pixels, strict=True) if pixels >= SHOWN and t <= time
        ]
        since = time
        for t in reversed(shown):
            if since - t > gap:
                break
            since = t
        return time - since


class SurfaceLog:
    """When points of surfaces were first truly in view of cameras.

    Args:
        points: (N, 3) [m] in the world.
    """

    def __init__(self, points: Array) -> None:
        self.points = points
        self.first_seen: Array = np.full(len(points), np.inf)
        self._cameras: dict[str, DepthCamera] = {}

    def look_by(self, cameras: Sequence[DepthCamera]) -> None:
        """The cameras that look."""
        self._cameras = {camera.name: camera for camera in cameras}

    def add(self, image: SimulatedImage) -> None:
        """Marks the points that an image shows, whatever its noise."""
        unseen = np.flatnonzero(np.isinf(self.first_seen))
        camera = self._cameras[image.camera]
        local = (self.points[unseen] - image.pose[:3, 3]) @ image.pose[:3, :3]
        ahead = local[:, 2] > camera.near
        unseen, local = unseen[ahead], local[ahead]
        if not len(unseen):
            return
        u, v = np.rint(camera.project(local)).astype(int).T
        inside = (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height) & (local[:, 2] < camera.far)
        shown = image.true_depth[v[inside], u[inside]]
        has_depth = image.depth[v[inside], u[inside]] > 0.0
        near = np.abs(shown - local[inside, 2]) < ON_SURFACE + ON_SURFACE_SHARE * local[inside, 2]
        self.first_seen[unseen[inside][near & has_depth]] = image.time

    def seen_at(self, place: Array) -> float:
        """When the surface around a place (3,) was first seen [s]; inf: never."""
        near = np.linalg.norm(self.points - place, axis=1) < TOUCHED
        return float(self.first_seen[near].min(initial=np.inf))
