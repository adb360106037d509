"""What every benchmark problem has, whatever it was made from."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
import numpy.typing as npt

from sidestep._core import Obstacles
from sidestep.distance import ExactClearance, SceneObject
from sidestep.distance.scene import AWAY
from sidestep.math.pose import pose_vector

Array = npt.NDArray[np.float64]

JUMP = 1.0  # [m] between two samples: what moves so far came or went
LINE_TOLERANCE = 5e-3  # [m] of the clearance of a straight line, which only says whether a problem is easy


class Problem(Protocol):
    """Get from start to goal among solids, of which the controller sees points."""

    @property
    def index(self) -> int:
        """Its number."""

    @property
    def start(self) -> Array:
        """(nv,) [rad | m], at rest."""

    @property
    def goal(self) -> Array:
        """(nv,) [rad | m]."""

    @property
    def objects(self) -> tuple[SceneObject, ...]:
        """The solids, by which the motion is judged."""

    @property
    def straight_line_blocked(self) -> bool:
        """The straight line in joint space touches a solid where it was at time 0."""

    @property
    def changes(self) -> tuple[float, ...]:
        """Times [s], rising, at which something comes or goes; between them points move at their velocities."""

    def obstacles_at(self, time: float) -> Obstacles:
        """What the controller sees at a time [s]."""


def poses_over(objects: Sequence[SceneObject], times: Array) -> Array:
    """Where solids that nothing touches are at times (T,) [s]: (T, N, 7) as `ExactClearance` takes them."""
    poses = np.broadcast_to(
        np.array([pose_vector(item.pose) for item in objects]).reshape(-1, 7), (len(times), len(objects), 7)
    ).copy()
    for k, item in enumerate(objects):
        if item.motion == "moving":
            begin, end = item.moves_during
            since = np.clip(np.minimum(times, end) - begin, 0.0, None)
            poses[:, k, :3] += since[:, None] * item.velocity
            poses[:, k, 2] -= AWAY * ((times < item.present[0]) | (times >= item.present[1]))
    return poses


def between_jumps(poses: Array) -> list[tuple[int, int]]:
    """The stretches [first, last) of poses (T, N, 7) in which no solid comes or goes: no path leads there."""
    shifts = np.abs(np.diff(poses[:, :, :3], axis=0)).max(axis=(1, 2), initial=0.0)
    cuts = [0, *(np.flatnonzero(shifts > JUMP) + 1).tolist(), len(poses)]
    return list(itertools.pairwise(cuts))


@dataclass(frozen=True, eq=False)
class SceneProblem:
    """A problem among solids that stay where they are, seen as the same points all the time.

    Attributes:
        name: of its set. index: its number there. start, goal: (nv,) [rad | m].
        clearance: exact, of the arm among the solids.
        obstacles: points that cover their surfaces.
    """

    name: str
    index: int
    start: Array
    goal: Array
    clearance: ExactClearance
    obstacles: Obstacles
    changes: tuple[float, ...] = ()

    @property
    def objects(self) -> tuple[SceneObject, ...]:
        """The solids."""
        return self.clearance.objects

    @cached_property
    def straight_line_blocked(self) -> bool:
        """The straight line in joint space touches a solid, to within 5 mm."""
        line = self.clearance.minimum_over(np.array([self.start, self.goal]), tolerance=LINE_TOLERANCE)
        return line.clearance.distance <= 0.0

    def obstacles_at(self, time: float) -> Obstacles:
        """The points."""
        return self.obstacles
