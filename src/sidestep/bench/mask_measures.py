"""What a mask leaves of the arm, and what it takes of the world, of one image."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import DepthCamera
from sidestep.bench.link_surfaces import LinkSurfaces, Nearest
from sidestep.math.pose import moved
from sidestep.perception import PixelLabel

Array = npt.NDArray[np.float64]

BIN = 1e-3  # [m] of the histograms of distances
NOISE = 3.0  # standard deviations of a depth that is measured right
STEP_OF_EDGE = 4e-3  # [m] by which a depth may be off besides


@dataclass(frozen=True, eq=False)
class ArmTruth:
    """Where the arm and the camera are: truly, or as they are believed to be.

    Attributes:
        X_WC: (4, 4) of the camera. poses: (L, 4, 4) of the links with a surface.
        others: pairs (X_WC, poses) at the ends of the time within which the image may have been taken.
    """

    X_WC: Array
    poses: Array
    others: tuple[tuple[Array, Array], ...] = ()

    def moves(self, nearest: Nearest) -> Array:
        """How far (N,) points of links move in the image's frame within that time, at most [m]."""
        most = np.zeros(len(nearest.point))
        here = self._in_camera(self.X_WC, self.poses, nearest)
        for X_WC, poses in self.others:
            there = self._in_camera(X_WC, poses, nearest)
            most = np.maximum(most, np.linalg.norm(there - here, axis=1))
        return most

    @staticmethod
    def _in_camera(X_WC: Array, poses: Array, nearest: Nearest) -> Array:
        X = poses[nearest.link]
        p_W = np.einsum("nij,nj->ni", X[:, :3, :3], nearest.point) + X[:, :3, 3]
        return np.asarray((p_W - X_WC[:3, 3]) @ X_WC[:3, :3])


def expected_error(camera: DepthCamera, points_C: Array, moves: Array) -> Array:
    """What errors explain at points (N, 3) of the optical frame [m]: pose, one pixel, time, and noise of the depth.

    translation_error + rotation_error r + r / f + moves + 3 sigma(z), r = |p|.
    """
    away = np.linalg.norm(points_C, axis=1)
    z, noise = points_C[:, 2], camera.noise
    sigma = noise.constant + noise.quadratic * z * z
    pixel = away / min(camera.fx, camera.fy)
    return np.asarray(camera.translation_error + camera.rotation_error * away + pixel + moves + NOISE * sigma)


def depth_error(camera: DepthCamera, z: Array) -> Array:
    """By how much a depth that is measured right may be off [m]: 3 sigma(z) and 4 mm."""
    return np.asarray(NOISE * (camera.noise.constant + camera.noise.quadratic * z * z) + STEP_OF_EDGE)


