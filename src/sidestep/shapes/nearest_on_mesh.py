"""Nearest points of triangles, exact to rounding, without a collision library."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

MAX_PAIRS = 4_000_000  # of a point and a triangle that are looked at in one go: some hundred MB
SLACK = 1.0 + 1e-9  # of bounds, for rounding
ROUNDING = 1e-12  # of the size of a mesh: slack of bounds of points that lie on it
SLIVER = 1e-6  # height over length of triangles whose normals are mostly rounding


class NearestOnMesh:
    """Finds the nearest points of triangles.

    The triangle with the nearest middle bounds the distance. Triangles within that bound are found by the balls around
    them, in trees of triangles alike in size; most of them drop out by the disc around each, and the others are exact.
    """

    def __init__(self, triangles: Array) -> None:
        """Of triangles (M, 3 corners, 3) [m], M > 0; they may be degenerate."""
        self._triangles = triangles
        self._middles = triangles.mean(axis=1)
        self._radii = np.linalg.norm(triangles - self._middles[:, None], axis=2).max(axis=1)
        normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        flat = (
            lengths > SLIVER * self._radii[:, None] ** 2
        )  # without a normal a disc becomes a ball, a looser bound
        self._normals = np.divide(normals, lengths, out=np.zeros_like(normals), where=flat)
        self._rounding = ROUNDING * float(np.abs(triangles).max())
        octaves = np.frexp(self._radii)[1]
        groups = [np.flatnonzero(octaves == octave) for octave in np.unique(octaves)]
        self._groups = [
            (group, cKDTree(self._middles[group]), float(self._radii[group].max())) for group in groups
        ]

    def of(self, points: Array) -> tuple[Array, Array]:
        """Nearest points (N, 3) of the triangles to points (N, 3), and distances (N,)."""
        size = max(1, MAX_PAIRS // len(self._triangles))
        parts = [self._of_few(points[begin : begin + size]) for begin in range(0, len(points), size)]
        nearest = np.concatenate([np.zeros((0, 3)), *parts])
        return nearest, np.linalg.norm(nearest - points, axis=1)

    def _of_few(self, points: Array) -> Array:
        bounds = np.full(len(points), np.inf)
        for group, tree, _ in self._groups:
            found = nearest_on_triangles(points, self._triangles[group[tree.query(points)[1]]])
            bounds = np.minimum(bounds, np.linalg.norm(found - points, axis=1))
        bounds = SLACK * bounds + self._rounding
        pairs = [self._pairs(points, bounds, *group) for group in self._groups]
        rows, chosen = (np.concatenate(indices) for indices in zip(*pairs, strict=True))
        found = nearest_on_triangles(points[rows], self._triangles[chosen])
        distance = np.linalg.norm(found - points[rows], axis=1)
        order = np.lexsort((distance, rows))
        first = order[np.flatnonzero(np.diff(rows[order], prepend=-1))]
        nearest: Array = found[first]
        return nearest

    def _pairs(
        self, points: Array, bounds: Array, group: Indices, tree: cKDTree, radius: float
    ) -> tuple[Indices, Indices]:
        """Indices of points, and of triangles of a group that may be within their bounds."""
        near = tree.query_ball_point(points, bounds + SLACK * radius, return_sorted=False)
        counts = np.fromiter(map(len, near), np.int64, len(near))
        rows = np.repeat(np.arange(len(points)), counts)
        chosen = group[np.fromiter((index for held in near for index in held), np.int64, int(counts.sum()))]
        offsets = points[rows] - self._middles[chosen]
        height = np.einsum("ij,ij->i", offsets, self._normals[chosen])
        across = np.sqrt(np.maximum(np.einsum("ij,ij->i", offsets, offsets) - height**2, 0.0))
        beside = np.maximum(across - SLACK * self._radii[chosen], 0.0)
        kept = height**2 + beside**2 <= bounds[rows] ** 2
        return rows[kept], chosen[kept]


def nearest_on_triangles(points: Array, triangles: Array) -> Array:
    """The nearest point (N, 3) of each triangle (N, 3 corners, 3) to one point (N, 3) each."""
    a, b, c = (triangles[:, k] for k in range(3))
    normals = np.cross(b - a, c - a)
    areas = np.einsum("ij,ij->i", normals, normals)
    areas[areas == 0.0] = np.inf  # degenerate: the sides are all there is
    along_b = np.einsum("ij,ij->i", np.cross(points - a, c - a), normals) / areas
    along_c = np.einsum("ij,ij->i", np.cross(b - a, points - a), normals) / areas
    nearest: Array = a + along_b[:, None] * (b - a) + along_c[:, None] * (c - a)
    inside = (along_b >= 0.0) & (along_c >= 0.0) & (along_b + along_c <= 1.0) & np.isfinite(areas)
    lengths = np.maximum(np.einsum("ij,ij->i", b - a, b - a), np.einsum("ij,ij->i", c - a, c - a))
    least = np.where(inside, np.linalg.norm(nearest - points, axis=1), np.inf)
    sides = np.flatnonzero(~inside | (areas < (SLIVER * lengths) ** 2))
    for start, end in ((a, b), (b, c), (c, a)):
        side, there = (end - start)[sides], start[sides]
        squared = np.einsum("ij,ij->i", side, side)
        share = np.einsum("ij,ij->i", points[sides] - there, side) / np.where(squared > 0.0, squared, 1.0)
        found = there + np.clip(share, 0.0, 1.0)[:, None] * side
        distance = np.linalg.norm(found - points[sides], axis=1)
        nearer = distance < least[sides]
        nearest[sides[nearer]], least[sides[nearer]] = found[nearer], distance[nearer]
    return nearest
