"""Proof on triangles that ellipsoids cover a surface, and the growth that completes it."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from sidestep.body.cover_refine import Ellipsoids
from sidestep.body.cover_surface import Array, bisect
from sidestep.math.matrices import determinant

BATCH = 200_000  # triangles examined at once: bounds the memory


@dataclass(frozen=True, eq=False)
class Certificate:
    """Which part of a surface is proven to be covered.

    Attributes:
        covered_area: [m^2] of triangles that each lie in one ellipsoid.
        total_area: [m^2].
        remaining: triangles (R, 3, 3), none longer than the tolerance, that lie in no single ellipsoid.
        num_pieces: triangles examined.
    """

    covered_area: float
    total_area: float
    remaining: Array
    num_pieces: int

    @property
    def complete(self) -> bool:
        return len(self.remaining) == 0


def certify(triangles: Array, ellipsoids: Ellipsoids, *, tolerance: float) -> Certificate:
    """Examines a surface triangle by triangle.

    A triangle lies in an ellipsoid when its three corners do, because an ellipsoid is convex. A triangle that lies
    in none is cut at the middle of its longest edge, down to `tolerance` [m]. No sampling is involved.
    """
    todo = triangles
    remaining = []
    covered, pieces = 0.0, 0
    while len(todo):
        batch, todo = todo[:BATCH], todo[BATCH:]
        pieces += len(batch)
        radii = ellipsoids.squared_radii(batch.reshape(-1, 3)).reshape(len(ellipsoids), len(batch), 3)
        a, b, c = (radii[:, :, corner] <= 1.0 for corner in range(3))
        proven = (a & b & c).any(axis=0)
        covered += float(_areas(batch[proven]).sum())
        batch = batch[~proven]
        edges = np.linalg.norm(batch[:, [1, 2, 0]] - batch, axis=2)
        fine = edges.max(axis=1) <= tolerance
        remaining.append(batch[fine])
        batch, edges = batch[~fine], edges[~fine]
        if len(batch):
            todo = np.concatenate([bisect(batch, edges.argmax(axis=1)), todo])
    left = np.concatenate(remaining) if remaining else np.empty((0, 3, 3))
    return Certificate(covered, float(_areas(triangles).sum()), left, pieces)


def complete(
    triangles: Array, ellipsoids: Ellipsoids, *, tolerance: float, points: Array
) -> tuple[Ellipsoids, Certificate]:
    """Grows ellipsoids about their centres as little as needed until the certificate is complete.

    Args:
        triangles: the surface (F, 3, 3) [m].
        ellipsoids: the start.
        tolerance: longest edge of a triangle that is not cut further [m].
        points: of the surface (N, 3); covered first, so that few triangles are left to be cut.
    """
    ellipsoids = grow(ellipsoids, points[:, None])
    certificate = certify(triangles, ellipsoids, tolerance=tolerance)
    while not certificate.complete:
        ellipsoids = grow(ellipsoids, certificate.remaining)
        certificate = certify(triangles, ellipsoids, tolerance=tolerance)
    return ellipsoids, certificate


def grow(ellipsoids: Ellipsoids, pieces: Array) -> Ellipsoids:
    """Grows ellipsoids until each piece (P, corners, 3) lies in one of them."""
    count = len(ellipsoids)
    corners = ellipsoids.squared_radii(pieces.reshape(-1, 3)).reshape(count, len(pieces), -1)
    farthest = functools.reduce(np.maximum, np.moveaxis(corners, 2, 0))
    radii = np.sqrt(farthest[:, (farthest > 1.0).all(axis=0)])
    sizes = np.array([math.cbrt(abs(volume)) for volume in determinant(ellipsoids.shapes)])
    growth = (radii - 1.0) * sizes[:, None]
    radii = radii[:, growth.min(axis=0).argsort()[::-1]]
    factors = np.ones(count)
    while radii.size:  # worst first: what the growth of one ellipsoid covers needs no growth of another
        k = int(((radii[:, 0] - factors) * sizes).argmin())
        factors[k] = radii[k, 0] * (1.0 + 1e-9)
        radii = radii[:, (radii > factors[:, None]).all(axis=0)]
    return ellipsoids.scaled(factors)


def _areas(triangles: Array) -> Array:
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return np.asarray(0.5 * np.linalg.norm(cross, axis=1))
