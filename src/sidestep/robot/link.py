"""Links: inertia and geometry, in the link frame."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from sidestep.math.matrices import determinant, product, transformed
from sidestep.shapes import Fineness, Shape, Triangles, kind_of
from sidestep.shapes.mesh_reader import MeshFile

if TYPE_CHECKING:  # trimesh is imported where a mesh is made: it takes longer to import than a robot to load
    import trimesh

Array = NDArray[np.float64]
FINENESS = Fineness(subdivisions=4, sections=64, cap_sections=80)  # 0.12 % of a radius is cut off at most


@dataclass(frozen=True, eq=False)
class Inertial:
    """Mass properties of a link.

    Args:
        mass: [kg].
        com: centre of mass (3,) in the link frame [m].
        inertia: rotational inertia (3, 3) about the centre of mass, in the link axes [kg m^2].
    """

    mass: float
    com: Array
    inertia: Array


@dataclass(frozen=True, eq=False)
class Geometry:
    """A mesh file or a primitive shape, placed in a link frame.

    Args:
        kind: "mesh", or that of a shape: "box", "cylinder", …
        placement: pose (4, 4) of the shape in the link frame.
        size: lengths of the shape [m] in the order of its class: of a `Box` (x, y, z), of a `Cylinder` (radius,
            length), …; mesh: ().
        path: the mesh file, None for a primitive.
        scale: factor per axis (3,) on the file's vertices, before `placement`.
        sweeps: of a part that something else drives: sets of poses (K, 4, 4) in the link frame. Between those of a set
            it may be anywhere: the convex hull of the shape at all of them stands for it. None: it is at rest.
    """

    kind: str
    placement: Array
    size: tuple[float, ...] = ()
    path: Path | None = None
    scale: Array = field(default_factory=lambda: np.ones(3))
    sweeps: tuple[Array, ...] = ()

    def mesh(self) -> trimesh.Trimesh:
        """The shape as triangles in the link frame [m]; loaded once, copy it before you change it.

        Round shapes become inscribed polyhedra, less than 0.15 % of the radius inside the surface.

        Raises:
            ValueError: the file holds no triangles or cannot be read as a mesh.
        """
        return self._mesh

    @cached_property
    def file(self) -> MeshFile:
        """The mesh file as it is when it is first asked for: hash and triangles are of one content.

        Raises:
            ValueError: it is no mesh of a file.
        """
        if self.path is None:
            raise ValueError(f"a {self.kind} has no mesh file")
        return MeshFile(self.path)

    @cached_property
    def shape(self) -> Shape:
        """The shape in its own frame; raises as `mesh`."""
        if self.path is None:
            return kind_of(self.kind, "geometry").of_lengths(self.size)
        return Triangles(_placed(_in_metres(self.file), np.diag([*self.scale, 1.0])))

    @cached_property
    def _mesh(self) -> trimesh.Trimesh:
        import trimesh

        mesh = _placed(self.shape.surface(FINENESS), self.placement)
        if self.sweeps:
            corners = np.asarray(mesh.convex_hull.vertices)
            hulls = [
                trimesh.convex.convex_hull(
                    (product(corners, X[:, :3, :3].mT) + X[:, None, :3, 3]).reshape(-1, 3)
                )
                for X in self.sweeps
            ]
            mesh = cast("trimesh.Trimesh", trimesh.util.concatenate(hulls))
        return mesh


@dataclass(frozen=True, eq=False)
class Link:
    """A URDF link: a named frame with inertia and geometry, everything in that frame."""

    name: str
    inertial: Inertial | None = None
    collisions: tuple[Geometry, ...] = ()
    visuals: tuple[Geometry, ...] = ()

    @property
    def geometries(self) -> tuple[Geometry, ...]:
        """The link's collision geometry or, where it has none, its visual geometry."""
        return self.collisions or self.visuals

    def same_geometry(self, other: Link) -> bool:
        """Whether another link has the same shapes at the same places."""
        return len(self.geometries) == len(other.geometries) and all(
            (a.kind, a.size, a.path is None) == (b.kind, b.size, b.path is None)
            and (a.path is None or a.file == b.file)
            and np.array_equal(a.placement, b.placement)
            and np.array_equal(a.scale, b.scale)
            and np.array_equal(np.array(a.sweeps), np.array(b.sweeps))
            for a, b in zip(self.geometries, other.geometries, strict=True)
        )


def _placed(mesh: trimesh.Trimesh, X: Array) -> trimesh.Trimesh:
    """A mesh after a transform X (4, 4), by plain sums; its triangles are turned where X mirrors."""
    import trimesh

    if np.array_equal(X, np.eye(4)):
        return mesh.copy()
    faces = mesh.faces if determinant(X[:3, :3]) > 0.0 else np.fliplr(mesh.faces)
    return trimesh.Trimesh(transformed(mesh.vertices.view(np.ndarray), X), faces, process=False)


def _in_metres(file: MeshFile) -> trimesh.Trimesh:
    """The triangles of a mesh file in metres. COLLADA: its unit is applied, its up axis is not, as in ROS."""
    import trimesh

    mesh = file.triangles()
    if file.kind == "dae" and mesh.units is not None:
        mesh = _placed(mesh, np.diag([*[trimesh.units.unit_conversion(mesh.units, "meters")] * 3, 1.0]))
    return mesh
