"""The solid things around the arm: what the simulator moves and what clearance is measured to."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt
import trimesh

from sidestep._core import Obstacles, real_array
from sidestep.obstacles import Box, Capsule, Cylinder, Plane, Shape, Sphere
from sidestep.obstacles.shapes import is_shape
from sidestep.robot.pose import checked_pose, pose_at

Array = npt.NDArray[np.float64]
Kind = Literal["sphere", "box", "cylinder", "capsule", "plane", "mesh"]
Motion = Literal["fixed", "free", "moving"]

AWAY = 100.0  # [m] below its place (a plane: behind), where waits what is not there: farther than arms reach

_SIZE_MEANING: dict[str, tuple[int, str]] = {
    "sphere": (1, "(radius,)"),
    "box": (3, "the three side lengths"),
    "cylinder": (2, "(radius, length)"),
    "capsule": (2, "(radius, length)"),
    "plane": (1, "(extent,)"),
    "mesh": (0, "(), the mesh has its own size"),
}


@dataclass(frozen=True, eq=False)
class SceneObject:
    """One solid object of the scene, at a pose in the world.

    Args:
        name: unique in a scene; contacts and clearances are reported under it.
        kind: "sphere", "box", "cylinder" (axis: z), "capsule" (a ball rolled along z), "plane" (all below z = 0 is
            solid, see `Plane`) or "mesh".
        size: sphere (radius,), box three side lengths, cylinder (radius, length), capsule (radius, length between the
            centres of its half-balls), plane (extent,) of what is seen and drawn of it, mesh () [m].
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
    kind: Kind
    size: tuple[float, ...] = ()
    pose: Array = field(default_factory=lambda: np.eye(4))
    motion: Motion = "fixed"
    mass: float = 0.1
    velocity: Array = field(default_factory=lambda: np.zeros(3))
    moves_during: tuple[float, float] = (0.0, float("inf"))
    present: tuple[float, float] = (0.0, float("inf"))
    mesh: trimesh.Trimesh | None = None

    def __post_init__(self) -> None:
        if self.kind not in get_args(Kind):
            raise ValueError(
                f"object {self.name!r}: kind is {self.kind!r}, allowed: {', '.join(get_args(Kind))}"
            )
        if self.motion not in get_args(Motion):
            allowed = ", ".join(get_args(Motion))
            raise ValueError(f"object {self.name!r}: motion is {self.motion!r}, allowed: {allowed}")
        size = tuple(float(s) for s in self.size)
        count, meaning = _SIZE_MEANING[self.kind]
        if len(size) != count or not all(np.isfinite(s) and s > 0.0 for s in size):
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
        if self.kind == "plane" and self.motion == "free":
            raise ValueError(f"object {self.name!r}: a plane has no mass, so that it cannot be free")
        if (self.kind == "mesh") != (self.mesh is not None):
            raise ValueError(f"object {self.name!r}: a mesh object needs `mesh`, and only it")
        for name, value in (("size", size), ("pose", pose), ("velocity", velocity)):
            object.__setattr__(self, name, value)

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
        kind: Kind = "mesh"
        size: tuple[float, ...] = ()
        mesh: trimesh.Trimesh | None = None
        if isinstance(shape, Sphere):
            kind, size = "sphere", (shape.radius,)
        elif isinstance(shape, Box):
            kind, size = "box", tuple(shape.size)
        elif isinstance(shape, Cylinder):
            kind, size = "cylinder", (shape.radius, shape.length)
        elif isinstance(shape, Capsule):
            kind, size = "capsule", (shape.radius, shape.length)
        elif isinstance(shape, Plane):
            kind, size = "plane", (shape.extent,)
        else:
            mesh = shape.mesh().copy()
            mesh.apply_transform(np.linalg.inv(shape.pose))
        return cls(
            name,
            kind,
            size=size,
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
                pose[:3, 3] -= AWAY * (pose[:3, 2] if self.kind == "plane" else np.array([0.0, 0.0, 1.0]))
        return pose

    def is_present(self, time: float) -> bool:
        """Whether it is there at `time` [s]."""
        return self.present[0] <= time < self.present[1]

    def surface(self, *, subdivisions: int = 2) -> trimesh.Trimesh:
        """The surface as triangles in the object frame; spheres as an icosphere of `subdivisions`."""
        surface: trimesh.Trimesh
        if self.mesh is not None:
            surface = self.mesh
        elif self.kind == "sphere":
            surface = trimesh.creation.icosphere(subdivisions=subdivisions, radius=self.size[0])
        elif self.kind == "box":
            surface = trimesh.creation.box(extents=self.size)
        elif self.kind == "cylinder":
            surface = trimesh.creation.cylinder(radius=self.size[0], height=self.size[1], sections=24)
        elif self.kind == "capsule":
            surface = Capsule(self.size[0], self.size[1]).mesh()
        else:
            surface = Plane(np.zeros(3), [0.0, 0.0, 1.0], extent=self.size[0]).mesh()
        return surface

    @property
    def bounding_radius(self) -> float:
        """Largest distance [m] of a point of the object from the origin of its frame; infinite for a plane."""
        if self.kind == "sphere":
            return self.size[0]
        if self.kind == "box":
            return 0.5 * float(np.linalg.norm(self.size))
        if self.kind == "cylinder":
            return float(np.hypot(self.size[0], 0.5 * self.size[1]))
        if self.kind == "capsule":
            return self.size[0] + 0.5 * self.size[1]
        if self.kind == "plane":
            return float("inf")
        return float(np.linalg.norm(self.surface().vertices, axis=1).max())


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
