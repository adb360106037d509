"""Balls that cover triangle meshes, see `ball_cover`."""

from __future__ import annotations

import numpy as np
import trimesh
from numpy.typing import NDArray

from sidestep.obstacles.ball_cover import check_count, cover
from sidestep.obstacles.nearest_on_mesh import NearestOnMesh

Array = NDArray[np.float64]

FIRST_BATCH = 256  # cells of a mesh that propose balls at once; doubled every time
TANGENT = 1e-12  # relative; a ball that is empty but for this touches the surface where it was told to
SHRINKINGS = 40  # of a ball that is to touch a mesh; each at least leaves one point behind


def mesh_balls(mesh: trimesh.Trimesh, excess: float) -> tuple[Array, Array]:
    """Balls that hold the triangles of a mesh.

    Where the mesh is closed and its triangles are turned alike they may lie deep inside; else they are on the surface.
    """
    return cover(_Mesh(mesh), excess, batch=FIRST_BATCH)


class _Mesh:
    """Cells are triangles: three corners (3,), and the inward normal (3,)."""

    def __init__(self, mesh: trimesh.Trimesh) -> None:
        self._triangles = np.array(mesh.triangles, dtype=np.float64)
        normals = np.cross(
            self._triangles[:, 1] - self._triangles[:, 0], self._triangles[:, 2] - self._triangles[:, 0]
        )
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0.0)
        self._closed = bool(mesh.is_watertight and mesh.is_winding_consistent)
        inward = -1.0 if not self._closed or mesh.volume > 0.0 else 1.0
        self._normals = inward * normals
        self._size = float(np.linalg.norm(np.ptp(self._triangles.reshape(-1, 3), axis=0)))
        self._area = 0.5 * float(lengths.sum())
        self._nearest = NearestOnMesh(self._triangles) if self._closed else None

    def cells(self, excess: float) -> Array:
        if not self._closed:  # on the surface: a ball holds a triangle whose corners are within the excess
            check_count(self._area / (2.0 * excess**2))
        return np.hstack([self._triangles.reshape(-1, 9), self._normals])

    def corners(self, cells: Array) -> Array:
        return cells[:, :9].reshape(-1, 3, 3)

    def middles(self, cells: Array) -> Array:
        middles: Array = self.corners(cells).mean(axis=1)
        return middles

    def inside(self, cells: Array) -> tuple[Array, Array]:
        """Balls are shrunk until they hold no point of the mesh (Ma, Bae, Choi 2012)."""
        middles, normals = self.middles(cells), cells[:, 9:12]
        if self._nearest is None:
            return middles, np.zeros(len(cells))
        depth = np.where(normals.any(axis=1), 0.5 * self._size, 0.0)
        moving = np.flatnonzero(depth)
        for _ in range(SHRINKINGS):
            centres = middles[moving] + depth[moving, None] * normals[moving]
            found, distance = self._nearest.of(centres)
            too_large = distance < depth[moving] * (1.0 - TANGENT) - TANGENT * self._size
            moving, found = moving[too_large], found[too_large]
            if len(moving) == 0:
                break
            towards = found - middles[moving]  # a ball through both, with the same tangent plane
            along = np.einsum("ij,ij->i", towards, normals[moving])
            smaller = np.einsum("ij,ij->i", towards, towards) / (2.0 * np.maximum(along, 1e-300))
            depth[moving] = np.minimum(smaller, depth[moving] * (1.0 - 1e-9))
        depth[moving] = 0.0
        return middles + depth[:, None] * normals, depth

    def halves(self, cells: Array) -> Array:
        corners = self.corners(cells)
        lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        first = np.argmax(lengths, axis=1)
        rows = np.arange(len(cells))
        a, b, c = (corners[rows, (first + k) % 3] for k in range(3))
        middle = 0.5 * (a + b)
        normals = cells[:, 9:12]
        return np.concatenate([np.hstack([a, middle, c, normals]), np.hstack([middle, b, c, normals])])
