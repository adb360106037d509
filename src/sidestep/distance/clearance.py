"""Exact distances between the robot's meshes and the scene: the truth that the controller is judged by.

The controller sees the body as Gaussians; this file never does. Distances are computed by Coal (Pan, Chitta,
Manocha, "FCL: A general purpose library for collision and proximity queries", 2012; Montaut et al., 2024) on
the triangles of the collision meshes.
"""

from __future__ import annotations

import math
from copy import copy
from dataclasses import dataclass

import coal
import numpy as np
import numpy.typing as npt

from sidestep._core import real_array
from sidestep.distance.link_parts import LinkParts, hulls_apart
from sidestep.distance.scene import Scene, check_scene
from sidestep.distance.solid import POINT_RADIUS, Solid, mesh_solid, object_solid, penetration
from sidestep.distance.sweep import smallest_distance
from sidestep.distance.travel import (
    interpolate,
    interpolate_many,
    interpolate_pose,
    object_travel,
    travel_per_joint,
)
from sidestep.math.pose import from_quaternion, pose_vector
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]

FINEST = 1e-6  # [m] clearance below which a motion counts as touching, undecided or not


@dataclass(frozen=True, eq=False)
class Clearance:
    """The closest pair of a robot and a scene.

    Attributes:
        distance: [m], negative when the two overlap; infinite when the scene is empty.
        link, obstacle: their names; empty when the scene is empty.
        point_on_link, point_on_obstacle: (3,) [m], world.
    """

    distance: float
    link: str
    obstacle: str
    point_on_link: Array
    point_on_obstacle: Array


@dataclass(frozen=True, eq=False)
class PathClearance:
    """The smallest clearance along a whole motion, between the samples too.

    Attributes:
        clearance: the closest pair at the sample found to be worst.
        sample: its position along the trajectory, in samples (4.25: a quarter of the way from 4 to 5).
        lower_bound: [m] no moment of the motion has a smaller clearance than this.
        checks: number of looks at a pair that this took.
        tolerance: [m] the one asked for, or a larger one after `sweep.FINE_CHECKS` (a run that diverged).
    """

    clearance: Clearance
    sample: float
    lower_bound: float
    checks: int
    tolerance: float


