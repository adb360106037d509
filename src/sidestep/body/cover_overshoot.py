"""How much larger than a link the union of its ellipsoids is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sidestep.body.cover_refine import Ellipsoids, sphere_directions
from sidestep.body.cover_surface import Array, LinkSurface

NUM_DIRECTIONS = 16_000  # per ellipsoid, 0.5 to 1 mm apart on an arm; four times as many find 0.3 mm more


@dataclass(frozen=True, eq=False)
class Overshoot:
    """Distances from the mesh of points on the boundary of the union, where it runs outside the mesh.

    Attributes:
        points: on the boundary of the union and outside the mesh (N, 3) [m].
        distances: exact distances to the mesh (N,) [m].
        areas: share of the boundary's area each point stands for (N,) [m^2].
    """

    points: Array
    distances: Array
    areas: Array

    @property
    def mean(self) -> float:
        """Mean over the area of the boundary [m]."""
        return float(np.average(self.distances, weights=self.areas)) if len(self.points) else 0.0

    @property
    def maximum(self) -> float:
        """Largest distance of any point [m]."""
        return float(self.distances.max(initial=0.0))


def overshoot(surface: LinkSurface, ellipsoids: Ellipsoids, *, directions: int = NUM_DIRECTIONS) -> Overshoot:
    """Samples every ellipsoid's boundary evenly and keeps what lies in no other ellipsoid and outside the link."""
    boundary, areas = ellipsoids.boundary(sphere_directions(directions))
    free = np.empty(areas.shape, dtype=bool)
    for k, points in enumerate(boundary):  # one after another: the radii of all of them are many
        radii = ellipsoids.squared_radii(points)
        radii[k] = np.inf
        free[k] = (radii > 1.0).all(axis=0)
    points, areas = boundary[free], areas[free]
    distances = surface.overshoot(points)
    outside = distances > 0.0
    return Overshoot(points[outside], distances[outside], areas[outside])


def union_volume(ellipsoids: Ellipsoids, rng: np.random.Generator, count: int) -> float:
    """Volume of the union [m^3], by `count` uniform samples of its bounding box."""
    reach = np.sqrt(np.square(ellipsoids.shapes).sum(axis=2))
    low, high = (ellipsoids.centres - reach).min(axis=0), (ellipsoids.centres + reach).max(axis=0)
    points = rng.uniform(low, high, size=(count, 3))
    inside = (ellipsoids.squared_radii(points) <= 1.0).any(axis=0)
    return float((high - low).prod() * inside.mean())


def interior_coverage(surface: LinkSurface, ellipsoids: Ellipsoids) -> float:
    """Share of the link's inner nodes of the distance field that lie in an ellipsoid; 1 without such nodes."""
    nodes = surface.field.nodes[surface.field.values.reshape(-1) < 0.0]
    return float((ellipsoids.squared_radii(nodes) <= 1.0).any(axis=0).mean()) if len(nodes) else 1.0
