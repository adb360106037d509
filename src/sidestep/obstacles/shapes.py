"""Solid shapes in the world, and points and balls that cover their surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sidestep._core import real_array
from sidestep.obstacles import covering, solid_cover
from sidestep.obstacles.ball_cover import EXCESS, check_excess
from sidestep.robot.pose import about_axis, checked_pose, moved, pose_at

if TYPE_CHECKING:
    import trimesh

    from sidestep.robot.mesh import MeshFile

Points = NDArray[np.float64]
Balls = tuple[NDArray[np.float64], NDArray[np.float64]]

EXTENT = 2.5  # [m] half an edge of the square that the controller sees of a plane: farther than arms reach


class Shape(Protocol):
    """A solid that can be an obstacle: it has a pose, a velocity, triangles, surface samples and covering balls."""

    @property
    def pose(self) -> NDArray[np.float64]:
        """Pose (4, 4) of the shape's frame in the world."""

    @property
    def velocity(self) -> NDArray[np.float64]:
        """Velocity (3,) [m/s] in the world; it does not turn."""

    @property
    def name(self) -> str | None:
        """What messages call it."""

    def sample(self, spacing: float) -> Points:
        """Points (N, 3) [m] on the surface, in the world; every surface point is within `spacing` of one."""

    def balls(self, excess: float = EXCESS) -> Balls:
        """Centres (N, 3) and radii (N,) [m] of balls, in the world, that together hold every point of the surface and
        reach out of the solid by at most `excess` [m]. They need not fill its inside."""

    def mesh(self) -> trimesh.Trimesh:
        """The surface as triangles in the world [m]."""


def is_shape(value: object) -> TypeGuard[Shape]:
    """Whether a value is one of the shapes, or has all that makes one."""
    return all(hasattr(value, name) for name in ("pose", "velocity", "name", "sample", "balls", "mesh"))


@dataclass(frozen=True, eq=False)
class Sphere:
    """A ball around the origin of its frame.

    Args:
        radius: [m].
        pose: pose (4, 4) in the world; only its translation matters.
        velocity: (3,) [m/s] in the world.
        name: what messages call it.

    Raises:
        ValueError: a length is not positive, the pose not rigid, or the velocity not finite; names the value.
    """

    radius: float
    pose: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    velocity: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3), kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        owner = _owner("sphere", self.name)
        _check_lengths(owner, radius=self.radius)
        _set_motion(self, owner)

    @property
    def centre(self) -> Points:
        """Centre (3,) [m] in the world."""
        return self.pose[:3, 3].copy()

    def sample(self, spacing: float) -> Points:
        """Points (N, 3) [m] on the surface, in the world; every surface point is within `spacing` of one."""
        return moved(covering.sphere(self.radius, spacing), self.pose)

    def balls(self, excess: float = EXCESS) -> Balls:
        """The ball itself, exact."""
        check_excess(excess)
        return self.centre[None, :], np.array([self.radius])

    def mesh(self) -> trimesh.Trimesh:
        """Triangles with corners on the sphere: an approximation from inside."""
        import trimesh

        return _placed(trimesh.creation.icosphere(subdivisions=4, radius=self.radius), self.pose)


@dataclass(frozen=True, eq=False)
class Box:
    """A box centred in its frame.

    Args:
        size: edge lengths (3,) along x, y and z [m].
        pose: pose (4, 4) in the world.
        velocity: (3,) [m/s] in the world.
        name: what messages call it.

    Raises:
        ValueError: a length is not positive, the pose not rigid, or the velocity not finite; names the value.
    """

    size: Sequence[float]
    pose: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    velocity: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3), kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        owner = _owner("box", self.name)
        given = real_array(self.size, f"{owner}: size")
        if given.shape != (3,):
            raise ValueError(f"{owner}: size is {self.size}, must be three lengths [m]")
        size = tuple(given.tolist())
        _check_lengths(owner, **dict(zip(("size x", "size y", "size z"), size, strict=True)))
        object.__setattr__(self, "size", size)
        _set_motion(self, owner)

    def sample(self, spacing: float) -> Points:
        """Points (N, 3) [m] on the surface, in the world; every surface point is within `spacing` of one."""
        return moved(covering.box(self.size, spacing), self.pose)

    def balls(self, excess: float = EXCESS) -> Balls:
        """Centres (N, 3) and radii (N,) [m] of balls that hold the surface, see `Shape.balls`."""
        return _moved_balls(_box_balls(tuple(self.size), excess), self.pose)

    def mesh(self) -> trimesh.Trimesh:
        """The surface as triangles in the world [m]."""
        import trimesh

        return _placed(trimesh.creation.box(extents=self.size), self.pose)


