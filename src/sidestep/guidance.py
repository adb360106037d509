"""Motion that always arrives where there is a way: a guide above the recommended system."""

from __future__ import annotations

import time as clock
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sidestep import presets
from sidestep._core import (
    ClearanceTable,
    GeometricSystem,
    Guidance,
    Guide,
    GuideStatus,
    JointGoal,
    Obstacles,
    PlannerSettings,
    RouteSettings,
    Step,
    real_array,
)
from sidestep.body import Body
from sidestep.link_pairs import tables_and_pairs
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]
LinkPairs = Sequence[tuple[str, str] | tuple[str, str, float]]


@dataclass(frozen=True, eq=False)
class GuidedStep:
    """What a step of a guided motion gives.

    Attributes:
        acceleration: (nv,) [rad/s^2] to apply. status: what the motion is about.
        goal: the attractor that the arm is drawn to. step: of the geometric system.
    """

    acceleration: Array
    status: GuideStatus
    goal: JointGoal
    step: Step


class GuidedMotion:
    """Give a goal, get motion: it arrives, or says why it cannot.

    A `Guide` searches a path in the background and leads the attractor of a `GeometricSystem` along it; the
    system keeps the arm safe at every step, with or without a path.

    Args:
        robot: the arm. body: a covering body of it; by default `Body.cover(robot)`.
        system: what moves the arm; by default `presets.barrier_system`.
        planner, route: of the guide; None for the defaults.
        pairs, tables: links that must not touch; if neither is given `sidestep.link_pairs.tables_and_pairs`.
        duration: time [s] after which the status is `timeout`.
        seed, synchronous: of the guide; synchronous motions are the same every time.

    Raises:
        ValueError: a setting out of range, or a body of another robot.
    """

    def __init__(
        self,
        robot: Robot,
        body: Body | None = None,
        *,
        system: GeometricSystem | None = None,
        planner: PlannerSettings | None = None,
        route: RouteSettings | None = None,
        pairs: LinkPairs | None = None,
        tables: Sequence[ClearanceTable] | None = None,
        duration: float = float("inf"),
        seed: int = 0,
        synchronous: bool = False,
    ) -> None:
        body = body if body is not None else Body.cover(robot)
        if pairs is None and tables is None:
            tables, pairs = tables_and_pairs(robot, body)
        self.system = system if system is not None else presets.barrier_system(robot, body)
        self.guide = Guide(
            robot,
            body,
            pairs=list(pairs or ()),
            tables=list(tables or ()),
            planner=planner,
            route=route,
            duration=duration,
            seed=seed,
            synchronous=synchronous,
        )
        self._goal = np.zeros(robot.num_coordinates)
        self._moving = self.system
        self._relaxed: tuple[bytes, Obstacles] | None = None  # where, and among what
        self._next_look = -float("inf")

    @property
    def moving(self) -> GeometricSystem:
        """The system with barriers that leave room where the arm has to come close, as of the last step.

        Relaxed at the narrow places of the path ahead, and at the goal where there is none and at the end, unless
        something that moves is near (`Guide.disturbed`); never below the barriers' floors, see
        `GeometricSystem.relaxed_at`.
        """
        return self._moving

    @property
    def places(self) -> npt.NDArray[np.float64]:
        """The configurations (k, nv) [rad | m] at which `moving` is relaxed, in turn."""
        key = b"" if self._relaxed is None else self._relaxed[0]
        return np.frombuffer(key).reshape(-1, len(self._goal))

    def set_goal(self, goal: npt.ArrayLike) -> None:
        """A configuration (nv,) [rad] to go to from now on."""
        self.guide.set_goal(goal)
        self._goal = real_array(goal, "goal").copy()
        self._next_look = -float("inf")

    def step(
        self, q: npt.ArrayLike, v: npt.ArrayLike, obstacles: Obstacles, *, time: float | None = None
    ) -> GuidedStep:
        """One step of the loop.

        Args:
            q, v: (nv,) [rad, rad/s]. obstacles: as they are seen now.
            time: [s], not going back; by default that of the machine's clock.
        """
        at = clock.monotonic() if time is None else time
        guidance = self.lead(q, obstacles, at)
        step = self._moving.acceleration(q, v, guidance.goal, obstacles)
        return GuidedStep(step.acceleration, guidance.status, guidance.goal, step)

    def lead(self, q: npt.ArrayLike, obstacles: Obstacles, time: float) -> Guidance:
        """The guide's part of a step alone: where to be drawn to."""
        looks = time >= self._next_look
        if looks:
            self.guide.set_obstacles(obstacles)
            self._next_look = time + self.guide.period
        guidance = self.guide.step(q, time)
        if looks:
            self._relax(guidance, q, obstacles)
        return guidance

    def _relax(self, guidance: Guidance, q: npt.ArrayLike, obstacles: Obstacles) -> None:
        known = guidance.status is not GuideStatus.idle and np.all(np.isfinite(q))
        if not known or self.guide.disturbed(q, obstacles):
            self._moving, self._relaxed = self.system, None
            return
        places = [*guidance.places, *([self._goal] if guidance.arrives else [])]
        key = np.concatenate(places).tobytes()
        if self._relaxed is None or key != self._relaxed[0] or not _same(obstacles, self._relaxed[1]):
            self._moving = self.system
            for place in places:
                self._moving = self._moving.relaxed_at(place, obstacles)
            self._relaxed = key, obstacles


def _same(a: Obstacles, b: Obstacles) -> bool:
    """What rests is the same."""
    if a is b:
        return True
    rest, before = (~np.any(x.velocities, axis=1) for x in (a, b))
    return np.array_equal(a.points[rest], b.points[before]) and np.array_equal(a.radii[rest], b.radii[before])
