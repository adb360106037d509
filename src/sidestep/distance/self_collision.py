"""Exact self-collision of the arm's own meshes, and which pairs of links count."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

import coal
import numpy as np
import numpy.typing as npt

from sidestep._core import real_array
from sidestep.distance.link_parts import LinkParts, hulls_apart
from sidestep.distance.sweep import smallest_distance
from sidestep.distance.travel import interpolate, interpolate_many, travel_per_joint
from sidestep.robot import Robot, read_srdf
from sidestep.shapes.mesh_reader import mesh_model

Array = npt.NDArray[np.float64]
Pair = tuple[str, str]
Reason = Literal["rigid", "adjacent", "always", "allowed"]

SAMPLES = 200  # configurations by which a pair that always touches is found
ALWAYS = 0.95  # share of them: SRDF tools take the same, since a rare pose may part what is meant to touch
SEAM = 0.005  # [m] between links that are made to overlap and are never farther apart
LOOKS = (
    256  # moments of a motion, evenly over its travel, at which bounding balls show which pairs are near when
)
FIRST_LOOKS = 16  # of these, at which the closest pair is measured, for a good first guess of the minimum


@dataclass(frozen=True)
class SelfClearance:
    """The closest pair of links of an arm.

    Attributes:
        distance: [m]; 0 when they touch or overlap; infinite when no pair is checked.
        pair: their names; empty when no pair is checked.
        sample: where along a motion, in samples; 0 for one configuration.
    """

    distance: float
    pair: tuple[str, ...]
    sample: float = 0.0


@dataclass(frozen=True)
class _PairOfLinks:
    first: int
    second: int
    shared: frozenset[int]  # joints that both hang on: these do not move one against the other


class SelfCollision:
    """Distance between the links of an arm on their exact meshes, by Coal.

    Left out, as tools for SRDF do, are pairs that cannot or need not part: "rigid" (no joint between them),
    "adjacent" (one joint between them), "always" (touch in 95 % of random configurations, or in half of them
    and are never 5 mm apart) and "allowed" (by the description, or asked for). Pairs that never touched in those
    samples are kept: sampling cannot prove it.

    Args:
        robot: with collision meshes.
        allowed: further pairs of link names that may touch.
        samples: configurations, uniform within the limits, by which "always" is judged.
        seed: of these.

    Raises:
        ValueError: `allowed` names a link that the robot does not have.
    """

    def __init__(
        self, robot: Robot, *, allowed: Iterable[Pair] = (), samples: int = SAMPLES, seed: int = 0
    ) -> None:
        self.robot = robot
        allowed = (*robot.allowed_pairs, *allowed)
        asked = {frozenset((robot.link(a).name, robot.link(b).name)) for a, b in allowed}
        joint_of = {frame.name: frame.joint for frame in robot.frames}
        meshes = {link.name: robot.collision_mesh(link.name) for link in robot.links}
        self._names = [name for name, mesh in meshes.items() if mesh is not None]
        self._models, self._centers, self._radii = [], [], []
        for name in self._names:
            mesh = meshes[name]
            assert mesh is not None
            center = np.asarray(mesh.bounds.mean(axis=0))
            self._models.append(mesh_model(mesh))
            self._centers.append(center)
            self._radii.append(float(np.linalg.norm(mesh.vertices - center, axis=1).max()))
        self.left_out: dict[Pair, Reason] = {}
        self._pairs: list[_PairOfLinks] = []
        self._moved_by: dict[Pair, tuple[int, ...]] = {}
        for i, j in itertools.combinations(range(len(self._names)), 2):
            a, b = self._names[i], self._names[j]
            above_a, above_b = (_joints_above(robot, joint_of[name]) for name in (a, b))
            apart = above_a ^ above_b
            if frozenset((a, b)) in asked:
                self.left_out[a, b] = "allowed"
            elif not apart:
                self.left_out[a, b] = "rigid"
            elif len(apart) == 1:
                self.left_out[a, b] = "adjacent"
            else:
                self._pairs.append(_PairOfLinks(i, j, above_a & above_b))
                self._moved_by[a, b] = tuple(sorted({robot.joints[joint].coordinate for joint in apart}))
        self._leave_out_what_always_touches(samples, np.random.default_rng(seed))
        self._parts = LinkParts(robot, self._names)
        self._by_name = {self._name(pair): pair for pair in self._pairs}

    @classmethod
    def from_srdf(
        cls, robot: Robot, source: str | Path, *, samples: int = SAMPLES, seed: int = 0
    ) -> SelfCollision:
        """With the pairs that an SRDF lets touch left out as well (a path, or the XML text).

        Raises:
            FileNotFoundError, ValueError: as `read_srdf`.
        """
        allowed = read_srdf(source, [link.name for link in robot.links])
        return cls(robot, allowed=allowed, samples=samples, seed=seed)

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """The pairs of links that are checked."""
        return tuple(self._name(pair) for pair in self._pairs)

    def coordinates_between(self, first: str, second: str) -> tuple[int, ...]:
        """The coordinates that move one link of a checked pair relative to the other."""
        return self._moved_by[self._name(self._find(first, second))]

    def travel_between(self, first: str, second: str) -> Array:
        """How far points of a checked pair can come towards each other per unit of each joint (nv,), at most.

        Raises:
            ValueError: the pair is not checked.
        """
        pair = self._find(first, second)
        travel = np.zeros(self.robot.num_coordinates)
        for name in self._name(pair):
            mesh = self.robot.collision_mesh(name)
            assert mesh is not None
            travel += travel_per_joint(self.robot, name, mesh.vertices, beyond=pair.shared)
        return travel

    def distance_between(self, q: Array, first: str, second: str) -> float:
        """The distance [m] of a checked pair at q (nv,); 0 when they touch or overlap.

        Raises:
            ValueError: the pair is not checked.
        """
        pair = self._find(first, second)
        return self._measure(pair, self._poses(q, pair))

    def within(self, q: Array, first: str, second: str, distance: float) -> bool:
        """Whether a checked pair is no farther apart than a distance [m] at q (nv,); faster than to measure it.

        Raises:
            ValueError: the pair is not checked, or the distance is negative.
        """
        if not distance >= 0.0:
            raise ValueError(f"distance is {distance} m, must be >= 0")
        pair = self._find(first, second)
        return self._touch(pair, self._poses(q, pair), margin=distance)

    def touching(self, q: Array) -> tuple[Pair, ...]:
        """The pairs that touch at q (nv,)."""
        poses = self._poses(q)
        return tuple(self._name(pair) for pair in self._pairs if self._touch(pair, poses))

    def distance(self, q: Array) -> SelfClearance:
        """The closest pair at q (nv,)."""
        return self._closest(q, SelfClearance(float("inf"), ()), 0.0)

    def minimum_over(self, trajectory: Array, *, tolerance: float = 1e-3) -> SelfClearance:
        """The smallest distance of a motion (T, nv) that is linear in the joints between samples.

        Links are held by convex parts. Two parts come closer by at most sum_j L_j |dq_j|, with L_j the lever arms of
        the joints between the two links: the bound by which `smallest_distance` skips what is far. The true minimum
        lies in [reported - tolerance, reported]. Ends at the first touch. Only a motion that diverged is measured less
        finely, see there.

        Raises:
            ValueError: wrong shape, values that are not finite, a tolerance that is not positive, or a prismatic
                joint between the links that has no position limits.
        """
        path = real_array(trajectory, "trajectory")
        if path.ndim != 2 or path.shape[1] != self.robot.num_coordinates or len(path) == 0:
            raise ValueError(
                f"trajectory has shape {path.shape}, expected (T, {self.robot.num_coordinates}), T > 0"
            )
        if not np.all(np.isfinite(path)):
            raise ValueError("trajectory must be finite")
        if not tolerance > 0.0:
            raise ValueError(f"tolerance must be positive, got {tolerance}")
        found = smallest_distance(_AlongPath(self, path), tolerance=tolerance, enough=0.0)
        if found.pair < 0:
            return SelfClearance(float("inf"), ())
        pair = self._pairs[self._pairs_of_parts[found.pair][0]]
        return SelfClearance(found.distance, self._name(pair), found.position)

    @cached_property
    def _pairs_of_parts(self) -> tuple[tuple[int, int, int], ...]:
        """Of each part of one link with each part of the other: which of the pairs, and the numbers of the parts."""
        numbers = [np.flatnonzero(self._parts.link == link).tolist() for link in range(len(self._names))]
        return tuple(
            (index, a, b)
            for index, pair in enumerate(self._pairs)
            for a, b in itertools.product(numbers[pair.first], numbers[pair.second])
        )

    @cached_property
    def _travel(self) -> Array:
        """(K, nv) how far points of those can come towards each other per unit of each joint."""
        beyond = functools.cache(self._parts.travel_of)
        rows = [
            beyond(a, self._pairs[index].shared) + beyond(b, self._pairs[index].shared)
            for index, a, b in self._pairs_of_parts
        ]
        return np.array(rows).reshape(-1, self.robot.num_coordinates)

    def _leave_out_what_always_touches(self, samples: int, rng: np.random.Generator) -> None:
        placed = [self._poses(self.robot.random_configuration(rng)) for _ in range(samples)]
        apart = self._balls_apart_at(placed)
        for k, pair in enumerate(self._pairs):
            near = np.flatnonzero(apart[:, k] <= 0.0)
            if 2 * len(near) < samples:
                continue  # far apart in most of them
            count = sum(self._touch(pair, placed[i]) for i in near)
            overlap = 2 * count >= samples and all(self._touch(pair, poses, margin=SEAM) for poses in placed)
            if count >= ALWAYS * samples or overlap:
                self.left_out[self._name(pair)] = "always"
        self._pairs = [pair for pair in self._pairs if self._name(pair) not in self.left_out]

    def _balls_apart_at(self, placed: list[dict[int, Array]]) -> Array:
        """(samples, pairs) `_balls_apart` of every pair at each of those."""
        if not self._pairs or not placed:
            return np.empty((len(placed), len(self._pairs)))
        poses = np.array([[pose[index] for index in range(len(self._names))] for pose in placed])
        centers = np.einsum("snij,nj->sni", poses[..., :3, :3], np.array(self._centers)) + poses[..., :3, 3]
        first, second = np.array([(pair.first, pair.second) for pair in self._pairs]).T
        radii = np.array(self._radii)
        apart: Array = (
            np.linalg.norm(centers[:, first] - centers[:, second], axis=2) - radii[first] - radii[second]
        )
        return apart

    def _find(self, first: str, second: str) -> _PairOfLinks:
        for a, b in ((first, second), (second, first)):
            if (a, b) in self._by_name:
                return self._by_name[a, b]
        raise ValueError(f"the pair ({first}, {second}) is not checked; see `pairs` and `left_out`")

    def _name(self, pair: _PairOfLinks) -> Pair:
        return self._names[pair.first], self._names[pair.second]

    def _poses(self, q: Array, pair: _PairOfLinks | None = None) -> dict[int, Array]:
        wanted = range(len(self._names)) if pair is None else (pair.first, pair.second)
        return {index: self.robot.pose(q, self._names[index]) for index in wanted}

    def _closest(self, q: Array, best: SelfClearance, sample: float) -> SelfClearance:
        """The closest pair at q, or `best` if none is closer."""
        poses = self._poses(q)
        for pair in self._pairs:
            if self._balls_apart(pair, poses) < best.distance:
                distance = self._measure(pair, poses)
                if distance < best.distance:
                    best = SelfClearance(distance, self._name(pair), sample)
        return best

    def _balls_apart(self, pair: _PairOfLinks, poses: dict[int, Array]) -> float:
        """The gap between the bounding balls of two links: no more than their distance."""
        a, b = (
            poses[index][:3, :3] @ self._centers[index] + poses[index][:3, 3]
            for index in (pair.first, pair.second)
        )
        return float(np.linalg.norm(a - b)) - self._radii[pair.first] - self._radii[pair.second]

    def _measure(self, pair: _PairOfLinks, poses: dict[int, Array]) -> float:
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        request.enable_signed_distance = False
        return max(0.0, float(coal.distance(*self._placed(pair, poses), request, result)))

    def _touch(self, pair: _PairOfLinks, poses: dict[int, Array], *, margin: float = 0.0) -> bool:
        if self._balls_apart(pair, poses) > margin:
            return False
        request, result = coal.CollisionRequest(), coal.CollisionResult()
        request.security_margin = margin
        return bool(coal.collide(*self._placed(pair, poses), request, result))

    def _placed(self, pair: _PairOfLinks, poses: dict[int, Array]) -> tuple[object, ...]:
        placed: list[object] = []
        for index in (pair.first, pair.second):
            X = poses[index]
            placed += [self._models[index], coal.Transform3s(X[:3, :3], X[:3, 3])]
        return tuple(placed)


def _joints_above(robot: Robot, joint: int) -> frozenset[int]:
    """The joints from the world to a joint, that joint included."""
    found = set()
    while joint >= 0:
        found.add(joint)
        joint = robot.joints[joint].parent
    return frozenset(found)


class _AlongPath:
    """Pairs of parts along a path, see `sweep.Pairs`."""

    def __init__(self, check: SelfCollision, path: Array) -> None:
        self._check, self._path = check, path
        self._walked = np.concatenate(
            [np.zeros((1, path.shape[1])), np.cumsum(np.abs(np.diff(path, axis=0)), axis=0)]
        )

    def progress(self) -> Array:
        total: Array = self._walked.sum(axis=1)
        return total

    def gaps(self, positions: Array) -> Array:
        parts = self._check._parts
        _, a, b = np.array(self._check._pairs_of_parts, dtype=int).reshape(-1, 3).T
        centers = parts.centers(self._path, positions)
        apart: Array = np.linalg.norm(centers[:, a] - centers[:, b], axis=2) - parts.radii[a] - parts.radii[b]
        return apart

    def travel_to(self, positions: Array) -> Array:
        travel: Array = interpolate_many(self._walked, positions) @ self._check._travel.T
        return travel

    def travel(self, k: int) -> Array:
        travel: Array = self._walked @ self._check._travel[k]
        return travel

    def at_least(self, k: int, position: float) -> float:
        index, a, b = self._check._pairs_of_parts[k]
        pair, parts = self._check._pairs[index], self._check._parts.parts
        poses = self._check._poses(interpolate(self._path, position), pair)
        X_a, X_b = (coal.Transform3s(X[:3, :3], X[:3, 3]) for X in (poses[pair.first], poses[pair.second]))
        return hulls_apart(parts[a].shape, X_a, parts[b].shape, X_b)

    def measure(self, k: int, position: float) -> float:
        pair = self._check._pairs[self._check._pairs_of_parts[k][0]]
        return self._check._measure(pair, self._check._poses(interpolate(self._path, position), pair))
