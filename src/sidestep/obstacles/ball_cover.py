"""Few balls that hold the whole surface of a solid, and reach out of it by no more than a given excess.

A point c inside a solid at depth delta(c) is the centre of a ball of radius delta(c) + excess, which reaches at most
`excess` out of the solid. The surface is cut into cells, each inside the convex hull of its corners; balls are convex,
so a ball that holds the corners of a cell holds the cell. Every cell proposes the largest ball that touches the surface
from inside at the middle of the cell, grown by the excess: with half a diagonal h and depth d it holds the cell where
h^2 <= 2 d excess + excess^2. A cell that its ball does not hold is halved; that ends where h <= excess. Of the balls
that are proposed, those that hold most cells are taken first (greedy set cover).
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from itertools import pairwise
from typing import Protocol

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from sidestep.mesh import mesh_model

Array = NDArray[np.float64]

EXCESS = 0.002  # [m] by default: less than half the clearance that the controller keeps by default
MAX_CELLS = 300_000  # more balls than a controller can use; stops a file in millimetres from filling memory
OVERHANG = 0.1  # of the excess: what the hull of an arc may stick out of a round surface at first
FIRST_BATCH = 256  # cells of a mesh that propose balls at once; doubled every time
TANGENT = 1e-12  # relative; a ball that is empty but for this touches the surface where it was told to
POINT_RADIUS = 1e-9  # [m] Coal has no point; a sphere this small stands for one
SHRINKINGS = 40  # of a ball that is to touch a mesh; each at least leaves one point behind


class Surface(Protocol):
    """A surface in cells: rows of numbers whose meaning only the surface knows."""

    def cells(self, excess: float) -> Array:
        """The cells (N, P) to begin with; together they are the surface."""

    def corners(self, cells: Array) -> Array:
        """Points (N, K, 3) whose convex hull holds the cell."""

    def middles(self, cells: Array) -> Array:
        """A point (N, 3) of each cell."""

    def inside(self, cells: Array) -> tuple[Array, Array]:
        """Centres (N, 3) of balls inside the solid that touch it at the middles of cells, and their radii (N,)."""

    def halves(self, cells: Array) -> Array:
        """The halves (2N, P) of cells."""


def box_balls(size: Sequence[float], excess: float) -> tuple[Array, Array]:
    """Centres (N, 3) and radii (N,) [m] of balls that hold the surface of a box (3,) around the origin."""
    return cover(_Box(np.asarray(size, dtype=np.float64)), excess)


def plane_balls(extent: float, excess: float) -> tuple[Array, Array]:
    """Balls that hold the square of half an edge `extent` in the plane z = 0, and reach `excess` above it at most."""
    return cover(_Square(extent), excess)


def cylinder_balls(radius: float, length: float, excess: float) -> tuple[Array, Array]:
    """Balls that hold the surface of a capped cylinder along z, around the origin."""
    return cover(_Cylinder(radius, length), excess)


def mesh_balls(mesh: trimesh.Trimesh, excess: float) -> tuple[Array, Array]:
    """Balls that hold the triangles of a mesh.

    Where the mesh is closed and its triangles are turned alike they may lie deep inside; else they are on the surface.
    """
    return cover(_Mesh(mesh), excess, batch=FIRST_BATCH)


def capsule_balls(radius: float, length: float, excess: float) -> tuple[Array, Array]:
    """A row of balls on the axis z that holds a capsule: its ball rolled over `length`, around the origin.

    Balls of radius R = radius + excess at a distance 2 sqrt(R^2 - radius^2) meet on the surface.
    """
    check_excess(excess)
    grown = radius + excess
    count = int(np.ceil(length / (2.0 * np.sqrt(excess * (2.0 * radius + excess)))))
    check_count(count)
    middles = (np.arange(count) + 0.5) / count - 0.5
    heights = np.concatenate([[-0.5 * length], middles * length, [0.5 * length]])
    centres = np.column_stack([np.zeros((count + 2, 2)), heights])
    radii = np.full(count + 2, grown)
    radii[[0, -1]] = radius  # exact half-balls at the ends
    return centres, radii


def cover(surface: Surface, excess: float, *, batch: int | None = None) -> tuple[Array, Array]:
    """Centres (N, 3) and radii (N,) of balls that hold a surface and reach out of its solid by at most `excess` [m].

    Args:
        surface: in cells.
        excess: [m] > 0.
        batch: number of cells that propose balls at first; None: all at once, best where a proposal costs little.

    Raises:
        ValueError: the excess is not positive, or so small that the number of balls is of no use.
    """
    check_excess(excess)
    left = surface.cells(excess)
    centres, radii = [np.zeros((0, 3))], [np.zeros(0)]
    rng = np.random.default_rng(0)
    while len(left):
        check_count(len(left) + sum(map(len, radii)))
        if batch is not None:
            left = left[rng.permutation(len(left))]
        proposing, others = np.split(left, [len(left) if batch is None else batch])
        middle, depth = surface.inside(proposing)
        reach = np.linalg.norm(surface.corners(proposing) - middle[:, None], axis=2).max(axis=1)
        fits = reach <= depth + excess
        left = np.concatenate([proposing[fits], surface.halves(proposing[~fits]), others])
        if fits.any():
            corners, middles = surface.corners(left), surface.middles(left)
            taken, size, held = _fewest(middle[fits], depth[fits] + excess, corners, middles)
            centres.append(middle[fits][taken])
            radii.append(size)
            left = left[~held]
        batch = None if batch is None else 2 * batch
    return np.concatenate(centres), np.concatenate(radii)


def check_excess(excess: float) -> None:
    """Raises ValueError unless the excess is a positive length [m]."""
    if not (np.isfinite(excess) and excess > 0.0):
        raise ValueError(f"excess is {excess}, must be positive and finite [m]")


def check_count(count: float) -> None:
    """Raises ValueError for a number of cells that is of no use."""
    if count > MAX_CELLS:
        raise ValueError(
            f"the excess asks for more than {MAX_CELLS} balls; a larger excess needs fewer; is the shape in metres?"
        )


def _fewest(
    centres: Array, radii: Array, corners: Array, middles: Array
) -> tuple[list[int], Array, NDArray[np.bool_]]:
    """Of balls, each of which holds a cell, those that are taken; their radii, no larger than needed; the cells held.

    The first cells are those of the balls, in order. Greedy: always the ball that holds most of the cells left.
    """
    near = cKDTree(middles).query_ball_point(centres, radii * (1.0 + 1e-9))
    reach: list[Array] = []
    for ball, cells in enumerate(near):
        cells = np.union1d(np.asarray(cells, dtype=np.int64), [ball])
        far = np.linalg.norm(corners[cells] - centres[ball], axis=2).max(axis=1)
        inside = (far <= radii[ball]) | (cells == ball)
        near[ball], far = cells[inside], far[inside]
        reach.append(far)
    held = np.zeros(len(corners), dtype=bool)
    heap = [(-len(cells), ball) for ball, cells in enumerate(near)]
    heapq.heapify(heap)
    taken, sizes = [], []
    while heap:
        before, ball = heapq.heappop(heap)
        if held[ball]:
            continue
        new = ~held[near[ball]]
        gain = int(new.sum())
        if gain < -before and heap and gain < -heap[0][0]:
            heapq.heappush(heap, (-gain, ball))
            continue
        taken.append(ball)
        sizes.append(reach[ball][new].max())
        held[near[ball]] = True
    return taken, np.array(sizes), held


def _cell_size(depth: float, excess: float) -> float:
    """Edge of the largest square that a ball of this depth holds, less some rounding."""
    return (1.0 - 1e-9) * float(np.sqrt(2.0 * (2.0 * depth * excess + excess**2)))


class _Box:
    """Cells are rectangles: low corner (3,), high corner (3,), outward normal (3,)."""

    def __init__(self, size: Array) -> None:
        self._half = 0.5 * size

    def cells(self, excess: float) -> Array:
        edge = _cell_size(float(self._half.min()), excess)
        counts = np.ceil(2.0 * self._half / edge)
        check_count(2.0 * float(counts[0] * counts[1] + counts[1] * counts[2] + counts[2] * counts[0]))
        cells = []
        for axis in range(3):
            for sign in (-1.0, 1.0):
                lines = [np.linspace(-h, h, int(n) + 1) for h, n in zip(self._half, counts, strict=True)]
                ends = [(line[:-1], line[1:]) for line in lines]
                ends[axis] = (np.array([sign * self._half[axis]]),) * 2
                low, high = (
                    np.stack(np.meshgrid(*side, indexing="ij"), axis=-1).reshape(-1, 3)
                    for side in zip(*ends, strict=True)
                )
                normal = np.zeros_like(low)
                normal[:, axis] = sign
                cells.append(np.hstack([low, high, normal]))
        return np.concatenate(cells)

    def corners(self, cells: Array) -> Array:
        choice = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T[None]
        corners: Array = np.where(choice == 0, cells[:, None, 0:3], cells[:, None, 3:6])
        return corners

    def middles(self, cells: Array) -> Array:
        middles: Array = 0.5 * (cells[:, 0:3] + cells[:, 3:6])
        return middles

    def inside(self, cells: Array) -> tuple[Array, Array]:
        middles, normals = self.middles(cells), cells[:, 6:9]
        room = np.where(normals == 0.0, self._half - np.abs(middles), self._half)
        depth = room.min(axis=1)
        return middles - depth[:, None] * normals, depth

    def halves(self, cells: Array) -> Array:
        axis = np.argmax(cells[:, 3:6] - cells[:, 0:3], axis=1)
        return _halved(cells, axis, axis + 3)


class _Square(_Box):
    """The top face of a cube below z = 0; what is beside the square is solid as well."""

    def __init__(self, extent: float) -> None:
        super().__init__(np.full(3, 2.0 * extent))
        self._extent = extent

    def cells(self, excess: float) -> Array:
        count = int(np.ceil(2.0 * self._extent / _cell_size(self._extent, excess)))
        check_count(float(count) ** 2)
        line = np.linspace(-self._extent, self._extent, count + 1)
        low, high = (
            np.stack([*np.meshgrid(ends, ends), np.zeros((count, count))], axis=-1).reshape(-1, 3)
            for ends in (line[:-1], line[1:])
        )
        return np.hstack([low, high, np.tile([0.0, 0.0, 1.0], (len(low), 1))])

    def inside(self, cells: Array) -> tuple[Array, Array]:
        depth = np.full(len(cells), self._extent)
        return self.middles(cells) - depth[:, None] * cells[:, 6:9], depth


class _Cylinder:
    """Cells are parts of the side or of a cap: low (radius, angle, height), high (radius, angle, height)."""

    def __init__(self, radius: float, length: float) -> None:
        self._radius, self._half = radius, 0.5 * length

    def cells(self, excess: float) -> Array:
        radius, half = self._radius, self._half
        edge = _cell_size(min(radius, half), excess)
        # the corner that two tangents to an arc make is radius / cos(angle / 2) from the axis
        arcs = max(6, int(np.ceil(np.pi / np.arccos(radius / (radius + OVERHANG * excess)))))
        bands, rings = int(np.ceil(2.0 * half / edge)), int(np.ceil(radius / edge))
        check_count(arcs * bands + 2.0 * np.pi * rings**2)
        parts = [
            _cells(
                [radius, radius], np.linspace(0.0, 2.0 * np.pi, arcs + 1), np.linspace(-half, half, bands + 1)
            )
        ]
        bounds = np.linspace(0.0, radius, rings + 1)
        for inner, outer in pairwise(bounds.tolist()):
            angles = np.linspace(0.0, 2.0 * np.pi, max(6, int(np.ceil(2.0 * np.pi * outer / edge))) + 1)
            parts += [_cells([inner, outer], angles, [z, z]) for z in (-half, half)]
        return np.concatenate(parts)

    def corners(self, cells: Array) -> Array:
        low, high = cells[:, 0:3], cells[:, 3:6]
        tangents = high[:, 0] / np.cos(0.5 * (high[:, 1] - low[:, 1]))
        flat = [
            _polar(low[:, 0], low[:, 1]),
            _polar(low[:, 0], high[:, 1]),
            _polar(high[:, 0], low[:, 1]),
            _polar(high[:, 0], high[:, 1]),
            _polar(tangents, 0.5 * (low[:, 1] + high[:, 1])),
        ]
        return np.stack([np.column_stack([xy, z]) for xy in flat for z in (low[:, 2], high[:, 2])], axis=1)

    def middles(self, cells: Array) -> Array:
        radius, angle, height = 0.5 * (cells[:, 0:3] + cells[:, 3:6]).T
        return np.column_stack([_polar(radius, angle), height])

    def inside(self, cells: Array) -> tuple[Array, Array]:
        radius, angle, height = 0.5 * (cells[:, 0:3] + cells[:, 3:6]).T
        side = cells[:, 2] != cells[:, 5]
        depth = np.where(
            side,
            np.minimum(self._radius, self._half - np.abs(height)),
            np.minimum(self._radius - radius, self._half),
        )
        centres = np.column_stack(
            [
                _polar(np.where(side, radius - depth, radius), angle),
                np.where(side, height, height - depth * np.sign(height)),
            ]
        )
        return centres, depth

    def halves(self, cells: Array) -> Array:
        extents = cells[:, 3:6] - cells[:, 0:3]
        extents[:, 1] *= cells[:, 3]
        axis = np.argmax(extents, axis=1)
        return _halved(cells, axis, axis + 3)


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
        self._nearest = _Nearest(mesh) if self._closed else None

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


class _Nearest:
    """The nearest points of a mesh, by Coal: exact to rounding."""

    def __init__(self, mesh: trimesh.Trimesh) -> None:
        import coal  # here: only a closed mesh needs it, and it takes longer to import than a robot to load

        self._coal, self._model = coal, mesh_model(mesh)
        self._point = coal.Sphere(POINT_RADIUS)
        self._request = coal.DistanceRequest()
        self._at = coal.Transform3s()

    def of(self, points: Array) -> tuple[Array, Array]:
        """Nearest points (N, 3) of the mesh to points (N, 3), and distances (N,)."""
        nearest = np.empty_like(points)
        for index, point in enumerate(points):
            result = self._coal.DistanceResult()
            placed = self._coal.Transform3s(np.eye(3), point)
            self._coal.distance(self._model, self._at, self._point, placed, self._request, result)
            nearest[index] = result.getNearestPoint1()
        return nearest, np.linalg.norm(nearest - points, axis=1)


def _polar(radius: Array, angle: Array) -> Array:
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def _cells(radii: Sequence[float], angles: Array, heights: Array | Sequence[float]) -> Array:
    """Cells between consecutive values."""
    low, high = (
        np.stack(np.meshgrid(*ends, indexing="ij"), axis=-1).reshape(-1, 3)
        for ends in (
            [np.asarray(v)[:-1] for v in (radii, angles, heights)],
            [np.asarray(v)[1:] for v in (radii, angles, heights)],
        )
    )
    return np.hstack([low, high])


def _halved(cells: Array, low: NDArray[np.int64], high: NDArray[np.int64]) -> Array:
    """Cells cut half-way between their columns `low` and `high`."""
    rows = np.arange(len(cells))
    middle = 0.5 * (cells[rows, low] + cells[rows, high])
    first, second = cells.copy(), cells.copy()
    first[rows, high], second[rows, low] = middle, middle
    return np.concatenate([first, second])
