"""A box, and the balls that cover it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from sidestep.shapes.ball_cover import cell_size, check_count, cover, halved
from sidestep.shapes.flat_cover import flat_balls
from sidestep.shapes.shape import FINE, Array, Balls, Fineness, Points, Shape, Trimesh, metres
from sidestep.shapes.surface_points import check_spacing, line

SEARCHED = 20_000  # cells of a plate up to which fewer balls are searched for: it takes half a second


@dataclass(frozen=True, eq=False)
class Box(Shape):
    """A box centred in its frame.

    Args:
        size: edge lengths (3,) along x, y and z [m].
        pose: pose (4, 4) in the world.
        velocity: (3,) [m/s] in the world.
        name: what messages call it.

    Raises:
        ValueError: a length is not positive, the pose not rigid, or the velocity not finite; names the value.
    """

    kind: ClassVar[str] = "box"
    mujoco_factors: ClassVar[tuple[float, ...]] = (0.5, 0.5, 0.5)
    coal_class: ClassVar[str | None] = "Box"

    size: Sequence[float] = field(metadata=metres("Full edge lengths [m].", number=3))
    pose: Array = field(default_factory=lambda: np.eye(4))
    velocity: Array = field(default_factory=lambda: np.zeros(3), kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def surface(self, fineness: Fineness = FINE) -> Trimesh:
        """Its twelve triangles."""
        import trimesh

        triangles: Trimesh = trimesh.creation.box(extents=self.size)
        return triangles

    @property
    def extents(self) -> tuple[float, ...]:
        """Its size."""
        return tuple(self.size)

    @property
    def bounding_radius(self) -> float:
        """Half its diagonal."""
        return 0.5 * float(np.linalg.norm(self.size))

    def surface_points(self, spacing: float) -> Points:
        """A grid on each face, with edges and corners."""
        x, y, z = self.size
        check_spacing(spacing, area=2.0 * (x * y + y * z + z * x), length=x + y + z)
        lines = [line(edge, spacing) for edge in self.size]
        faces = []
        for axis in range(3):
            for end in (0, -1):
                face = list(lines)
                face[axis] = lines[axis][[end]]
                faces.append(np.stack(np.meshgrid(*face, indexing="ij"), axis=-1).reshape(-1, 3))
        return np.unique(np.concatenate(faces), axis=0)

    def cover(self, excess: float) -> Balls:
        """Few balls inside.

        Of a large plate that is no thicker than the excess, balls of squares at once: a search for fewer takes seconds
        and spares a sixth of them.
        """
        sides = np.asarray(self.size, dtype=np.float64)
        x, y, z = sides
        cells = 2.0 * (x * y + y * z + z * x) / cell_size(0.5 * float(sides.min()), excess) ** 2
        large = sides.min() <= excess and cells > SEARCHED
        return _plate_balls(0.5 * sides, excess) if large else cover(BoxCells(sides), excess)


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


class BoxCells:
    """Cells are rectangles: low corner (3,), high corner (3,), outward normal (3,)."""

    def __init__(self, size: Array) -> None:
        self._half = 0.5 * size

    def cells(self, excess: float) -> Array:
        edge = cell_size(float(self._half.min()), excess)
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
