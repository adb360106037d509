"""Links as convex parts that hold their meshes: lower bounds of distances, cheaper than the distances."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import coal
import numpy as np
import numpy.typing as npt

from sidestep.robot import Robot
from sidestep.simulation.clearance import travel_per_joint
from sidestep.simulation.convex_parts import convex_parts
from sidestep.simulation.solid import hull_model, mesh_model

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


def link_parts(robot: Robot, link: str) -> tuple[LinkPart, ...]:
    """The parts of a link that has a collision mesh."""
    mesh = robot.collision_mesh(link)
    assert mesh is not None
    parts = convex_parts(np.array(mesh.triangles, dtype=float))
    if not parts:
        return (LinkPart(np.asarray(mesh.vertices, dtype=float), mesh_model(mesh)),)
    return tuple(LinkPart(corners, hull_model(corners)) for corners in parts)


class LinkPair(NamedTuple):
    """Two links.

    Attributes:
        first, second: their numbers.
        shared: the joints that both hang on: these do not move one against the other.
    """

    first: int
    second: int
    shared: Collection[int]


class PairsOfParts:
    """Every part of one link with every part of the other, for pairs of links.

    Args:
        robot: the arm. names: of its links. pairs: of links, as indices of `names`.

    Attributes:
        links: (K,) index of `pairs` for each of the K pairs of parts.
        travel: (K, nv) how far points of the two can come towards each other per unit of each joint.
    """

    def __init__(self, robot: Robot, names: Sequence[str], pairs: Sequence[LinkPair]) -> None:
        of_link = [link_parts(robot, name) for name in names]
        first_of_link = np.concatenate([[0], np.cumsum([len(parts) for parts in of_link])])
        self._parts = [part for parts in of_link for part in parts]
        self._link = np.repeat(np.arange(len(names)), [len(parts) for parts in of_link])
        self._radii = np.array([part.radius for part in self._parts])
        links, ends, travel = [], [], []
        for index, pair in enumerate(pairs):
            moved = {
                part: travel_per_joint(robot, names[link], self._parts[part].corners, beyond=pair.shared)
                for link in (pair.first, pair.second)
                for part in range(first_of_link[link], first_of_link[link + 1])
            }
            for a in range(first_of_link[pair.first], first_of_link[pair.first + 1]):
                for b in range(first_of_link[pair.second], first_of_link[pair.second + 1]):
                    links.append(index)
                    ends.append((a, b))
                    travel.append(moved[a] + moved[b])
        self.links = np.array(links, dtype=int)
        self._ends = np.array(ends, dtype=int).reshape(-1, 2)
        self.travel = np.array(travel).reshape(-1, robot.num_coordinates)

    def balls_apart(self, poses: Array) -> Array:
        """The gaps (M, K) [m] between bounding balls, for poses (M, L, 4, 4) of all links."""
        local = np.array([np.append(part.center, 1.0) for part in self._parts]).reshape(-1, 4)
        centers = np.einsum("mpij,pj->mpi", poses[:, self._link, :3], local)
        a, b = self._ends.T
        gaps: Array = np.linalg.norm(centers[:, a] - centers[:, b], axis=2) - self._radii[a] - self._radii[b]
        return gaps

    def hulls_apart(self, k: int, X_first: Array, X_second: Array) -> float:
        """No more than the distance [m] of the surfaces in pair k, with the links at poses (4, 4); may be below 0."""
        placed: list[object] = []
        for part, X in zip(self._ends[k], (X_first, X_second), strict=True):
            placed += [self._parts[part].shape, coal.Transform3s(X[:3, :3], X[:3, 3])]
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        request.enable_signed_distance = False
        return float(coal.distance(*placed, request, result)) - GJK_ERROR
