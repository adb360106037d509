"""Exact distances between the robot's meshes and the scene: the truth that the controller is judged by.

The controller sees the body as Gaussians; this file never does. Distances are computed by Coal (Pan, Chitta,
Manocha, "FCL: A general purpose library for collision and proximity queries", 2012; Montaut et al., 2024) on
the triangles of the collision meshes.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from copy import copy
from dataclasses import dataclass

import coal
import numpy as np
import numpy.typing as npt

from sidestep._core import JointType
from sidestep.pose import from_quaternion, moved, pose_vector
from sidestep.robot import Robot
from sidestep.simulation.scene import SceneObject, check_scene
from sidestep.simulation.solid import POINT_RADIUS, Solid, mesh_solid, object_solid, penetration

Array = npt.NDArray[np.float64]

FINEST = 1e-6  # [m] clearance below which a motion counts as touching, undecided or not
FINE_CHECKS = 100_000  # distances at the tolerance asked for, some ten seconds; a thesis run takes a thousand


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
        tolerance: [m] the one asked for, or a larger one after `FINE_CHECKS` (a run that diverged).
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

    def __init__(
        self, robot: Robot, objects: Sequence[SceneObject], *, include_immobile: bool = False
    ) -> None:
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
        self._objects = [object_solid(item) for item in self.objects]

    def among(self, objects: Sequence[SceneObject]) -> ExactClearance:
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
        poses = self._start_poses() if object_poses is None else np.asarray(object_poses, dtype=float)
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
        poses = self._start_poses() if object_poses is None else np.asarray(object_poses, dtype=float)
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

        Between two checks of a pair, neither can come closer than the distance its points can travel,
            |d(t) - d(t')| <= sum_j L_j |q_j(t) - q_j(t')| + (travel of the object),
        with L_j the longest lever arm of the link about joint j. So after a check that found d, the pair is
        skipped until that bound has grown to d - (smallest so far) + tolerance. Nothing is missed: the true
        minimum lies in [reported - tolerance, reported]; where the reported one is above `tolerance`, nothing
        touched, however thin. (Below zero the lower end holds for balls only, see the class.)

        The number of checks is bounded by the travel over the tolerance, which a diverging motion makes endless.
        So after `FINE_CHECKS` of them the tolerance becomes at least the whole travel over `FINE_CHECKS`: no
        motion takes more than twice that many checks and one per pair, and `lower_bound` says what is known.

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
        best, where, checks = _nothing(), 0.0, 0
        for sample in np.unique(
            np.linspace(0, len(path) - 1, 16).astype(int)
        ):  # a good first guess of the minimum
            found = self.distance(path[sample], poses[sample])
            checks += len(self._links) * len(self._objects)
            if found.distance < best.distance:
                best, where = found, float(sample)

        travel = self._travel_along(path, poses)
        coarse = max(tolerance, sum(float(so_far[-1]) for so_far in travel.values()) / FINE_CHECKS)
        for (i, j), so_far in travel.items():
            s = 0.0
            while True:
                q, pose = interpolate(path, s), _interpolate_pose(poses[:, j], s)
                X_WL = self.robot.pose(q, self._links[i].name)
                at_least = self._balls_apart(i, j, X_WL, pose)
                if at_least <= best.distance:
                    found = self._pair(i, j, X_WL, pose)
                    at_least = found.distance
                    if found.distance < best.distance:
                        best, where = found, s
                checks += 1
                if checks >= FINE_CHECKS:
                    tolerance = coarse
                following = _advance(so_far, s, at_least - best.distance + tolerance)
                if following is None:
                    break
                s = following
        return PathClearance(best, where, best.distance - tolerance, checks, tolerance)

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
        path = np.asarray(trajectory, dtype=float)
        if path.ndim != 2 or path.shape[1] != self.robot.num_coordinates or len(path) == 0:
            raise ValueError(
                f"trajectory has shape {path.shape}, expected (T, {self.robot.num_coordinates}), T > 0"
            )
        expected = (len(path), len(self._objects), 7)
        if object_poses is None:
            poses: Array = np.broadcast_to(self._start_poses(), expected)
        else:
            poses = np.asarray(object_poses, dtype=float)
        if poses.shape != expected:
            raise ValueError(f"object_poses has shape {poses.shape}, expected {expected}")
        if not (np.all(np.isfinite(path)) and np.all(np.isfinite(poses))):
            raise ValueError("trajectory and object_poses must be finite")
        return path, poses

    def _travel_along(self, path: Array, poses: Array) -> dict[tuple[int, int], Array]:
        """Of each pair (link, object): how far its points can have come towards each other, (T,) from 0."""
        steps = np.abs(np.diff(path, axis=0))
        link_travel = [steps @ travel for travel in self._travel]
        object_travel = [
            _object_travel(poses[:, j], item.bounding_radius) for j, item in enumerate(self._objects)
        ]
        return {
            (i, j): np.concatenate([[0.0], np.cumsum(of_link + of_object)])
            for i, of_link in enumerate(link_travel)
            for j, of_object in enumerate(object_travel)
        }

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


def travel_per_joint(robot: Robot, link: str, points: Array, *, beyond: Collection[int] = ()) -> Array:
    """Bound (nv,) on how far points (N, 3) of a link, in its frame, move per unit of each joint coordinate, at
    any configuration.

    For a revolute joint it is the longest lever arm, at most the stretched length of the chain from the joint
    to the link plus the distance of the farthest point; for a prismatic joint 1. [m/rad] or [m/m].
    Only the joints beyond the ones in `beyond` (indices of `robot.joints`) count: motion relative to them.

    Raises:
        ValueError: a prismatic joint between a revolute one and the link has no position limits.
    """
    frame = next(f for f in robot.frames if f.name == link)
    bound = np.zeros(robot.num_coordinates)
    limits = robot.limits
    vertices = moved(points, frame.placement)
    reach = float(np.linalg.norm(vertices, axis=1).max())
    index, first = frame.joint, True
    while index >= 0 and index not in beyond:
        joint = robot.joints[index]
        if joint.type == JointType.revolute:
            arm = float(np.linalg.norm(np.cross(vertices, joint.axis), axis=1).max()) if first else reach
            bound[joint.coordinate] += abs(joint.multiplier) * arm
        else:
            bound[joint.coordinate] += abs(joint.multiplier)
            ends = (limits.lower[joint.coordinate], limits.upper[joint.coordinate])
            stroke = max(abs(joint.multiplier * e + joint.offset) for e in ends)
            if not np.isfinite(stroke) and joint.parent >= 0:
                raise ValueError(
                    f"prismatic joint {joint.name!r} needs finite position limits to bound its motion"
                )
            reach += stroke if np.isfinite(stroke) else 0.0
        reach += float(np.linalg.norm(joint.placement[:3, 3]))
        index, first = joint.parent, False
    return bound


def _nothing() -> Clearance:
    return Clearance(float("inf"), "", "", np.zeros(3), np.zeros(3))


def _world(X: Array, point: Array) -> Array:
    moved: Array = X[:3, :3] @ point + X[:3, 3]
    return moved


def _object_travel(poses: Array, radius: float) -> Array:
    """Bound (T - 1,) on the travel of any point of an object between samples: shift plus angle times
    radius."""
    shift = np.linalg.norm(np.diff(poses[:, :3], axis=0), axis=1)
    overlap = np.abs(np.einsum("ij,ij->i", poses[1:, 3:], poses[:-1, 3:]))
    turned: Array = shift + radius * 2.0 * np.arccos(np.clip(overlap, 0.0, 1.0))
    return turned


def interpolate(samples: Array, s: float) -> Array:
    """The row of samples (T, n) at a position along them, linear between two of them."""
    k = min(int(s), len(samples) - 1)
    f = s - k
    value: Array = samples[k] if f == 0.0 else (1.0 - f) * samples[k] + f * samples[k + 1]
    return value


def _interpolate_pose(poses: Array, s: float) -> Array:
    pose = interpolate(poses, s)
    k = min(int(s), len(poses) - 1)
    if s == k or np.array_equal(poses[k, 3:], poses[k + 1, 3:]):
        return pose
    start, end, f = poses[k, 3:], poses[k + 1, 3:], s - k
    overlap = float(start @ end)
    end = end if overlap >= 0.0 else -end
    angle = float(np.arccos(min(abs(overlap), 1.0)))
    if angle < 1e-9:  # [rad] no turn worth dividing by
        return np.concatenate([pose[:3], start])
    turned = (np.sin((1.0 - f) * angle) * start + np.sin(f * angle) * end) / np.sin(angle)
    return np.concatenate([pose[:3], turned])


def _advance(so_far: Array, s: float, budget: float) -> float | None:
    """The position along the path at which the travel has grown by `budget`; None past the end."""
    target = float(interpolate(so_far[:, None], s)[0]) + budget
    if target >= so_far[-1]:
        return None
    k = int(np.searchsorted(so_far, target, side="right")) - 1
    return float(k + (target - so_far[k]) / (so_far[k + 1] - so_far[k]))
