"""A half-space behind a plane, and the balls that cover a square of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sidestep.math.pose import about_axis, pose_at
from sidestep.shapes.ball_cover import cell_size, check_count, cover
from sidestep.shapes.box import BoxCells
from sidestep.shapes.shape import FINE, Array, Balls, Fineness, Points, Shape, Trimesh, metres, vector
from sidestep.shapes.surface_points import check_spacing, line

if TYPE_CHECKING:
    import coal

EXTENT = 2.5  # [m] half an edge of the square that the controller sees of a plane: farther than arms reach


@dataclass(frozen=True, eq=False)
class Plane(Shape):
    """A floor, a wall or a ceiling: everything behind the plane is solid.

    Simulation and judge take the whole half-space. An arm reaches only so far: the controller sees balls behind a
    square of the plane with edges of 2 `extent`, centred where the plane is nearest to `around`. It must hold all that
    the arm can reach; beyond the square the controller sees nothing.

    Args:
        point: (3,) [m] on the plane, in the world.
        normal: (3,) of any length, in the world; points out of the solid, to where the arm is.
        around: (3,) [m] in the world, what the square is nearest to: the base of the arm.
        extent: [m] from the middle of the square to its edges; at least the reach of the arm.
        velocity: (3,) [m/s] in the world.
        name: what messages call it.

    Raises:
        ValueError: a value is not finite, the normal is zero or the extent not positive; names the value.
    """

    kind: ClassVar[str] = "plane"
    bounded: ClassVar[bool] = False
    mujoco_factors: ClassVar[tuple[float, ...]] = (1.0,)
    coal_class: ClassVar[str | None] = "Halfspace"

    point: ArrayLike
    normal: ArrayLike
    around: ArrayLike = field(default=(0.0, 0.0, 0.0), kw_only=True)
    extent: float = field(
        default=EXTENT,
        kw_only=True,
        metadata=metres(
            "Solid below z = 0 of its frame, which rotation_deg turns. From position to the edges of the square that "
            "stands for the plane [m]; 2.5 when left out."
        ),
    )
    velocity: Array = field(default_factory=lambda: np.zeros(3), kw_only=True)
    name: str | None = field(default=None, kw_only=True)
    pose: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        owner = self._owner
        point, normal = vector(self.point, f"{owner}: point"), vector(self.normal, f"{owner}: normal")
        size = float(np.linalg.norm(normal))
        if size == 0.0:
            raise ValueError(f"{owner}: normal is zero, must point out of the solid")
        normal = normal / size
        normal.setflags(write=False)
        around = vector(self.around, f"{owner}: around")
        middle = around - ((around - point) @ normal) * normal
        pose = pose_at(middle, _turn_of_z(normal))
        for name, value in (("point", point), ("normal", normal), ("around", around), ("pose", pose)):
            object.__setattr__(self, name, value)
        super().__post_init__()

    @classmethod
    def of_lengths(cls, lengths: Sequence[float]) -> Plane:
        """The plane z = 0."""
        (extent,) = lengths
        return cls(np.zeros(3), [0.0, 0.0, 1.0], extent=extent)

    def surface(self, fineness: Fineness = FINE) -> Trimesh:
        """The two triangles of the square."""
        import trimesh

        corners = self.extent * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=np.float64)
        return trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)

    @property
    def bounding_radius(self) -> float:
        """No ball holds it."""
        return float("inf")

    def surface_points(self, spacing: float) -> Points:
        """A grid on the square."""
        check_spacing(spacing, area=4.0 * self.extent**2)
        nodes = line(2.0 * self.extent, spacing)
        flat = np.stack(np.meshgrid(nodes, nodes, indexing="ij"), axis=-1).reshape(-1, 2)
        return np.column_stack([flat, np.zeros(len(flat))])

    def cover(self, excess: float) -> Balls:
        """Balls of about the radius `extent` behind the plane; they hold the square."""
        return cover(_Square(self.extent), excess)

    def coal(self) -> coal.CollisionGeometry:
        """A half-space."""
        import coal

        return coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)

    def mujoco_size(self) -> tuple[float, float, float]:
        """Of the drawing alone."""
        return (self.extent,) * 3


def _turn_of_z(normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """A rotation (3, 3) that turns z into a unit vector (3,)."""
    axis = np.array([-normal[1], normal[0], 0.0])  # z × normal
    sine = float(np.linalg.norm(axis))
    axis = np.array([1.0, 0.0, 0.0]) if sine == 0.0 else axis / sine
    return about_axis(axis, float(np.arctan2(sine, normal[2])))


class _Square(BoxCells):
    """The top face of a cube below z = 0; what is beside the square is solid as well."""

    def __init__(self, extent: float) -> None:
        super().__init__(np.full(3, 2.0 * extent))
        self._extent = extent

    def cells(self, excess: float) -> Array:
        count = int(np.ceil(2.0 * self._extent / cell_size(self._extent, excess)))
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
