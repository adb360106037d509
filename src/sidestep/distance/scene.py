"""The solid things around the arm: what the simulator moves and what clearance is measured to."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt
import trimesh

from sidestep._core import Obstacles, real_array
from sidestep.math.pose import checked_pose, pose_at
from sidestep.shapes import KINDS, Fineness, Shape, Triangles, is_shape, kind_of

Array = npt.NDArray[np.float64]
Motion = Literal["fixed", "free", "moving"]

PICTURE = Fineness(subdivisions=2, sections=24)  # of a surface that is drawn
AWAY = 100.0  # [m] below its place (a plane: behind), where waits what is not there: farther than arms reach


@dataclass(frozen=True, eq=False)
class SceneObject:
    """One solid object of the scene, at a pose in the world.

    Args:
        name: unique in a scene; contacts and clearances are reported under it.
        kind: "mesh", or that of a shape: "box", "plane" (all below z = 0 is solid), …
        size: lengths of the shape [m] in the order of its class: of a `Box` three, of a `Cylinder` (radius, length),
            of a `Plane` (extent,) of what is seen and drawn of it, …; mesh ().
        pose: (4, 4) pose of the object frame in the world at time 0.
        motion: "fixed"; "free" (a rigid body of `mass` that floats until something touches it); or
            "moving" (driven with `velocity` whatever it meets).
        mass: [kg], used when free.
        velocity: (3,) [m/s], used when moving.
        moves_during: (from, until) [s] in which a moving object moves; it rests before and after.
        present: (from, until) [s] in which a moving object is there; else it waits far below everything.
        mesh: the surface in the object frame, for kind "mesh".

    Raises:
        ValueError: a value is not finite, not positive or has the wrong shape.
    """

    name: str
    kind: str
    size: tuple[float, ...] = ()
    pose: Array = field(default_factory=lambda: np.eye(4))
    motion: Motion = "fixed"
    mass: float = 0.1
    velocity: Array = field(default_factory=lambda: np.zeros(3))
    moves_during: tuple[float, float] = (0.0, float("inf"))
    present: tuple[float, float] = (0.0, float("inf"))
    mesh: trimesh.Trimesh | None = None

    def __post_init__(self) -> None:
        kind = kind_of(self.kind, f"object {self.name!r}")
        if self.motion not in get_args(Motion):
            allowed = ", ".join(get_args(Motion))
            raise ValueError(f"object {self.name!r}: motion is {self.motion!r}, allowed: {allowed}")
        size = tuple(float(s) for s in self.size)
        number, meaning = _size_of(kind)
        if len(size) != number or not all(np.isfinite(s) and s > 0.0 for s in size):
            raise ValueError(
                f"object {self.name!r}: size of a {self.kind} is {meaning}, positive, got {self.size}"
            )
        pose = checked_pose(self.pose, f"object {self.name!r}: pose")
        velocity = real_array(self.velocity, f"{self.name}: velocity").copy()
        if velocity.shape != (3,) or not np.all(np.isfinite(velocity)):
            raise ValueError(f"object {self.name!r}: velocity must be (3,), finite, got {self.velocity}")
        if not (np.isfinite(self.mass) and self.mass > 0.0):
            raise ValueError(f"object {self.name!r}: mass must be positive, got {self.mass}")
        if not 0.0 <= self.moves_during[0] <= self.moves_during[1]:
            raise ValueError(
                f"object {self.name!r}: moves_during must be 0 <= from <= until, got {self.moves_during}"
            )
        if not 0.0 <= self.present[0] <= self.present[1]:
            raise ValueError(f"object {self.name!r}: present must be 0 <= from <= until, got {self.present}")
        if self.motion != "moving" and self.present != (0.0, float("inf")):
            raise ValueError(f"object {self.name!r}: only a moving object can come and go")
        if not kind.bounded and self.motion == "free":
            raise ValueError(f"object {self.name!r}: a {self.kind} has no mass, so that it cannot be free")
        if (self.kind == Triangles.kind) != (self.mesh is not None):
            raise ValueError(f"object {self.name!r}: a mesh object needs `mesh`, and only it")
        for name, value in (("size", size), ("pose", pose), ("velocity", velocity)):
            object.__setattr__(self, name, value)

    @cached_property
    def shape(self) -> Shape:
        """The solid in the object frame."""
        return KINDS[self.kind].of_lengths(self.size) if self.mesh is None else Triangles(self.mesh)

    @classmethod
    def ball(
        cls,
        name: str,
        center: Sequence[float] | Array,
        *,
        radius: float,
        motion: Motion = "fixed",
        mass: float = 0.1,
        velocity: Sequence[float] = (0.0, 0.0, 0.0),
        moves_during: tuple[float, float] = (0.0, float("inf")),
        present: tuple[float, float] = (0.0, float("inf")),
    ) -> SceneObject:
        """A sphere at `center` (3,) [m] in the world."""
        return cls(
            name,
            "sphere",
            size=(radius,),
            pose=pose_at(center),
            motion=motion,
            mass=mass,
            velocity=real_array(velocity, f"{name}: velocity"),
            moves_during=moves_during,
            present=present,
        )

    @classmethod
    def from_shape(
        cls,
        name: str,
        shape: Shape,
        *,
        motion: Motion | None = None,
        mass: float = 0.1,
        velocity: Sequence[float] | Array | None = None,
        moves_during: tuple[float, float] = (0.0, float("inf")),
    ) -> SceneObject:
        """The solid of an obstacle shape; every shape stays exact, a plane a half-space.

        Args:
            name: of the object; the shape may have another.
            shape: what the controller is told of as well.
            motion: None: "moving" where there is a velocity, else "fixed".
            mass: [kg], used when free.
            velocity: (3,) [m/s]; None: the shape's own.
            moves_during: (from, until) [s] in which a moving object moves.
        """
        velocity = np.asarray(shape.velocity if velocity is None else velocity, dtype=float)
        mesh = None
        kind = shape.kind if isinstance(shape, Shape) else Triangles.kind
        if kind == Triangles.kind:
            mesh = shape.mesh().copy()
            mesh.apply_transform(np.linalg.inv(shape.pose))
        return cls(
            name,
            kind,
            size=() if mesh is not None else shape.lengths,
            pose=shape.pose,
            motion=motion or ("moving" if np.any(velocity != 0.0) else "fixed"),
            mass=mass,
            velocity=velocity,
            moves_during=moves_during,
            mesh=mesh,
        )

    @classmethod
    def balls(
        cls,
        obstacles: Obstacles,
        *,
        radius: float | None = None,
        motion: Motion | None = None,
        mass: float = 0.1,
    ) -> tuple[SceneObject, ...]:
        """One ball per obstacle point, named obstacle_0, obstacle_1, …

        Args:
            obstacles: the points the controller sees.
            radius: [m] of every ball; None takes each point's own, which must then be positive.
            motion: None: "moving" where the point has a velocity, else "fixed".
            mass: [kg].
        """
        radii = obstacles.radii if radius is None else np.full(len(obstacles), radius)
        return tuple(
            cls.ball(
                f"obstacle_{i}",
                point,
                radius=float(r),
                motion=motion or ("moving" if np.any(s != 0.0) else "fixed"),
                mass=mass,
                velocity=s,
            )
            for i, (point, r, s) in enumerate(zip(obstacles.points, radii, obstacles.velocities, strict=True))
        )

    def pose_at(self, time: float) -> Array:
        """Pose (4, 4) in the world at `time` [s] of an object that nothing has touched."""
        pose = self.pose.copy()
        if self.motion == "moving":
            start, end = self.moves_during
            pose[:3, 3] += self.velocity * max(0.0, min(time, end) - start)
            if not self.is_present(time):
                pose[:3, 3] -= AWAY * (np.array([0.0, 0.0, 1.0]) if self.shape.bounded else pose[:3, 2])
        return pose

    def is_present(self, time: float) -> bool:
        """Whether it is there at `time` [s]."""
        return self.present[0] <= time < self.present[1]

    def surface(self, *, subdivisions: int = 2) -> trimesh.Trimesh:
        """The surface as triangles in the object frame; spheres as an icosphere of `subdivisions`."""
        return self.shape.surface(replace(PICTURE, subdivisions=subdivisions))

    @property
    def bounding_radius(self) -> float:
        """The radius [m] of a ball around the origin of its frame that holds it."""
        return self.shape.bounding_radius


def _size_of(kind: type[Shape]) -> tuple[int, str]:
    """How many lengths a kind has, and their names."""
    given = kind.length_fields()
    if not given:
        return 0, "(), the mesh has its own size"
    names = ", ".join(entry.name for entry in given) + ("," if len(given) == 1 else "")
    number = sum(entry.number for entry in given)
    return number, "the three side lengths" if (len(given), number) == (1, 3) else f"({names})"


Item: TypeAlias = SceneObject | Shape | Obstacles
Scene: TypeAlias = Item | Iterable[Item]


def check_scene(objects: Scene) -> tuple[SceneObject, ...]:
    """The solids of what a controller sees, and others.

    Args:
        objects: solids; shapes, which are called by their names, or "obstacle0", "obstacle1", … by their place; and
            `Obstacles`, a ball for each point, called "NAME.0", "NAME.1", ….

    Raises:
        ValueError: two share a name, or a point has no radius.
        TypeError: an item is none of these.
    """
    items: list[Item] = [objects] if _is_item(objects) else list(objects)  # type: ignore[list-item, arg-type]
    scene = tuple(solid for index, item in enumerate(items) for solid in _solids(item, f"obstacle{index}"))
    seen: set[str] = set()
    for item in scene:
        if item.name in seen:
            raise ValueError(f"two objects of the scene are named {item.name!r}; names must differ")
        seen.add(item.name)
    return scene


def _is_item(value: object) -> bool:
    return isinstance(value, SceneObject | Obstacles) or is_shape(value)


def _solids(item: Item, unnamed: str) -> tuple[SceneObject, ...]:
    if isinstance(item, SceneObject):
        return (item,)
    if isinstance(item, Obstacles):
        if not (item.radii > 0.0).all():
            raise ValueError(
                f"{unnamed}: point {int(np.argmin(item.radii))} has no radius; a solid needs one, see SceneObject.balls"
            )
        return tuple(
            replace(ball, name=f"{item.name_of(k) or unnamed}.{k}")
            for k, ball in enumerate(SceneObject.balls(item))
        )
    if not is_shape(item):
        raise TypeError(
            f"{unnamed} is of type {type(item).__name__}, must be a SceneObject, a shape or Obstacles"
        )
    return (SceneObject.from_shape(item.name or unnamed, item),)


def seen_obstacles(
    objects: Iterable[SceneObject], time: float, *, point_radius: float | None = None
) -> Obstacles:
    """What a perfect camera reports of the balls of a scene at a time: centres, radii and velocities.

    Only scripted motion is followed: a free ball is reported where it started.

    Args:
        objects: balls only.
        time: [s].
        point_radius: [m] given to every point; None: each ball's own radius.

    Raises:
        ValueError: an object is not a sphere.
    """
    points, radii, velocities = [], [], []
    for item in objects:
        if item.kind != "sphere":
            raise ValueError(f"object {item.name!r} is a {item.kind}; only spheres are reported as points")
        moves = item.motion == "moving" and item.moves_during[0] <= time < item.moves_during[1]
        points.append(item.pose_at(time)[:3, 3])
        radii.append(item.size[0] if point_radius is None else point_radius)
        velocities.append(item.velocity if moves else np.zeros(3))
    return Obstacles(np.array(points), np.array(radii), np.array(velocities)) if points else Obstacles.none()
