"""A capsule, and the balls that cover it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from sidestep.math.pose import pose_at
from sidestep.shapes.ball_cover import check_count
from sidestep.shapes.cylinder import Cylinder
from sidestep.shapes.shape import FINE, Array, Balls, Fineness, Points, Shape, Trimesh, metres
from sidestep.shapes.sphere import Sphere
from sidestep.shapes.surface_points import around, check_spacing, line, ring


@dataclass(frozen=True, eq=False)
class Capsule(Shape):
    """All points within `radius` of a segment along z, centred in its frame.

    Args:
        radius: [m].
        length: of the segment [m]: between the centres of the half-balls at the ends.
        pose: pose (4, 4) in the world.
        velocity: (3,) [m/s] in the world.
        name: what messages call it.

    Raises:
        ValueError: a length is not positive, the pose not rigid, or the velocity not finite; names the value.
    """

    kind: ClassVar[str] = "capsule"
    mujoco_factors: ClassVar[tuple[float, ...]] = (1.0, 0.5)
    coal_class: ClassVar[str | None] = "Capsule"

    radius: float = field(metadata=metres())
    length: float = field(metadata=metres("Between the centres of the half-balls at its ends, along z [m]."))
    pose: Array = field(default_factory=lambda: np.eye(4))
    velocity: Array = field(default_factory=lambda: np.zeros(3), kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    @classmethod
    def where_flat(cls, lengths: Sequence[float]) -> Shape | None:
        """Without a segment it is a ball."""
        radius, _ = lengths
        return Sphere(radius) if radius > 0.0 else None

    def parts(self) -> Iterator[tuple[Shape, Array]]:
        """A cylinder with a ball at each end."""
        yield Cylinder(self.radius, self.length), np.eye(4)
        for side in (-1.0, 1.0):
            yield Sphere(self.radius), pose_at([0.0, 0.0, side * (0.5 * self.length)])

    def surface(self, fineness: Fineness = FINE) -> Trimesh:
        """Bands between rings."""
        import trimesh

        count = 2 * [fineness.cap_sections]
        triangles: Trimesh = trimesh.creation.capsule(radius=self.radius, height=self.length, count=count)
        return triangles

    @property
    def bulge(self) -> float:
        """More than an arc is outside of its chord, along and across."""
        return float(self.radius * (1.0 - np.cos(np.pi / FINE.cap_sections) ** 2))

    @property
    def extents(self) -> tuple[float, ...]:
        """Its diameter twice, and its whole length."""
        width = 2.0 * self.radius
        return width, width, self.length + width

    @property
    def bounding_radius(self) -> float:
        """To the ends."""
        return self.radius + 0.5 * self.length

    def surface_points(self, spacing: float) -> Points:
        """Rings on the side, and half of those of a ball at each end."""
        check_spacing(spacing, area=2.0 * np.pi * self.radius * (2.0 * self.radius + self.length))
        number = around(self.radius, spacing)
        rim = ring(self.radius, number)
        side = np.concatenate(
            [np.column_stack([rim, np.full(number, z)]) for z in line(self.length, spacing)]
        )
        ball = Sphere(self.radius).surface_points(spacing)  # the rim of the side closes a half of it
        shift = np.array([0.0, 0.0, 0.5 * self.length])
        return np.concatenate([side, ball[ball[:, 2] > 0.0] + shift, ball[ball[:, 2] < 0.0] - shift])

    def cover(self, excess: float) -> Balls:
        """A row of balls along the axis.

        Balls of radius R = radius + excess at a distance 2 sqrt(R^2 - radius^2) meet on the surface.
        """
        apart = 2.0 * np.sqrt(excess * (2.0 * self.radius + excess))
        count = int(np.ceil(self.length / apart))
        check_count(count)
        middles = (np.arange(count) + 0.5) / count - 0.5
        heights = np.concatenate([[-0.5 * self.length], middles * self.length, [0.5 * self.length]])
        centres = np.column_stack([np.zeros((count + 2, 2)), heights])
        radii = np.full(count + 2, self.radius + excess)
        radii[[0, -1]] = self.radius  # exact half-balls at the ends
        return centres, radii