class ExactClearance:
    """Signed distance between a robot and a scene, on exact meshes, by Coal.

    The distance is positive when apart. When a link and a ball (or point) overlap it is exactly minus the
    depth: the length of the shortest push of the ball's centre out of the mesh, plus the radius. For the
    other shapes it is minus the largest depth that Coal reports over the overlapping triangles, which says
    that there is contact and about how deep, not the exact separating distance. Meshes are hollow for Coal;
    what is wholly inside one is found by the winding number and counts as overlap.

    Args:
        robot: with collision meshes; links without one are left out.
        objects: the scene.
        include_immobile: also measure links that no joint moves (the base).

    Raises:
        ValueError: no link has a collision mesh, or two objects share a name.
    """

    def __init__(self, robot: Robot, objects: Scene, *, include_immobile: bool = False) -> None:
        self.robot = robot
        self.objects = check_scene(objects)
        joint_of = {frame.name: frame.joint for frame in robot.frames}
        self._links: list[Solid] = []
        self._travel: list[Array] = []
        for link in robot.links:
            mesh = robot.collision_mesh(link.name)
            if mesh is None or (joint_of[link.name] < 0 and not include_immobile):
                continue
            self._links.append(mesh_solid(link.name, mesh))
            self._travel.append(travel_per_joint(robot, link.name, mesh.vertices))
        if not self._links:
            raise ValueError(f"robot {robot.name!r} has no moving link with a collision mesh to measure from")
        self._parts = LinkParts(robot, [link.name for link in self._links])
        self._objects = [object_solid(item) for item in self.objects]

    def among(self, objects: Scene) -> ExactClearance:
        """The same robot among other objects; shares the links, which take long to prepare."""
        other = copy(self)
        other.objects = check_scene(objects)
        other._objects = [object_solid(item) for item in other.objects]
        return other

    def distance(self, q: Array, object_poses: Array | None = None) -> Clearance:
        """The closest pair at one configuration.

        Args:
            q: (nv,) configuration.
            object_poses: (num_objects, 7) position [m] and quaternion (w, x, y, z) of each object in the
                world; None takes the poses at time 0.
        """
        poses = self._start_poses() if object_poses is None else real_array(object_poses, "object_poses")
        best = _nothing()
        for i, link in enumerate(self._links):
            X_WL = self.robot.pose(q, link.name)
            for j in range(len(self._objects)):
                if self._balls_apart(i, j, X_WL, poses[j]) >= best.distance:
                    continue
                found = self._pair(i, j, X_WL, poses[j])
                if found.distance < best.distance:
                    best = found
        return best

    def of_links(self, q: Array, object_poses: Array | None = None) -> tuple[Clearance, ...]:
        """What is nearest to each link; arguments as in `distance`. Nothing where the scene is empty."""
        poses = self._start_poses() if object_poses is None else real_array(object_poses, "object_poses")
        radii = np.array([item.bounding_radius for item in self._objects])
        nearest = []
        for i, link in enumerate(self._links):
            X_WL = self.robot.pose(q, link.name)
            at_least = np.linalg.norm(poses[:, :3] - X_WL[:3, 3], axis=1) - radii - link.bounding_radius
            best = _nothing()
            for j in np.argsort(at_least):
                if at_least[j] >= best.distance:
                    break
                found = self._pair(i, int(j), X_WL, poses[j])
                if found.distance < best.distance:
                    best = found
            nearest.append(best)
        return tuple(best for best in nearest if best.link)

    def minimum_over(
        self, trajectory: Array, object_poses: Array | None = None, *, tolerance: float = 1e-3
    ) -> PathClearance:
        """The smallest clearance of a motion that is linear in the joints from each sample to the next.

        Links are held by convex parts. Between two checks of a part and an object, neither can come closer than
        the distance its points can travel,
            |d(t) - d(t')| <= sum_j L_j |q_j(t) - q_j(t')| + (travel of the object),
        with L_j the longest lever arm of the part about joint j: the bound by which `smallest_distance` skips
        what is far. Nothing is missed: the true minimum lies in [reported - tolerance, reported]; where the
        reported one is above `tolerance`, nothing touched, however thin. (Below zero the lower end holds for
        balls only, see the class.) Only a motion that diverged is measured less finely, see there;
        `lower_bound` says what is known.

        Args:
            trajectory: (T, nv) samples.
            object_poses: (T, num_objects, 7) as in `distance`; objects move linearly (and turn at a constant
                rate) between samples. None: at their poses at time 0.
            tolerance: [m].

        Raises:
            ValueError: shapes do not match, or tolerance is not positive.
        """
        if not tolerance > 0.0:
            raise ValueError(f"tolerance must be positive, got {tolerance}")
        path, poses = self._check_path(trajectory, object_poses)
        found = smallest_distance(_AlongPath(self, path, poses), tolerance=tolerance)
        closest = _nothing() if found.pair < 0 else self._at(found.pair, path, poses, found.position)
        return PathClearance(
            closest, max(found.position, 0.0), found.distance - found.tolerance, found.checks, found.tolerance
        )

    def decided_minimum(
        self, trajectory: Array, object_poses: Array | None = None, *, tolerance: float = 1e-3
    ) -> PathClearance:
        """As `minimum_over`, to within the tolerance, or finer where that does not say whether anything touched.

        It ends undecided, with a lower bound below zero, only under `FINEST` or where the motion diverged.
        """
        while True:
            worst = self.minimum_over(trajectory, object_poses, tolerance=tolerance)
            distance = worst.clearance.distance
            if worst.tolerance > tolerance or not FINEST < distance <= tolerance:
                return worst
            tolerance = distance / 2.0

    def series(self, trajectory: Array, object_poses: Array | None = None) -> Array:
        """The clearance (T,) [m] at each sample of a trajectory, for plots; arguments as in `minimum_over`.

        The same bound spares most distance computations: a pair is measured only where it could be the
        closest.
        """
        path, poses = self._check_path(trajectory, object_poses)
        travel = self._travel_along(path, poses)
        pairs = list(travel)
        so_far = np.array(list(travel.values())).reshape(len(pairs), len(path))
        at_least = np.full(len(pairs), -np.inf)  # of each pair, at sample k
        closest = np.full(len(path), np.inf)
        for k, q in enumerate(path):
            if k > 0:
                at_least -= so_far[:, k] - so_far[:, k - 1]
            for index in np.argsort(at_least):
                if at_least[index] >= closest[k]:
                    break
                i, j = pairs[index]
                found = self._pair(i, j, self.robot.pose(q, self._links[i].name), poses[k, j]).distance
                at_least[index] = found if found > 0.0 else -np.inf  # an overlap of meshes has no such bound
                closest[k] = min(closest[k], found)
        return closest

    def _check_path(self, trajectory: Array, object_poses: Array | None) -> tuple[Array, Array]:
        path = real_array(trajectory, "trajectory")
        if path.ndim != 2 or path.shape[1] != self.robot.num_coordinates or len(path) == 0:
            raise ValueError(
                f"trajectory has shape {path.shape}, expected (T, {self.robot.num_coordinates}), T > 0"
            )
        expected = (len(path), len(self._objects), 7)
        if object_poses is None:
            poses: Array = np.broadcast_to(self._start_poses(), expected)
        else:
            poses = real_array(object_poses, "object_poses")
        if poses.shape != expected:
            raise ValueError(f"object_poses has shape {poses.shape}, expected {expected}")
        if not (np.all(np.isfinite(path)) and np.all(np.isfinite(poses))):
            raise ValueError("trajectory and object_poses must be finite")
        return path, poses

    def _travel_along(self, path: Array, poses: Array) -> dict[tuple[int, int], Array]:
        """Of each pair (link, object): how far its points can have come towards each other, (T,) from 0."""
        steps = np.abs(np.diff(path, axis=0))
        link_travel = [steps @ travel for travel in self._travel]
        moved = [object_travel(poses[:, j], item.bounding_radius) for j, item in enumerate(self._objects)]
        return {
            (i, j): np.concatenate([[0.0], np.cumsum(of_link + of_object)])
            for i, of_link in enumerate(link_travel)
            for j, of_object in enumerate(moved)
        }

    def _at(self, k: int, path: Array, poses: Array, position: float) -> Clearance:
        """The link of pair k of `_AlongPath` and its object at a position along a path."""
        part, j = divmod(k, len(self._objects))
        i = int(self._parts.link[part])
        X_WL = self.robot.pose(interpolate(path, position), self._links[i].name)
        return self._pair(i, j, X_WL, interpolate_pose(poses[:, j], position))

    def _start_poses(self) -> Array:
        return np.array([pose_vector(item.pose) for item in self.objects]).reshape(-1, 7)

    def _balls_apart(self, i: int, j: int, X_WL: Array, pose: Array) -> float:
        """The gap between the bounding balls of a link and an object: no more than their distance."""
        radii = self._links[i].bounding_radius + self._objects[j].bounding_radius
        return math.dist(X_WL[:3, 3], pose[:3]) - radii

    def _pair(self, i: int, j: int, X_WL: Array, pose: Array) -> Clearance:
        """One link, with its frame at X_WL (4, 4), and one object at `pose` (7,)."""
        link, item = self._links[i], self._objects[j]
        R, p = from_quaternion(pose[3:]), pose[:3]
        X_link = coal.Transform3s(X_WL[:3, :3], X_WL[:3, 3])
        X_item = coal.Transform3s(R, p)
        result = coal.DistanceResult()
        request = coal.DistanceRequest()
        request.enable_signed_distance = True
        value = coal.distance(link.shape, X_link, item.shape, X_item, request, result)
        on_link, on_item = np.array(result.getNearestPoint1()), np.array(result.getNearestPoint2())
        reference_L = X_WL[:3, :3].T @ (R @ item.reference + p - X_WL[:3, 3])
        inside = link.surface is not None and link.surface.contains(reference_L)
        if item.radius > 0.0:  # a ball, measured from its centre
            depth = value + POINT_RADIUS
            value = (-depth if inside else depth) - item.radius
            outward = on_link - p
            length = float(np.linalg.norm(outward))
            if length > 0.0:
                on_item = p + (-1.0 if inside else 1.0) * outward / length * item.radius
        elif value <= 0.0:
            value = min(value, -penetration(link.shape, X_link, item.shape, X_item))
        elif inside or (
            item.surface is not None and item.surface.contains(R.T @ (_world(X_WL, link.reference) - p))
        ):
            value = -value
        return Clearance(float(value), link.name, item.name, on_link, on_item)


