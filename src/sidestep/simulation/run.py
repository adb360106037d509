"""The record of a motion, with physics or without: what evaluation, plots and animations read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from sidestep._core import Obstacles
from sidestep.distance.scene import SceneObject
from sidestep.obstacles import obstacles_from_shapes
from sidestep.obstacles.scene import Seen
from sidestep.robot import Robot
from sidestep.robot.tolerance import tolerances
from sidestep.robot.turns import ways_to
from sidestep.simulation.pose_target import PoseTarget

Array = npt.NDArray[np.float64]
ObstacleSource: TypeAlias = Seen | Callable[[float], Obstacles]


@dataclass(frozen=True)
class Arrival:
    """When a run counts as arrived and may stop.

    Attributes:
        position: largest joint error [rad], see `tolerances` of sliding joints; of a pose goal the angle [rad].
        distance: of a pose goal [m].
        speed: largest joint speed [rad/s | m/s].
        hold: for how long both must hold [s].
    """

    position: float = 0.02
    speed: float = 0.02
    hold: float = 0.2
    distance: float = 0.005

    def __post_init__(self) -> None:
        if not (min(self.position, self.speed, self.distance) > 0.0 and self.hold >= 0.0):
            raise ValueError(f"arrival tolerances must be positive and hold not negative, got {self}")


@dataclass(frozen=True)
class Contact:
    """One contact point between the arm and the scene that MuJoCo found in one step.

    Attributes:
        time: [s]; link and obstacle: names; depth: overlap [m]; force: normal force [N].
    """

    time: float
    link: str
    obstacle: str
    depth: float
    force: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Run:
    """Time series of a motion, one row per control step, T rows.

    Attributes:
        robot, objects: what moved, among what.
        start, goal: (nv,). pose: that was to be reached, where `goal` is the configuration at the end.
        timestep: control period [s]; time: (T,) [s].
        q, v: (T, nv) state at the beginning of each step.
        wanted: (T, nv) acceleration that was asked for, before any limit.
        achieved: (T, nv) change of v over the step divided by the period.
        switch: (T, num_switches); values: (T, m) embedding values psi.
        system_status: T names: of an activity of the `Controller`, or a status of the geometric system.
        object_poses: (T, num_objects, 7) position and quaternion (w, x, y, z) in the world.
        arrived: the run stopped because it arrived; time_to_goal: when it had, [s], or None.
    """

    robot: Robot
    objects: tuple[SceneObject, ...]
    start: Array
    goal: Array
    timestep: float
    time: Array
    q: Array
    v: Array
    wanted: Array
    achieved: Array
    switch: Array
    values: Array
    system_status: tuple[str, ...]
    object_poses: Array
    arrived: bool
    time_to_goal: float | None
    pose: PoseTarget | None = None

    def __len__(self) -> int:
        return len(self.time)


@dataclass(frozen=True, eq=False, kw_only=True)
class SimulationRun(Run):
    """A run under torque control in MuJoCo.

    Attributes:
        solved: (T, nv) acceleration that the quadratic program chose.
        torque: (T, nv) [Nm | N] applied.
        controller_status: T names: of a status of the `Controller`, or of the torque program.
        contacts: every arm-scene contact point of every physics step, in time order.
    """

    solved: Array
    torque: Array
    controller_status: tuple[str, ...]
    contacts: tuple[Contact, ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class KinematicRun(Run):
    """A run without physics."""


@dataclass
class ArrivalWatch:
    """Follows a motion and says when it has arrived."""

    goal: Array | PoseTarget
    rule: Arrival
    robot: Robot
    since: float | None = field(default=None, init=False)

    def update(self, time: float, q: Array, v: Array) -> bool:
        """True once error and speed have been small for the rule's hold time; `since` is when that began."""
        if isinstance(self.goal, PoseTarget):
            distance, angle = self.goal.errors(q)
            near = distance < self.rule.distance and angle < self.rule.position
        else:
            limits = tolerances(self.robot, self.rule.position)
            near = bool((ways_to(self.robot, q, self.goal) < limits).all())
        near = near and bool(np.abs(v).max() < self.rule.speed)
        if not near:
            self.since = None
        elif self.since is None:
            self.since = time
        return self.since is not None and time - self.since >= self.rule.hold


def obstacles_over_time(obstacles: ObstacleSource) -> Callable[[float], Obstacles]:
    """What the controller sees as a function of time [s]; points move along their velocities from time 0."""
    if callable(obstacles):
        return obstacles
    seen = obstacles_from_shapes(obstacles)
    points, radii, velocities = seen.points, seen.radii, seen.velocities
    if not np.any(velocities):
        return lambda time: seen
    names, counts = zip(*((name or "", count) for name, count in seen.groups), strict=True)
    return lambda time: Obstacles(points + time * velocities, radii, velocities).named(names, counts)


def status_name(status: object) -> str:
    """The name of a status, enumerated or plain."""
    return str(getattr(status, "name", status))
