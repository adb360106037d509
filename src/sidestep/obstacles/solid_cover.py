"""Balls that cover boxes, cylinders, capsules and squares of planes, see `ball_cover`."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sidestep.obstacles.ball_cover import check_count, check_excess, cover, halved
from sidestep.obstacles.flat_cover import flat_balls

Array = NDArray[np.float64]

SEARCHED = 20_000  # cells of a plate up to which fewer balls are searched for: it takes half a second
OVERHANG = 0.1  # of the excess: what the hull of an arc may stick out of a round surface at first


def box_balls(size: Sequence[float], excess: float) -> tuple[Array, Array]:
    """Centres (N, 3) and radii (N,) [m] of balls that hold the surface of a box (3,) around the origin.

    Of a large plate that is no thicker than the excess, balls of squares at once: a search for fewer takes seconds and
    spares a sixth of them.
    """
    check_excess(excess)
    sides = np.asarray(size, dtype=np.float64)
    x, y, z = sides
    cells = 2.0 * (x * y + y * z + z * x) / _cell_size(0.5 * float(sides.min()), excess) ** 2
    large = sides.min() <= excess and cells > SEARCHED
    return _plate_balls(0.5 * sides, excess) if large else cover(_Box(sides), excess)


def plane_balls(extent: float, excess: float) -> tuple[Array, Array]:
    """Balls that hold the square of half an edge `extent` in the plane z = 0, and reach `excess` above it at most."""
    return cover(_Square(extent), excess)


def cylinder_balls(radius: float, length: float, excess: float) -> tuple[Array, Array]:
    """Balls that hold the surface of a capped cylinder along z, around the origin."""
    return cover(_Cylinder(radius, length), excess)


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


def _plate_balls(half: Array, excess: float) -> tuple[Array, Array]:
    """Of a box with half sides (3,) [m]."""
    signs = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    triangles, inward = [], []
    for axis in range(3):
        for side in (-1.0, 1.0):
            a, b, c, d = half * signs[signs[:, axis] == side]
            triangles += [(a, b, c), (b, c, d)]
            inward += 2 * [-side * np.eye(3)[axis]]

    def fits(centres: Array, radius: float) -> NDArray[np.bool_]:
        return np.asarray((half - np.abs(centres)).min(axis=1) >= radius * (1.0 - 1e-12))

    return flat_balls(np.array(triangles), np.array(inward), fits, excess, float(half.min()))


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
        return halved(cells, axis, axis + 3)


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
        return halved(cells, axis, axis + 3)


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
