"""Solids that are triangles: of a mesh file, or as they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import ClassVar

import numpy as np

from sidestep._core import real_array
from sidestep.shapes.mesh_reader import MeshFile
from sidestep.shapes.shape import FINE, Array, Balls, Fineness, Points, Shape, Trimesh


@dataclass(frozen=True, eq=False)
class Triangles(Shape):
    """Triangles (a mesh of `trimesh`) in its frame [m]; solid where they are closed."""

    kind: ClassVar[str] = "mesh"

    triangles: Trimesh
    pose: Array = field(default_factory=lambda: np.eye(4))
    velocity: Array = field(default_factory=lambda: np.zeros(3), kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def surface(self, fineness: Fineness = FINE) -> Trimesh:
        """The triangles; copy them before you change them."""
        return self.triangles


@dataclass(frozen=True, eq=False)
class MeshShape(Shape):
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

    kind: ClassVar[str] = "mesh"

    path: str | Path
    scale: float | Sequence[float] = 1.0
    pose: Array = field(default_factory=lambda: np.eye(4))
    velocity: Array = field(default_factory=lambda: np.zeros(3), kw_only=True)
    name: str | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        if not Path(self.path).is_file():
            raise FileNotFoundError(f"mesh file '{self.path}' does not exist")
        scale = real_array(self.scale, f"mesh '{self.path}': scale")
        if scale.shape not in ((), (3,)) or not (np.isfinite(scale).all() and (scale != 0.0).all()):
            raise ValueError(
                f"{self._owner}: scale is {self.scale}, must be one or three numbers that are not 0"
            )
        super().__post_init__()

    def surface(self, fineness: Fineness = FINE) -> Trimesh:
        """The triangles of the file, scaled.

        Raises:
            ValueError: if the file cannot be read as a mesh, or holds no triangles.
        """
        return _scaled(MeshFile(Path(self.path)), self._factors)

    def sample(self, spacing: float) -> Points:
        """Points (N, 3) [m] on the surface, in the world; every surface point is within `spacing` of one."""
        from sidestep.shapes import surface_points

        return surface_points.triangles(self.mesh(), spacing)

    def cover(self, excess: float) -> Balls:
        """Balls inside the solid where the mesh is closed, else on its triangles.

        Large flat faces take a fraction of a second, many small ones may take seconds. The balls of a content are kept
        until the program ends.
        """
        return _cover(MeshFile(Path(self.path)), self._factors, excess)

    @property
    def _factors(self) -> tuple[float, float, float]:
        x, y, z = np.broadcast_to(np.asarray(self.scale, dtype=np.float64), 3).tolist()
        return x, y, z

    @property
    def _owner(self) -> str:
        return f"mesh '{self.path}'" if self.name is None else f"mesh {self.name!r}"


@lru_cache(maxsize=64)  # by content: a MeshFile equals each of the same bytes
def _cover(file: MeshFile, factors: tuple[float, float, float], excess: float) -> Balls:
    from sidestep.shapes import mesh_cover

    return mesh_cover.mesh_balls(_scaled(file, factors), excess)


def _scaled(file: MeshFile, factors: tuple[float, float, float]) -> Trimesh:
    mesh = file.triangles().copy()
    mesh.apply_transform(np.diag([*factors, 1.0]))
    return mesh