class _AlongPath:
    """Parts of links and objects along a path, see `sweep.Pairs`; pair k is part k // N and object k % N of N."""

    def __init__(self, exact: ExactClearance, path: Array, poses: Array) -> None:
        self._exact, self._path, self._poses = exact, path, poses
        self._walked = np.concatenate(
            [np.zeros((1, path.shape[1])), np.cumsum(np.abs(np.diff(path, axis=0)), axis=0)]
        )
        steps = [object_travel(poses[:, j], item.bounding_radius) for j, item in enumerate(exact._objects)]
        self._moved = np.concatenate(
            [
                np.zeros((1, len(steps))),
                np.cumsum(np.array(steps).reshape(len(steps), len(path) - 1).T, axis=0),
            ]
        )

    def progress(self) -> Array:
        total: Array = self._walked.sum(axis=1) + self._moved.sum(axis=1)
        return total

    def gaps(self, positions: Array) -> Array:
        parts = self._exact._parts
        at = interpolate_many(self._poses[:, :, :3], positions)
        away = np.linalg.norm(parts.centers(self._path, positions)[:, :, None] - at[:, None], axis=3)
        radii = np.array([item.bounding_radius for item in self._exact._objects])
        apart: Array = away - parts.radii[:, None] - radii
        return apart.reshape(len(positions), -1)

    def travel_to(self, positions: Array) -> Array:
        walked, moved = (interpolate_many(samples, positions) for samples in (self._walked, self._moved))
        travel: Array = (walked @ self._exact._parts.travel.T)[:, :, None] + moved[:, None]
        return travel.reshape(len(positions), -1)

    def travel(self, k: int) -> Array:
        part, j = divmod(k, len(self._exact._objects))
        travel: Array = self._walked @ self._exact._parts.travel[part] + self._moved[:, j]
        return travel

    def at_least(self, k: int, position: float) -> float:
        part, j = divmod(k, len(self._exact._objects))
        exact = self._exact
        X = exact.robot.pose(interpolate(self._path, position), exact._links[exact._parts.link[part]].name)
        pose, item = interpolate_pose(self._poses[:, j], position), exact._objects[j]
        X_part = coal.Transform3s(X[:3, :3], X[:3, 3])
        X_item = coal.Transform3s(from_quaternion(pose[3:]), pose[:3])
        return hulls_apart(exact._parts.parts[part].shape, X_part, item.hull, X_item) - item.radius

    def measure(self, k: int, position: float) -> float:
        return self._exact._at(k, self._path, self._poses, position).distance


def _nothing() -> Clearance:
    return Clearance(float("inf"), "", "", np.zeros(3), np.zeros(3))


def _world(X: Array, point: Array) -> Array:
    moved: Array = X[:3, :3] @ point + X[:3, 3]
    return moved
