"""Links as convex parts that hold their meshes: lower bounds of distances, cheaper than the distances."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property

import coal
import numpy as np
import numpy.typing as npt

from sidestep.distance.convex_parts import convex_parts
from sidestep.distance.solid import hull_model
from sidestep.distance.travel import interpolate_many, travel_per_joint
from sidestep.robot import Robot
from sidestep.shapes.mesh_reader import mesh_model

Array = npt.NDArray[np.float64]

GJK_ERROR = 1e-5  # [m] taken off distances of hulls: ten times the tolerance that Coal's GJK stops at


@dataclass(frozen=True, eq=False)
class LinkPart:
    """A convex part of a link, in the frame of the link.

    Attributes:
        corners: (N, 3) [m]; the mesh of the link lies in the hulls of its parts.
        shape: that hull for Coal; of a link without volume, the mesh.
    """

    corners: Array
    shape: coal.CollisionGeometry

    @cached_property
    def center(self) -> Array:
        """(3,) [m] of a ball around the corners."""
        middle: Array = 0.5 * (self.corners.min(axis=0) + self.corners.max(axis=0))
        return middle

    @cached_property
    def radius(self) -> float:
        """[m] of that ball."""
        return float(np.linalg.norm(self.corners - self.center, axis=1).max())


class LinkParts:
    """The parts of links with collision meshes; made when they are first asked for.

    Args:
        robot: the arm. names: of the links.
    """

    def __init__(self, robot: Robot, names: Sequence[str]) -> None:
        self.robot = robot
        self._names = tuple(names)

    @cached_property
    def of_link(self) -> tuple[tuple[LinkPart, ...], ...]:
        """Those of each link."""
        return tuple(self._of(name) for name in self._names)

    @cached_property
    def parts(self) -> tuple[LinkPart, ...]:
        """All P, link by link."""
        return tuple(part for parts in self.of_link for part in parts)

    @cached_property
    def link(self) -> npt.NDArray[np.int_]:
        """(P,) number of the link of each."""
        return np.repeat(np.arange(len(self._names)), [len(parts) for parts in self.of_link])

    @cached_property
    def radii(self) -> Array:
        """(P,) [m] of balls around them."""
        return np.array([part.radius for part in self.parts])

    @cached_property
    def travel(self) -> Array:
        """(P, nv) how far points of each move per unit of each joint, see `travel_per_joint`."""
        return np.array([self.travel_of(p, ()) for p in range(len(self.parts))]).reshape(len(self.parts), -1)

    def travel_of(self, p: int, beyond: Collection[int]) -> Array:
        """The same (nv,) for one, by the joints beyond some."""
        return travel_per_joint(self.robot, self._names[self.link[p]], self.parts[p].corners, beyond=beyond)

    def centers(self, path: Array, positions: Array) -> Array:
        """The centres (M, P, 3) [m] of those balls at positions (M,) along a path (T, nv)."""
        local = np.array([np.append(part.center, 1.0) for part in self.parts]).reshape(-1, 4)
        poses = np.array(
            [[self.robot.pose(q, name) for name in self._names] for q in interpolate_many(path, positions)]
        )
        world: Array = np.einsum("mpij,pj->mpi", poses[:, self.link, :3], local)
        return world

    def _of(self, link: str) -> tuple[LinkPart, ...]:
        mesh = self.robot.collision_mesh(link)
        assert mesh is not None
        parts = convex_parts(np.array(mesh.triangles, dtype=float)) or (
            np.asarray(mesh.vertices, dtype=float),
        )
        return tuple(LinkPart(corners, hull_model(corners) or mesh_model(mesh)) for corners in parts)


def hulls_apart(
    a: coal.CollisionGeometry, X_a: coal.Transform3s, b: coal.CollisionGeometry, X_b: coal.Transform3s
) -> float:
    """A lower bound of the distance [m] of two convex shapes; not above 0 where they may overlap."""
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.enable_signed_distance = False
    return float(coal.distance(a, X_a, b, X_b, request, result)) - GJK_ERROR
