"""Surfaces as dense points: how far points are from the links of an arm."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
import trimesh
from scipy.spatial import ConvexHull, cKDTree

from sidestep.distance.convex_parts import convex_parts
from sidestep.math.pose import moved
from sidestep.robot import Robot
from sidestep.robot.link import Link

Array = npt.NDArray[np.float64]
Looks = Literal["mesh", "collision", "visual"]

SPACING = 0.005  # [m] longest edge of the triangles whose corners stand for a surface


@dataclass(frozen=True, eq=False)
class Nearest:
    """The nearest points of an arm.

    Attributes:
        distance: (N,) [m]; inf beyond the bound. link: (N,) number of the link. point: (N, 3) in the link [m].
    """

    distance: Array
    link: npt.NDArray[np.intp]
    point: Array


class LinkSurfaces:
    """The surfaces of an arm's links, as corners of triangles whose edges are at most `SPACING` long.

    A distance d is too large by less than h^2 / (2 d), h = 2.9 mm: 0.2 mm at 2 cm, and by h at the surface.

    Args:
        robot: with geometry.
        looks: "mesh": the collision meshes; "collision": their convex parts; "visual": the visual meshes, of links
            without any the collision meshes.
    """

    def __init__(self, robot: Robot, looks: Looks) -> None:
        self._robot = robot
        found = {link.name: link_triangles(link, looks) for link in robot.links}
        self.names = [name for name, triangles in found.items() if len(triangles)]
        self._points = [surface_points(found[name]) for name in self.names]
        self._trees = [cKDTree(points) for points in self._points]
        self._balls = [_ball(points) for points in self._points]

    def poses(self, q: Array) -> Array:
        """X_WL (L, 4, 4) of the links with a surface."""
        return np.array([self._robot.pose(q, name) for name in self.names])

    def middle(self, q: Array, links: Sequence[str]) -> Array:
        """Mean (3,) of the points of some links in the world [m]."""
        some = [
            moved(points, X_WL)
            for name, points, X_WL in zip(self.names, self._points, self.poses(q), strict=True)
            if name in links
        ]
        return np.asarray(np.vstack(some).mean(axis=0))

    def nearest(self, points: Array, poses: Array, *, within: float = np.inf) -> Nearest:
        """The nearest point of the links at `poses` (L, 4, 4) to each point (N, 3), if it is nearer than `within`."""
        best = Nearest(
            np.full(len(points), within), np.zeros(len(points), np.intp), np.zeros((len(points), 3))
        )
        local = [(points - X_WL[:3, 3]) @ X_WL[:3, :3] for X_WL in poses]
        at_least = np.array(
            [np.linalg.norm(p - c, axis=1) - r for p, (c, r) in zip(local, self._balls, strict=True)]
        ).reshape(len(poses), len(points))
        for link in np.argsort(at_least.min(axis=1, initial=np.inf)):
            some = np.nonzero(at_least[link] < best.distance)[0]
            if not len(some):
                continue
            bound = float(best.distance[some].max())
            distance, index = self._trees[link].query(local[link][some], distance_upper_bound=bound)
            nearer = distance < best.distance[some]
            which = some[nearer]
            best.distance[which], best.link[which] = distance[nearer], link
            best.point[which] = self._points[link][index[nearer]]
        best.distance[best.distance >= within] = np.inf
        return best


def link_triangles(link: Link, looks: Looks) -> Array:
    """Triangles (F, 3, 3) of a link's surface in its frame [m]."""
    if looks == "collision":
        parts = [
            corners
            for geometry in link.geometries
            for corners in convex_parts(np.array(geometry.mesh().triangles, dtype=float))
        ]
        return _stacked(corners[ConvexHull(corners).simplices] for corners in parts)
    geometries = link.geometries if looks == "mesh" else link.visuals or link.geometries
    return _stacked(np.array(geometry.mesh().triangles, dtype=float) for geometry in geometries)


def surface_points(triangles: Array) -> Array:
    """Corners (N, 3) of these triangles (F, 3, 3), divided until no edge is longer than `SPACING`."""
    faces = np.arange(3 * len(triangles)).reshape(-1, 3)
    points, _ = trimesh.remesh.subdivide_to_size(  # type: ignore[no-untyped-call]
        triangles.reshape(-1, 3), faces, max_edge=SPACING, max_iter=20
    )
    return np.unique(np.round(points, 6), axis=0)


def _ball(points: Array) -> tuple[Array, float]:
    """Centre (3,) and radius of a ball that holds points (N, 3)."""
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return centre, float(np.linalg.norm(points - centre, axis=1).max())


def _stacked(parts: Iterable[Array]) -> Array:
    return np.vstack([np.empty((0, 3, 3)), *parts])
