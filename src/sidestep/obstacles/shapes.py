"""Solid shapes in the world, and points that cover their surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np
import trimesh
from numpy.typing import NDArray

from sidestep._core import real_array
from sidestep.mesh import read_mesh
from sidestep.obstacles import covering
from sidestep.pose import checked_pose, moved

Points = NDArray[np.float64]


def _identity() -> NDArray[np.float64]:
    return np.eye(4)


class Shape(Protocol):
    """A solid that can be an obstacle: it has a pose, triangles, and surface samples."""

    @property
    def pose(self) -> NDArray[np.float64]:
        """Pose (4, 4) of the shape's frame in the world."""

    def sample(self, spacing: float) -> Points:
        """Points (N, 3) [m] on the surface, in the world; every surface point is within `spacing` of one."""

    def mesh(self) -> trimesh.Trimesh:
        """The surface as triangles in the world [m]."""


@dataclass(frozen=True, eq=False)
class Sphere:
    """A ball around the origin of its frame.

    Args:
        radius: [m].
        pose: pose (4, 4) in the world; only its translation matters.
    """

    radius: float
    pose: NDArray[np.float64] = field(default_factory=_identity)

    def __post_init__(self) -> None:
        _check_lengths("sphere", radius=self.radius)
        object.__setattr__(self, "pose", checked_pose(self.pose, "sphere: pose"))

    @property
    def centre(self) -> Points:
        """Centre (3,) [m] in the world."""
        return self.pose[:3, 3].copy()

    def sample(self, spacing: float) -> Points:
        return moved(covering.sphere(self.radius, spacing), self.pose)

    def mesh(self) -> trimesh.Trimesh:
        """Triangles with corners on the sphere: an approximation from inside."""
        return _placed(trimesh.creation.icosphere(subdivisions=4, radius=self.radius), self.pose)


@dataclass(frozen=True, eq=False)
class Box:
    """A box centred in its frame.

    Args:
        size: edge lengths (3,) along x, y and z [m].
        pose: pose (4, 4) in the world.
    """

    size: Sequence[float]
    pose: NDArray[np.float64] = field(default_factory=_identity)

    def __post_init__(self) -> None:
        size = tuple(float(length) for length in self.size)
        if len(size) != 3:
            raise ValueError(f"box: size has {len(size)} lengths, expected 3")
        _check_lengths("box", **dict(zip(("size x", "size y", "size z"), size, strict=True)))
        object.__setattr__(self, "size", size)
        object.__setattr__(self, "pose", checked_pose(self.pose, "box: pose"))

    def sample(self, spacing: float) -> Points:
        return moved(covering.box(self.size, spacing), self.pose)

    def mesh(self) -> trimesh.Trimesh:
        return _placed(trimesh.creation.box(extents=self.size), self.pose)


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A cylinder with flat caps, its axis along z, centred in its frame.

    Args:
        radius: [m].
        length: along the axis [m].
        pose: pose (4, 4) in the world.
    """

    radius: float
    length: float
    pose: NDArray[np.float64] = field(default_factory=_identity)

    def __post_init__(self) -> None:
        _check_lengths("cylinder", radius=self.radius, length=self.length)
        object.__setattr__(self, "pose", checked_pose(self.pose, "cylinder: pose"))

    def sample(self, spacing: float) -> Points:
        return moved(covering.cylinder(self.radius, self.length, spacing), self.pose)

    def mesh(self) -> trimesh.Trimesh:
        """Triangles with corners on the cylinder: an approximation from inside."""
        cylinder = trimesh.creation.cylinder(radius=self.radius, height=self.length, sections=64)
        return _placed(cylinder, self.pose)


@dataclass(frozen=True, eq=False)
class MeshShape:
    """A mesh file.

    Args:
        path: a file that trimesh reads: .stl, .obj, .dae, .ply, .glb …
        scale: factor on the file's coordinates, one or (3,), so that they become metres.
        pose: pose (4, 4) in the world.
    """

    path: str | Path
    scale: float | Sequence[float] = 1.0
    pose: NDArray[np.float64] = field(default_factory=_identity)

    def __post_init__(self) -> None:
        if not Path(self.path).is_file():
            raise FileNotFoundError(f"mesh file '{self.path}' does not exist")
        scale = real_array(self.scale, f"mesh '{self.path}': scale")
        if scale.shape not in ((), (3,)) or not (np.isfinite(scale).all() and (scale > 0.0).all()):
            raise ValueError(
                f"mesh '{self.path}': scale is {self.scale}, must be one or three positive numbers"
            )
        object.__setattr__(self, "pose", checked_pose(self.pose, f"mesh '{self.path}': pose"))

    def sample(self, spacing: float) -> Points:
        return covering.triangles(self.mesh(), spacing)

    def mesh(self) -> trimesh.Trimesh:
        """The triangles of the file in the world [m].

        Raises:
            ValueError: if the file cannot be read as a mesh, or holds no triangles.
        """
        mesh = read_mesh(Path(self.path))
        mesh.apply_transform(np.diag([*np.broadcast_to(np.asarray(self.scale, dtype=np.float64), 3), 1.0]))
        return _placed(mesh, self.pose)


def _check_lengths(shape: str, **lengths: float) -> None:
    for name, value in lengths.items():
        if not (np.isfinite(value) and value > 0.0):
            raise ValueError(f"{shape}: {name} is {value}, must be positive and finite [m]")


def _placed(mesh: trimesh.Trimesh, pose: NDArray[np.float64]) -> trimesh.Trimesh:
    mesh.apply_transform(pose)
    return mesh