@dataclass(frozen=True, eq=False)
class Cylinder:
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

    radius: float
    length: float
    pose: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    velocity: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3), kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        owner = _owner("cylinder", self.name)
        _check_lengths(owner, radius=self.radius, length=self.length)
        _set_motion(self, owner)

    def sample(self, spacing: float) -> Points:
        """Points (N, 3) [m] on the surface, in the world; every surface point is within `spacing` of one."""
        return moved(covering.cylinder(self.radius, self.length, spacing), self.pose)

    def balls(self, excess: float = EXCESS) -> Balls:
        """Centres (N, 3) and radii (N,) [m] of balls that hold the surface, see `Shape.balls`."""
        return _moved_balls(_cylinder_balls(self.radius, self.length, excess), self.pose)

    def mesh(self) -> trimesh.Trimesh:
        """Triangles with corners on the cylinder: an approximation from inside."""
        import trimesh

        cylinder = trimesh.creation.cylinder(radius=self.radius, height=self.length, sections=64)
        return _placed(cylinder, self.pose)


@dataclass(frozen=True, eq=False)
class Capsule:
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

    radius: float
    length: float
    pose: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    velocity: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3), kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        owner = _owner("capsule", self.name)
        _check_lengths(owner, radius=self.radius, length=self.length)
        _set_motion(self, owner)

    def sample(self, spacing: float) -> Points:
        """Points (N, 3) [m] on the surface, in the world; every surface point is within `spacing` of one."""
        return moved(covering.capsule(self.radius, self.length, spacing), self.pose)

    def balls(self, excess: float = EXCESS) -> Balls:
        """A row of balls along the axis."""
        return _moved_balls(solid_cover.capsule_balls(self.radius, self.length, excess), self.pose)

    def mesh(self) -> trimesh.Trimesh:
        """Triangles with corners on the capsule: an approximation from inside."""
        import trimesh

        capsule = trimesh.creation.capsule(height=self.length, radius=self.radius, count=[64, 64])
        capsule.apply_translation([0.0, 0.0, -capsule.bounds.mean(axis=0)[2]])
        return _placed(capsule, self.pose)


@dataclass(frozen=True, eq=False)
class Plane:
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

    point: ArrayLike
    normal: ArrayLike
    around: ArrayLike = field(default=(0.0, 0.0, 0.0), kw_only=True)
    extent: float = field(default=EXTENT, kw_only=True)
    velocity: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3), kw_only=True)
    name: str | None = field(default=None, kw_only=True)
    pose: NDArray[np.float64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        owner = _owner("plane", self.name)
        point, normal = _vector(self.point, f"{owner}: point"), _vector(self.normal, f"{owner}: normal")
        length = float(np.linalg.norm(normal))
        if length == 0.0:
            raise ValueError(f"{owner}: normal is zero, must point out of the solid")
        _check_lengths(owner, extent=self.extent)
        normal = normal / length
        normal.setflags(write=False)
        around = _vector(self.around, f"{owner}: around")
        object.__setattr__(self, "around", around)
        object.__setattr__(self, "point", point)
        object.__setattr__(self, "normal", normal)
        middle = around - ((around - point) @ normal) * normal
        object.__setattr__(self, "pose", pose_at(middle, _turn_of_z(normal)))
        _set_motion(self, owner)

    def sample(self, spacing: float) -> Points:
        """Points of the square."""
        return moved(covering.square(self.extent, spacing), self.pose)

    def balls(self, excess: float = EXCESS) -> Balls:
        """Balls of about the radius `extent` behind the plane; they hold the square."""
        return _moved_balls(_plane_balls(self.extent, excess), self.pose)

    def mesh(self) -> trimesh.Trimesh:
        """The two triangles of the square."""
        import trimesh

        corners = self.extent * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=np.float64)
        return _placed(trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False), self.pose)