def points_of(camera: DepthCamera, depth: npt.NDArray[Any], pixels: npt.NDArray[np.bool_]) -> Array:
    """Points (N, 3) in the optical frame of some pixels [m]; without distortion."""
    v, u = np.nonzero(pixels)
    z = depth[pixels].astype(float)
    return np.column_stack([(u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z])


@dataclass
class MaskMeasures:
    """Sums over images.

    Attributes:
        images, pixels: number of them. arm_pixels: of those that show the arm and have a depth.
        left_over: pixels of the arm that count as obstacle. Of them: left_over_true, whose depth is right;
        left_over_world, whose depth is that of something behind, where an obstacle is; the others are between the two.
        worst_left_over: of one image. images_with_left_over: number of them.
        world_pixels: of those that show something else and have a depth. lost: of them those labelled as arm.
        lost_true: of those the ones whose depth is right; of these are, by millimetre:
        distance: from the surface of the arm. beyond: the same less the expected error.
        beyond_told: of the measured point, from where the arm is believed, less the expected error.
    """

    images: int = 0
    pixels: int = 0
    arm_pixels: int = 0
    left_over: int = 0
    left_over_true: int = 0
    left_over_world: int = 0
    worst_left_over: int = 0
    images_with_left_over: int = 0
    world_pixels: int = 0
    lost: int = 0
    lost_true: int = 0
    distance: Counter[int] = field(default_factory=Counter)
    beyond: Counter[int] = field(default_factory=Counter)
    beyond_told: Counter[int] = field(default_factory=Counter)

    def add_left_over(
        self,
        camera: DepthCamera,
        labels: npt.NDArray[np.uint8],
        image: MaskedImage,
        from_world: Callable[[Array], Array],
    ) -> npt.NDArray[np.bool_]:
        """Counts pixels of the arm; which of them are left over (H, W).

        Args:
            from_world: distances (N,) of points (N, 3) of the optical frame to solids [m].
        """
        arm = image.is_arm & (labels != int(PixelLabel.nothing))
        left = image.is_arm & (labels == int(PixelLabel.obstacle))
        count = int(left.sum())
        self.images += 1
        self.pixels += labels.size
        self.arm_pixels += int(arm.sum())
        self.left_over += count
        right = left & image.is_right(camera)
        self.left_over_true += int(right.sum())
        if count:
            p_C = points_of(camera, image.depth, left & ~right)
            on_world = from_world(p_C) <= depth_error(camera, p_C[:, 2])
            self.left_over_world += int(on_world.sum())
        self.worst_left_over = max(self.worst_left_over, count)
        self.images_with_left_over += count > 0
        return np.asarray(left)

    def add_lost(
        self,
        camera: DepthCamera,
        labels: npt.NDArray[np.uint8],
        image: MaskedImage,
        surfaces: LinkSurfaces,
        true: ArmTruth,
        told: ArmTruth,
    ) -> None:
        """Measures the pixels of the world that count as arm."""
        self.world_pixels += int((image.is_world & (labels != int(PixelLabel.nothing))).sum())
        lost = image.is_world & (labels == int(PixelLabel.arm))
        self.lost += int(lost.sum())
        lost &= image.is_right(camera)
        self.lost_true += int(lost.sum())
        if not lost.any():
            return
        p_C = points_of(camera, image.true_depth, lost)
        nearest = surfaces.nearest(moved(p_C, true.X_WC), true.poses)
        error = expected_error(camera, p_C, true.moves(nearest))
        _count(self.distance, nearest.distance)
        _count(self.beyond, nearest.distance - error)
        measured = points_of(camera, image.depth, lost)
        believed = surfaces.nearest(moved(measured, told.X_WC), told.poses)
        error = expected_error(camera, measured, told.moves(believed))
        _count(self.beyond_told, believed.distance - error)

    def to_document(self) -> dict[str, Any]:
        """For JSON; histograms by millimetre."""
        return {
            name: {str(key): value[key] for key in sorted(value)} if isinstance(value, Counter) else value
            for name, value in vars(self).items()
        }

    @classmethod
    def sum_of(cls, documents: list[dict[str, Any]]) -> MaskMeasures:
        """Of what `to_document` gave."""
        total = cls()
        for document in documents:
            for name, value in document.items():
                own = getattr(total, name)
                if isinstance(own, Counter):
                    own.update({int(key): count for key, count in value.items()})
                elif name == "worst_left_over":
                    total.worst_left_over = max(own, value)
                else:
                    setattr(total, name, own + value)
        return total


@dataclass(frozen=True, eq=False)
class MaskedImage:
    """What one image shows, by its truth.

    Attributes:
        depth, true_depth: (H, W) [m], 0: nothing. is_arm, is_world: (H, W).
    """

    depth: npt.NDArray[np.float32]
    true_depth: npt.NDArray[np.float32]
    is_arm: npt.NDArray[np.bool_]
    is_world: npt.NDArray[np.bool_]

    def is_right(self, camera: DepthCamera) -> npt.NDArray[np.bool_]:
        """Whether a depth is that of its pixel but for noise, and not of another surface or between two (H, W)."""
        z = self.true_depth.astype(float)
        return np.asarray((self.depth > 0.0) & (np.abs(self.depth - z) <= depth_error(camera, z)))


def quantile(histogram: Counter[int], share: float) -> float | None:
    """The upper end of the bin [m] up to which a share of a histogram lies; None of an empty one."""
    total, seen = sum(histogram.values()), 0
    for key in sorted(histogram):
        seen += histogram[key]
        if seen >= share * total:
            return BIN * (key + 1)
    return None


def _count(histogram: Counter[int], distances: Array) -> None:
    keys, counts = np.unique(np.floor(distances / BIN).astype(int), return_counts=True)
    histogram.update(dict(zip(keys.tolist(), counts.tolist(), strict=True)))
