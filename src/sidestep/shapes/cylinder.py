"""A cylinder, and the balls that cover it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import ClassVar

import numpy as np

from sidestep.shapes.ball_cover import cell_size, check_count, cover, halved
from sidestep.shapes.shape import FINE, Array, Balls, Fineness, Points, Shape, Trimesh, metres
from sidestep.shapes.surface_points import around, check_spacing, line, ring, ring_size, rings

OVERHANG = 0.1  # of the excess: what the hull of an arc may stick out of a round surface at first


@dataclass(frozen=True, eq=False)
class Cylinder(Shape):
    """A cylinder with flat caps, its axis along z, centred in its frame.

    Args:
        radius: [m].
        length: along the axis [m].
        pose: pose (4, 4) in the world.
        velocity: (3,) [m/s] in the world.
        name: what messages call it.

    Raises:
        ValueError: a length is not positive, the pose not rigid, or the velocity not finite; names the value.
    """

    kind: ClassVar[str] = "cylinder"
    mujoco_factors: ClassVar[tuple[float, ...]] = (1.0, 0.5)
    coal_class: ClassVar[str | None] = "Cylinder"

    radius: float = field(metadata=metres())
    length: float = field(metadata=metres())
    pose: Array = field(default_factory=lambda: np.eye(4))
    velocity: Array = field(default_factory=lambda: np.zeros(3), kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def surface(self, fineness: Fineness = FINE) -> Trimesh:
        """A prism."""
        import trimesh

        triangles: Trimesh = trimesh.creation.cylinder(
            radius=self.radius, height=self.length, sections=fineness.sections
        )
        return triangles

    @property
    def bulge(self) -> float:
        """More than an arc is outside of its chord."""
        return float(self.radius * (1.0 - np.cos(np.pi / FINE.sections) ** 2))

    @property
    def extents(self) -> tuple[float, ...]:
        """Its diameter twice, and its length."""
        return 2.0 * self.radius, 2.0 * self.radius, self.length

    @property
    def bounding_radius(self) -> float:
        """To a rim."""
        return float(np.hypot(self.radius, 0.5 * self.length))

    def surface_points(self, spacing: float) -> Points:
        """Rings on the side and on the caps."""
        radius = self.radius
        check_spacing(spacing, area=2.0 * np.pi * radius * (radius + self.length), length=self.length)
        number = around(radius, spacing)
        rim = ring(radius, number)
        heights = line(self.length, spacing)
        side = np.concatenate([np.column_stack([rim, np.full(number, z)]) for z in heights])
        radii = np.linspace(0.0, radius, rings(radius, spacing) + 1)
        flat = np.concatenate([ring(r, ring_size(r, spacing)) for r in radii])
        caps = [np.column_stack([flat, np.full(len(flat), z)]) for z in (heights[0], heights[-1])]
        return np.concatenate([side, *caps])

    def cover(self, excess: float) -> Balls:
        """Few balls inside."""
        return cover(_Cells(self.radius, self.length), excess)


class _Cells:
    """Cells are parts of the side or of a cap: low (radius, angle, height), high (radius, angle, height)."""

    def __init__(self, radius: float, length: float) -> None:
        self._radius, self._half = radius, 0.5 * length

    def cells(self, excess: float) -> Array:
        radius, half = self._radius, self._half
        edge = cell_size(min(radius, half), excess)
        # the corner that two tangents to an arc make is radius / cos(angle / 2) from the axis
        arcs = max(6, int(np.ceil(np.pi / np.arccos(radius / (radius + OVERHANG * excess)))))
        bands, rings = int(np.ceil(2.0 * half / edge)), int(np.ceil(radius / edge))
        check_count(arcs * bands + 2.0 * np.pi * rings**2)
        parts = [
            _between(
                [radius, radius], np.linspace(0.0, 2.0 * np.pi, arcs + 1), np.linspace(-half, half, bands + 1)
            )
        ]
        bounds = np.linspace(0.0, radius, rings + 1)
        for inner, outer in pairwise(bounds.tolist()):
            angles = np.linspace(0.0, 2.0 * np.pi, max(6, int(np.ceil(2.0 * np.pi * outer / edge))) + 1)
            parts += [_between([inner, outer], angles, [z, z]) for z in (-half, half)]
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


def _between(radii: Sequence[float], angles: Array, heights: Array | Sequence[float]) -> Array:
    """Cells between consecutive values."""
    low, high = (
        np.stack(np.meshgrid(*ends, indexing="ij"), axis=-1).reshape(-1, 3)
        for ends in (
            [np.asarray(v)[:-1] for v in (radii, angles, heights)],
            [np.asarray(v)[1:] for v in (radii, angles, heights)],
        )
    )
    return np.hstack([low, high])
