"""What a solid is to the rest of Sidestep: lengths, pose, triangles, points and balls; one file for each kind."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import MISSING, dataclass, fields
from functools import cache, lru_cache
from itertools import islice
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, TypeAlias, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sidestep._core import real_array
from sidestep.math.pose import checked_pose, moved
from sidestep.shapes.ball_cover import EXCESS, check_excess

if TYPE_CHECKING:  # imported where they are used: they take longer to import than a shape to make
    from typing import Self

    import coal
    import trimesh

Array = NDArray[np.float64]
Points = NDArray[np.float64]
Balls = tuple[Array, Array]


@dataclass(frozen=True)
class Fineness:
    """How finely round surfaces become triangles.

    Args:
        subdivisions: of an icosahedron, for a sphere. sections: around a round side. cap_sections: around and along a
            side with round ends.
    """

    subdivisions: int = 4
    sections: int = 64
    cap_sections: int = 64


FINE = Fineness()  # cuts off 0.12 % of a radius
COARSE = Fineness(subdivisions=2, sections=24)  # for pictures


Trimesh: TypeAlias = "trimesh.Trimesh"
KINDS: dict[str, type[Shape]] = {}  # by name, in the order in which files and messages list them


class Length(NamedTuple):
    """A length of a kind of shape, or three of them along x, y and z."""

    name: str
    number: int
    about: str
    default: float | None


def metres(about: str = "", *, number: int = 1) -> dict[str, Any]:
    """Metadata of a dataclass field that is a length [m] > 0, or with `number` 3 those along x, y and z."""
    return {"about": about, "number": number}


class Shape(ABC):
    """A solid at a pose in the world, with a velocity: an obstacle, a part of a link, or a body of a simulation.

    Whoever writes a kind states its lengths as fields and its triangles; the other methods have a general answer,
    which it may replace by an exact one. Triangles and balls depend on lengths alone, unless a kind has none. See the
    guide "Add a kind of shape".

    Attributes:
        kind: what files and messages call it.
        bounded: whether it has an end, so that a ball holds it.
        mujoco_factors: by which MuJoCo multiplies the lengths of its geom of the same name; (): it has none.
        coal_class: name of Coal's solid that is made of the lengths; None: it has none.
        pose: (4, 4) of the shape's frame in the world.
        velocity: (3,) [m/s] in the world; it does not turn.
        name: what messages call it.
    """

    kind: ClassVar[str]
    bounded: ClassVar[bool] = True
    mujoco_factors: ClassVar[tuple[float, ...]] = ()
    coal_class: ClassVar[str | None] = None

    pose: Array  # these are fields of each kind: sizes stand before them
    velocity: Array
    name: str | None

    def __post_init__(self) -> None:
        """Checks the fields, and keeps copies of pose and velocity that cannot be written to."""
        owner = self._owner
        for name, number, _, _ in self.length_fields():
            value = getattr(self, name)
            if number == 1:
                _check_length(value, f"{owner}: {name}")
                continue
            given = real_array(value, f"{owner}: {name}")
            if given.shape != (3,):
                raise ValueError(f"{owner}: {name} is {value}, must be three lengths [m]")
            for axis, entry in zip("xyz", given.tolist(), strict=True):
                _check_length(entry, f"{owner}: {name} {axis}")
            object.__setattr__(self, name, tuple(given.tolist()))
        object.__setattr__(self, "pose", checked_pose(self.pose, f"{owner}: pose"))
        object.__setattr__(self, "velocity", vector(self.velocity, f"{owner}: velocity"))

    def __eq__(self, other: object) -> bool:
        """Whether another is the same kind with the same values."""
        return type(self) is type(other) and all(
            np.array_equal(getattr(self, field.name), getattr(other, field.name))
            for field in fields(self)  # type: ignore[arg-type]
        )

    def __hash__(self) -> int:
        return hash((type(self), self.lengths, self.name))

    @classmethod
    @cache
    def length_fields(cls) -> tuple[Length, ...]:
        """The lengths that make the kind."""
        return tuple(
            Length(
                field.name,
                **field.metadata,
                default=None if field.default is MISSING else float(field.default),
            )
            for field in fields(cls)  # type: ignore[arg-type]
            if field.metadata
        )

    @property
    def lengths(self) -> tuple[float, ...]:
        """Its lengths [m] in a row."""
        row: list[float] = []
        for entry in self.length_fields():
            value = getattr(self, entry.name)
            row += map(float, value if entry.number > 1 else [value])
        return tuple(row)

    @classmethod
    def of_lengths(cls, lengths: Sequence[float]) -> Self:
        """The shape with these lengths [m] in a row, at the origin."""
        left = iter(lengths)
        return cls(
            **{
                name: next(left) if number == 1 else tuple(islice(left, number))
                for name, number, _, _ in cls.length_fields()
            }
        )

    @classmethod
    def of_mujoco(cls, size: Sequence[float]) -> Self:
        """The shape that a geom of MuJoCo with this size (3,) is."""
        return cls.of_lengths([value / k for k, value in zip(cls.mujoco_factors, size, strict=False)])

    @classmethod
    def where_flat(cls, lengths: Sequence[float]) -> Shape | None:
        """The shape that it becomes where some lengths are zero; None: it has no volume then."""
        return None

    def parts(self) -> Iterator[tuple[Shape, Array]]:
        """Shapes that together are this one as a part of a link in an MJCF, with their poses (4, 4) in its frame."""
        yield self, np.eye(4)

    @abstractmethod
    def surface(self, fineness: Fineness = FINE) -> Trimesh:
        """Its triangles in its own frame [m]; of a round surface with corners on it, and inside."""

    @property
    def bulge(self) -> float:
        """How far a round surface may be outside of its triangles [m]."""
        return 0.0

    @property
    def extents(self) -> tuple[float, ...]:
        """The edges (3,) [m] of the box around it in its own frame."""
        return tuple(self.surface().extents.tolist())

    @property
    def bounding_radius(self) -> float:
        """The radius [m] of a ball around the origin of its frame that holds it."""
        return float(np.linalg.norm(self.surface().vertices, axis=1).max()) + self.bulge

    def surface_points(self, spacing: float) -> Points:
        """Points (N, 3) [m] in its own frame; every point of the surface is within `spacing` of one."""
        from sidestep.shapes import surface_points

        return surface_points.triangles(self.surface(), self._beyond_bulge("spacing", spacing))

    def cover(self, excess: float) -> Balls:
        """Balls as of `balls`, in its own frame, by what only this kind knows."""
        from sidestep.shapes import mesh_cover

        centres, radii = mesh_cover.mesh_balls(self.surface(), self._beyond_bulge("excess", excess))
        return centres, radii + self.bulge

    def coal(self) -> coal.CollisionGeometry | None:
        """It as a solid of Coal, in its own frame; None: its triangles stand for it."""
        import coal

        return None if self.coal_class is None else getattr(coal, self.coal_class)(*self.lengths)

    def mujoco_size(self) -> tuple[float, float, float]:
        """The size of its geom in MuJoCo; zeros where that has no such kind, and takes its triangles."""
        given = [k * value for k, value in zip(self.mujoco_factors, self.lengths, strict=False)]
        x, y, z = (*given, 0.0, 0.0, 0.0)[:3]
        return x, y, z

    def sample(self, spacing: float) -> Points:
        """Points (N, 3) [m] on the surface, in the world; every surface point is within `spacing` of one."""
        return moved(self.surface_points(spacing), self.pose)

    def balls(self, excess: float = EXCESS) -> Balls:
        """Centres (N, 3) and radii (N,) [m] of balls, in the world, that together hold every point of the surface and
        reach out of the solid by at most `excess` [m]. They need not fill its inside."""
        check_excess(excess)
        by_lengths = bool(self.length_fields())
        centres, radii = _cover(type(self), self.lengths, excess) if by_lengths else self.cover(excess)
        return moved(centres, self.pose), radii.copy()

    def mesh(self) -> Trimesh:
        """The surface as triangles in the world [m]; of a round one with corners on it, and inside."""
        return self.surface().copy().apply_transform(self.pose)

    def _beyond_bulge(self, name: str, value: float) -> float:
        if value <= self.bulge:
            raise ValueError(
                f"{name} is {value}, must be more than the bulge of a {self.kind}, {self.bulge:.2g} m"
            )
        return value - self.bulge

    @property
    def _owner(self) -> str:
        """What an error calls it."""
        return self.kind if self.name is None else f"{self.kind} {self.name!r}"


@lru_cache(maxsize=512)
def _cover(kind: type[Shape], lengths: tuple[float, ...], excess: float) -> Balls:
    """The balls of a solid in its own frame, found once: obstacles are told many times a second."""
    return kind.of_lengths(lengths).cover(excess)


def register(kind: type[Shape]) -> None:
    """Makes a kind known by its name to scenario files, URDFs, judge and physics."""
    KINDS[kind.kind] = kind


def kind_of(name: str, owner: str) -> type[Shape]:
    """The kind of a name; raises ValueError that lists those known."""
    if name not in KINDS:
        raise ValueError(f"{owner}: kind is {name!r}, allowed: {', '.join(KINDS)}")
    return KINDS[name]


def is_shape(value: object) -> TypeGuard[Shape]:
    """Whether a value is a shape, or has all that makes one an obstacle."""
    return isinstance(value, Shape) or all(
        hasattr(value, name) for name in ("pose", "velocity", "name", "sample", "balls", "mesh")
    )


def vector(value: ArrayLike, owner: str) -> Array:
    """A copy (3,) that cannot be written to; raises ValueError unless it is three finite numbers."""
    checked = np.array(value, dtype=np.float64)
    if checked.shape != (3,) or not np.isfinite(checked).all():
        raise ValueError(f"{owner} is {value!r}, must be three finite numbers")
    checked.setflags(write=False)
    return checked


def _check_length(value: float, owner: str) -> None:
    given = real_array(value, owner)
    if given.shape != () or not (np.isfinite(given) and given > 0.0):
        raise ValueError(f"{owner} is {value}, must be positive and finite [m]")
