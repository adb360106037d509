"""Where obstacles of reach problems are put: where an arm gets to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from sidestep._core import JointType
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]

SHELL = (0.35, 1.0)  # of the reach, between which ball centres lie
REACH_SAMPLES = 2000  # configurations from which the reach is measured
LENGTH_DECIMALS = 3  # reach and shoulder are rounded to 1 mm, so that every machine computes the same

CELL = 0.1  # of the reach: edge of the cells of a swept space
LINK_POINTS = 48  # on the surface of a link, by which it is in a cell
ALWAYS = 0.1  # of the configurations: what is there more often stands in the way of itself


class Space(Protocol):
    """Where obstacles are put."""

    @property
    def reach(self) -> float:
        """[m] how far the arm reaches."""

    def sample(self, rng: np.random.Generator) -> Array:
        """A point (3,)."""

    def direction(self, rng: np.random.Generator) -> Array:
        """A uniform unit vector (3,) in which the arm can move."""


@dataclass(frozen=True)
class Workspace:
    """Where the tip of an arm gets to: a shell around the shoulder.

    Attributes:
        shoulder: (3,) [m] the point of the first joint's axis from which the farthest tip is nearest.
        reach: [m] distance of that farthest tip.
        directions: (dim, 3) orthonormal; 3 rows, or 2 for an arm that moves in a plane.
    """

    shoulder: Array
    reach: float
    directions: Array

    @classmethod
    def of(cls, robot: Robot) -> Workspace:
        """Measures where the far end of the last link with geometry gets to, on random configurations (seed 0)."""
        rng = np.random.default_rng(0)
        meshes = [(link.name, robot.collision_mesh(link.name)) for link in robot.links]
        tip, vertices = [(name, mesh.vertices) for name, mesh in meshes if mesh is not None][-1]
        away = np.linalg.norm(vertices, axis=1)
        end = np.append(vertices[away > away.max() - 10.0**-LENGTH_DECIMALS].mean(axis=0), 1.0)
        poses = [robot.pose(robot.random_configuration(rng), tip) for _ in range(REACH_SAMPLES)]
        tips = np.array([(X @ end)[:3] for X in poses])
        joint = robot.joints[0]
        axis = joint.placement[:3, :3] @ joint.axis
        origin = joint.placement[:3, 3]
        along = (tips - origin) @ axis
        away2 = np.sum((tips - origin) ** 2, axis=1) - along**2
        heights = np.linspace(along.min(), along.max(), 1001)
        farthest = np.sqrt((away2 + (along - heights[:, None]) ** 2).max(axis=1))
        best = int(farthest.argmin())
        shoulder = np.round(origin + heights[best] * axis, LENGTH_DECIMALS) + 0.0
        return cls(shoulder, round(float(farthest[best]), LENGTH_DECIMALS), _directions(tips))

    def sample(self, rng: np.random.Generator) -> Array:
        """A point (3,), uniform in the volume (or area) of the shell."""
        dim = len(self.directions)
        inner, outer = (share * self.reach for share in SHELL)
        distance = rng.uniform(inner**dim, outer**dim) ** (1.0 / dim)
        point: Array = self.shoulder + distance * self.direction(rng)
        return point

    def direction(self, rng: np.random.Generator) -> Array:
        """A uniform unit vector (3,) in which the arm can move."""
        coefficients = rng.normal(size=len(self.directions))
        unit: Array = (coefficients / np.linalg.norm(coefficients)) @ self.directions
        return unit


@dataclass(frozen=True, eq=False)
class SweptSpace:
    """The space that the moving links of an arm sweep, of whatever build: on rails, on mobile bases, with several arms.

    Random configurations (seed 0) put the links into cells, with an edge of a tenth of the reach. Cells where there
    is something in more than a tenth of the configurations are left out: balls there would block the base itself.

    Attributes:
        cells: (N, 3) [m] the lowest corners, in order. edge: [m] of them.
        reach: [m] the farthest that a link gets from the first joint that turns, which rails carry along.
        directions: (dim, 3) orthonormal; 3 rows, or 2 for an arm that moves in a plane. centre: (3,) [m] in that plane.
    """

    cells: Array
    edge: float
    reach: float
    directions: Array
    centre: Array

    @classmethod
    def of(cls, robot: Robot) -> SweptSpace:
        """Measures it on random configurations."""
        rng = np.random.default_rng(0)
        meshes = {link.name: robot.collision_mesh(link.name) for link in robot.links}
        moving = {frame.name for frame in robot.frames if frame.joint >= 0}
        points = {
            name: np.column_stack([_spread(mesh.vertices, LINK_POINTS), np.ones(LINK_POINTS)])
            for name, mesh in meshes.items()
            if mesh is not None and name in moving
        }
        if not points:
            raise ValueError(
                f"robot {robot.name!r} has no moving link with a collision geometry: nothing can touch"
            )
        turning = [k for k, joint in enumerate(robot.joints) if joint.type == JointType.revolute]
        first = next(frame.name for frame in robot.frames if frame.joint == (turning or [0])[0])
        visits, reach = [], 0.0
        for _ in range(REACH_SAMPLES):
            q = robot.random_configuration(rng)
            placed = np.concatenate([(points[name] @ robot.pose(q, name).T)[:, :3] for name in points])
            visits.append(placed)
            reach = max(reach, float(np.linalg.norm(placed - robot.pose(q, first)[:3, 3], axis=1).max()))
        reach = round(reach, LENGTH_DECIMALS)
        swept = np.array(visits)
        directions = _directions((swept - swept.mean(axis=0)).reshape(-1, 3))
        centre = np.round(swept.reshape(-1, 3).mean(axis=0), LENGTH_DECIMALS)
        edge = round(CELL * reach, LENGTH_DECIMALS)
        where = np.floor(swept / edge).astype(np.int64)
        once = np.concatenate([np.unique(cells, axis=0) for cells in where])
        cells, counts = np.unique(once, axis=0, return_counts=True)
        kept = cells[counts <= ALWAYS * REACH_SAMPLES]
        return cls(kept * edge, edge, reach, directions, centre)

    def sample(self, rng: np.random.Generator) -> Array:
        """A point (3,), uniform in the cells; of an arm that moves in a plane, in that."""
        point = self.cells[rng.integers(len(self.cells))] + rng.uniform(0.0, self.edge, 3)
        if len(self.directions) < 3:
            point = self.centre + (point - self.centre) @ self.directions.T @ self.directions
        return np.asarray(point)

    def direction(self, rng: np.random.Generator) -> Array:
        """A uniform unit vector (3,) in which the arm can move."""
        coefficients = rng.normal(size=len(self.directions))
        return np.asarray((coefficients / np.linalg.norm(coefficients)) @ self.directions)


def _spread(points: Array, count: int) -> Array:
    """So many of the points (N, 3), each the farthest from those before; again from the first where there are fewer."""
    chosen = [int(np.linalg.norm(points - points.mean(axis=0), axis=1).argmax())]
    away = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < min(count, len(points)):
        chosen.append(int(away.argmax()))
        away = np.minimum(away, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.asarray(points[np.resize(chosen, count)])


def _directions(points: Array) -> Array:
    """An orthonormal basis (2 or 3, 3) of the directions in which points (N, 3) [m] spread, the same anywhere."""
    _, spread, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    if spread[2] > 1e-6 * spread[0]:
        return np.eye(3)
    normal = np.round(axes[2], 6) + 0.0  # rounded: the basis must not depend on the machine's last digits
    first = np.eye(3)[int(np.abs(normal).argmin())]
    first = first - (first @ normal) * normal
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(normal * np.sign(normal[np.abs(normal).argmax()]), first)])
