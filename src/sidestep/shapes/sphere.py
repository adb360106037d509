"""A ball."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from sidestep.shapes.shape import FINE, Array, Balls, Fineness, Points, Shape, Trimesh, metres
from sidestep.shapes.surface_points import check_spacing, ring, ring_size, rings

CUT_OFF = 0.0012  # of the radius, by the largest triangle of an icosahedron that is subdivided as `FINE` says


@dataclass(frozen=True, eq=False)
class Sphere(Shape):
    """A ball around the origin of its frame.

    Args:
        radius: [m].
        pose: pose (4, 4) in the world; only its translation matters.
        velocity: (3,) [m/s] in the world.
        name: what messages call it.

    Raises:
        ValueError: a length is not positive, the pose not rigid, or the velocity not finite; names the value.
    """

    kind: ClassVar[str] = "sphere"
    mujoco_factors: ClassVar[tuple[float, ...]] = (1.0,)
    coal_class: ClassVar[str | None] = "Sphere"

    radius: float = field(metadata=metres())
    pose: Array = field(default_factory=lambda: np.eye(4))
    velocity: Array = field(default_factory=lambda: np.zeros(3), kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    @property
    def centre(self) -> Points:
        """Centre (3,) [m] in the world."""
        return self.pose[:3, 3].copy()

    def surface(self, fineness: Fineness = FINE) -> Trimesh:
        """A subdivided icosahedron."""
        import trimesh

        triangles: Trimesh = trimesh.creation.icosphere(
            subdivisions=fineness.subdivisions, radius=self.radius
        )
        return triangles

    @property
    def bulge(self) -> float:
        """More than the largest triangle cuts off."""
        return CUT_OFF * self.radius

    @property
    def extents(self) -> tuple[float, ...]:
        """Its diameter thrice."""
        return (2.0 * self.radius,) * 3

    @property
    def bounding_radius(self) -> float:
        """Its radius."""
        return self.radius

    def surface_points(self, spacing: float) -> Points:
        """Rings from pole to pole."""
        check_spacing(spacing, area=4.0 * np.pi * self.radius * self.radius)
        circles = []
        for polar in np.linspace(0.0, np.pi, max(2, rings(np.pi * self.radius, spacing)) + 1):
            r = self.radius * np.sin(polar) if 0.0 < polar < np.pi else 0.0
            circle = ring(r, ring_size(r, spacing))
            circles.append(np.column_stack([circle, np.full(len(circle), self.radius * np.cos(polar))]))
        return np.concatenate(circles)

    def cover(self, excess: float) -> Balls:
        """The ball itself, exact."""
        return np.zeros((1, 3)), np.array([self.radius])
