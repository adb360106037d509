"""Balls that cover triangle meshes, see `ball_cover`."""

from __future__ import annotations

import numpy as np
import trimesh
from numpy.typing import NDArray

from sidestep._core import distance_to_triangles
from sidestep.shapes.ball_cover import check_count, check_excess, cover
from sidestep.shapes.flat_cover import flat_balls, on_large_faces
from sidestep.shapes.nearest_on_mesh import NearestOnMesh

Array = NDArray[np.float64]

FIRST_BATCH = 256  # cells of a mesh that propose balls at once; doubled every time
TANGENT = 1e-12  # relative; a ball that is empty but for this touches the surface where it was told to
DEPTH_SAMPLES = 200  # points of a surface by which its usual depth is found
THICK = 1.5  # of the usual depth: what is deeper is filled
FEW_TRIANGLES = 200  # of a mesh: the distances to all of them take less time than a tree
SHRINKINGS = 40  # of a ball that is to touch a mesh; each at least leaves one point behind


def mesh_balls(mesh: trimesh.Trimesh, excess: float) -> tuple[Array, Array]:
    """Balls that hold the triangles of a mesh.

    Where the mesh is closed and its triangles are turned alike they may lie deep inside; else they are on the surface.
    """
    check_excess(excess)
    surface = _Mesh(mesh)
    large = on_large_faces(surface.triangles, excess)
    parts = [surface.flat(excess, large)] if large.any() else []
    if not large.all():
        surface.chosen = ~large
        parts.append(cover(surface, excess, batch=FIRST_BATCH))
    centres, radii = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    return centres, radii


class _Mesh:
    """Cells are triangles: three corners (3,), and the inward normal (3,)."""

    def __init__(self, mesh: trimesh.Trimesh) -> None:
        self.triangles = np.array(mesh.triangles, dtype=np.float64)
        normals = np.cross(
            self.triangles[:, 1] - self.triangles[:, 0], self.triangles[:, 2] - self.triangles[:, 0]
        )
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0.0)
        self._closed = _is_closed(mesh)
        inward = -1.0 if not self._closed or mesh.volume > 0.0 else 1.0
        self._normals = inward * normals
        self._size = float(np.linalg.norm(np.ptp(self.triangles.reshape(-1, 3), axis=0)))
        self.chosen = np.ones(len(self.triangles), dtype=bool)  # triangles that are cells
        self._nearest = NearestOnMesh(self.triangles) if self._closed else None

    def flat(self, excess: float, large: NDArray[np.bool_]) -> tuple[Array, Array]:
        """The balls of those triangles that lie on large flat faces."""
        inner, depths = self._inner_balls()
        inward = self._normals if self._closed else np.zeros_like(self._normals)
        usual = float(np.median(depths)) * (1.0 - 1e-6) if len(depths) else 0.0  # less rounding
        centres, radii = flat_balls(self.triangles[large], inward[large], self._fits, excess, usual)
        thick = np.flatnonzero(depths > THICK * usual)
        thick = thick[np.argsort(-depths[thick], kind="stable")]
        kept: list[int] = []  # the largest first: in the middle of what is thick there is no hole
        for k in thick.tolist():
            if all(np.linalg.norm(inner[k] - inner[other]) > 0.5 * depths[other] for other in kept):
                kept.append(k)
        return np.concatenate([centres, inner[kept]]), np.concatenate([radii, depths[kept]])

    def _inner_balls(self) -> tuple[Array, Array]:
        """Centres (N, 3) and radii (N,) of balls inside that touch the surface at random points, if any."""
        if self._nearest is None:
            return np.zeros((0, 3)), np.zeros(0)
        rng = np.random.default_rng(0)
        corners = self.triangles
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        drawn = rng.choice(len(corners), DEPTH_SAMPLES, p=areas / areas.sum())
        shares = rng.dirichlet(np.ones(3), DEPTH_SAMPLES)
        points = np.einsum("nc,nci->ni", shares, corners[drawn])
        depths = self._depths(points, self._normals[drawn])
        return points + depths[:, None] * self._normals[drawn], depths

    def _fits(self, centres: Array, radius: float) -> NDArray[np.bool_]:
        """Whether balls hold no point of the surface."""
        assert self._nearest is not None  # only a closed surface has an inside
        if len(self.triangles) <= FEW_TRIANGLES:
            every = np.broadcast_to(np.arange(len(self.triangles)), (len(centres), len(self.triangles)))
            distance = distance_to_triangles(centres, self.triangles, np.ascontiguousarray(every))
        else:
            distance = self._nearest.of(centres)[1]
        return np.asarray(distance >= radius * (1.0 - TANGENT) - TANGENT * self._size)

    def cells(self, excess: float) -> Array:
        triangles, normals = self.triangles[self.chosen], self._normals[self.chosen]
        if not self._closed:  # on the surface: a ball holds a triangle whose corners are within the excess
            sides = triangles[:, 1:] - triangles[:, :1]
            area = 0.5 * float(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum())
            check_count(area / (2.0 * excess**2))
        return np.hstack([triangles.reshape(-1, 9), normals])

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
        depth = self._depths(middles, normals)
        return middles + depth[:, None] * normals, depth

    def _depths(self, middles: Array, normals: Array) -> Array:
        """Radii (N,) of balls inside that touch the surface at points (N, 3), with inward normals (N, 3)."""
        assert self._nearest is not None  # only a closed surface has an inside
        depth: Array = np.where(normals.any(axis=1), 0.5 * self._size, 0.0)
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
        return depth

    def halves(self, cells: Array) -> Array:
        corners = self.corners(cells)
        lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        first = np.argmax(lengths, axis=1)
        rows = np.arange(len(cells))
        a, b, c = (corners[rows, (first + k) % 3] for k in range(3))
        middle = 0.5 * (a + b)
        normals = cells[:, 9:12]
        return np.concatenate([np.hstack([a, middle, c, normals]), np.hstack([middle, b, c, normals])])


def _is_closed(mesh: trimesh.Trimesh) -> bool:
    """Whether each edge is run through as often one way as the other: an inside is well-defined.

    So it is of parts in one file that touch or overlap, whose edges have more than two triangles.
    """
    edges = np.asarray(mesh.faces)[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    sign = np.sign(edges[:, 1] - edges[:, 0])
    _, number = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    return not np.bincount(number.reshape(-1), sign).any()