@dataclass(frozen=True, eq=False)
class MeshShape:
    """A mesh file.

    Args:
        path: a file that trimesh reads: .stl, .obj, .dae, .ply, .glb …
        scale: factor on the file's coordinates, one or (3,), so that they become metres; below 0 it
            mirrors, as in URDF.
        pose: pose (4, 4) in the world.
        velocity: (3,) [m/s] in the world.
        name: what messages call it.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: the scale is 0 or not finite, the pose not rigid, or the velocity not finite; names the value.
    """

    path: str | Path
    scale: float | Sequence[float] = 1.0
    pose: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    velocity: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3), kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        owner = f"mesh '{self.path}'" if self.name is None else f"mesh {self.name!r}"
        if not Path(self.path).is_file():
            raise FileNotFoundError(f"mesh file '{self.path}' does not exist")
        scale = real_array(self.scale, f"mesh '{self.path}': scale")
        if scale.shape not in ((), (3,)) or not (np.isfinite(scale).all() and (scale != 0.0).all()):
            raise ValueError(f"{owner}: scale is {self.scale}, must be one or three numbers that are not 0")
        _set_motion(self, owner)

    def sample(self, spacing: float) -> Points:
        """Points (N, 3) [m] on the surface, in the world; every surface point is within `spacing` of one."""
        return covering.triangles(self.mesh(), spacing)

    def balls(self, excess: float = EXCESS) -> Balls:
        """Balls inside the solid where the mesh is closed, else on its triangles.

        Large flat faces take a fraction of a second, many small ones may take seconds. The balls of a content are kept
        until the program ends.
        """
        from sidestep.robot.mesh import MeshFile

        x, y, z = np.broadcast_to(np.asarray(self.scale, dtype=np.float64), 3).tolist()
        return _moved_balls(_mesh_balls(MeshFile(Path(self.path)), (x, y, z), excess), self.pose)

    def mesh(self) -> trimesh.Trimesh:
        """The triangles of the file in the world [m].

        Raises:
            ValueError: if the file cannot be read as a mesh, or holds no triangles.
        """
        from sidestep.robot.mesh import MeshFile

        scale = np.broadcast_to(np.asarray(self.scale, dtype=np.float64), 3)
        return _placed(_scaled_mesh(MeshFile(Path(self.path)), scale), self.pose)


# The balls of a solid in its own frame are found once: obstacles are told many times a second.
_box_balls = lru_cache(maxsize=256)(solid_cover.box_balls)
_plane_balls = lru_cache(maxsize=256)(solid_cover.plane_balls)
_cylinder_balls = lru_cache(maxsize=256)(solid_cover.cylinder_balls)


@lru_cache(maxsize=64)  # by content: a MeshFile equals each of the same bytes
def _mesh_balls(file: MeshFile, scale: tuple[float, float, float], excess: float) -> Balls:
    from sidestep.obstacles import mesh_cover

    return mesh_cover.mesh_balls(_scaled_mesh(file, np.array(scale)), excess)


def _scaled_mesh(file: MeshFile, scale: NDArray[np.float64]) -> trimesh.Trimesh:
    mesh = file.triangles().copy()
    mesh.apply_transform(np.diag([*scale, 1.0]))
    return mesh


def _moved_balls(balls: Balls, pose: NDArray[np.float64]) -> Balls:
    centres, radii = balls
    return moved(centres, pose), radii.copy()


def _owner(kind: str, name: str | None) -> str:
    """What an error calls a shape."""
    return kind if name is None else f"{kind} {name!r}"


def _set_motion(shape: Shape, owner: str) -> None:
    """Checks pose and velocity, and keeps copies that cannot be written to."""
    object.__setattr__(shape, "pose", checked_pose(shape.pose, f"{owner}: pose"))
    object.__setattr__(shape, "velocity", _vector(shape.velocity, f"{owner}: velocity"))


def _vector(value: ArrayLike, owner: str) -> NDArray[np.float64]:
    vector = np.array(value, dtype=np.float64)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise ValueError(f"{owner} is {value!r}, must be three finite numbers")
    vector.setflags(write=False)
    return vector


def _turn_of_z(normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """A rotation (3, 3) that turns z into a unit vector (3,)."""
    axis = np.array([-normal[1], normal[0], 0.0])  # z × normal
    sine = float(np.linalg.norm(axis))
    axis = np.array([1.0, 0.0, 0.0]) if sine == 0.0 else axis / sine
    return about_axis(axis, float(np.arctan2(sine, normal[2])))


def _check_lengths(shape: str, **lengths: float) -> None:
    for name, value in lengths.items():
        length = real_array(value, f"{shape}: {name}")
        if length.shape != () or not (np.isfinite(length) and length > 0.0):
            raise ValueError(f"{shape}: {name} is {value}, must be positive and finite [m]")


def _placed(mesh: trimesh.Trimesh, pose: NDArray[np.float64]) -> trimesh.Trimesh:
    mesh.apply_transform(pose)
    return mesh
