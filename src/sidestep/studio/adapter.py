"""What moves the arm in the studio: the `Controller`, or another method."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt

from sidestep._core import (
    Activity,
    Controller,
    ControllerSettings,
    GeometricSystem,
    Obstacles,
    PoseGoal,
    SafetyStatus,
)
from sidestep.arm import Arm
from sidestep.loop import ModelLoop
from sidestep.robot import Robot
from sidestep.simulation.pose_target import IkSolution, PoseTarget
from sidestep.simulation.run import status_name
from sidestep.studio.reason import EventRecord, Reason, binding, limit_in_words, reason_of

Array = npt.NDArray[np.float64]

NEAR_GOAL = 0.05  # [rad | m] in every joint counts as arriving
STILL = 1e-3  # [m/s] an obstacle slower than this is at rest
ASIDE = 1e-4  # [m] farther from where its velocity has brought it, an obstacle is told anew


@dataclass(frozen=True, eq=False)
class StepRecord:
    """What an adapter says of its last step.

    Attributes:
        words: what the arm does. status: of the command. activity: what the command is about, "" of other methods.
        nearest: (name of link or "", clearance [m] that is measured; inf where none is).
        values: psi (m,). metric: (nv, nv). activations: (m,) clearances at which barriers begin; empty without any.
        reason: what draws the arm, and what holds it back.
    """

    words: str
    status: str = ""
    activity: str = ""
    nearest: tuple[str, float] = ("", float("inf"))
    values: Array = field(default_factory=lambda: np.zeros(0))
    metric: Array = field(default_factory=lambda: np.zeros((0, 0)))
    activations: Array = field(default_factory=lambda: np.zeros(0))
    reason: Reason = field(default_factory=Reason)


class Adapter(Protocol):
    """Moves the arm of a session by one method."""

    @property
    def posture(self) -> IkSolution | None:
        """Where the arm is led to; None where no posture for the pose is found yet."""

    @property
    def system(self) -> GeometricSystem:
        """Whose curved space the page can show."""

    @property
    def metric(self) -> Array:
        """(nv, nv) of the last step."""

    def set_goal(self, pose: Array | None, q: Array, *, thorough: bool) -> None:
        """Goes to q (nv,), or to a pose (4, 4) by a posture that is looked for near q; thorough: from everywhere."""

    def step(self, q: Array, v: Array, mass_matrix: Array, bias: Array, obstacles: Obstacles) -> Array:
        """The torque (nv,) [Nm | N] of one period."""

    def look(self, q: Array, v: Array, obstacles: Obstacles) -> None:
        """Takes a step without time passing."""

    def record(self) -> StepRecord | None:
        """Of the last step; None before one."""

    def event_record(self) -> EventRecord | None:
        """What events are told of, of the last step; None where there are none."""


class ControllerAdapter:
    """A `Controller`, told what it sees where that is not as it was told before.

    Args:
        robot: the arm, arm: what is prepared of it. settings: of the controller. tip: the frame whose pose is a goal.

    Raises:
        ValueError: names the setting at fault.
    """

    def __init__(self, robot: Robot, arm: Arm, settings: ControllerSettings, tip: str) -> None:
        self._robot, self._arm, self._settings, self._tip = robot, arm, settings, tip
        self._controller = Controller(arm, settings)
        self._loop = ModelLoop(self._controller)
        self._time = 0.0  # [s] that the simulation has run
        self._told: Obstacles | None = None
        self._said: Controller | None = None  # took the last step
        self._seen, self._q = Obstacles.none(), np.array(robot.neutral)  # of that step
        self._scene_is_known, self._has_camera = True, False

    @property
    def controller(self) -> Controller:
        """That which moves the arm."""
        return self._controller

    @property
    def time(self) -> float:
        """Of its last step, on its clock [s]."""
        return self._time

    def set_known(self, *, scene: bool, camera: bool) -> None:
        """What the controller is told of: the scene, or only what a camera sees; and whether there is a camera."""
        self._scene_is_known, self._has_camera = scene, camera

    def set_arm(self, arm: Arm) -> None:
        """Another body for the same joints, as a finer one; the controller goes on."""
        self._arm = arm
        self._controller.set_arm(arm)

    def set_goal(self, pose: Array | None, q: Array, *, thorough: bool) -> None:
        """Goes to q (nv,), or to a pose (4, 4) by a posture that is looked for near q."""
        self._near = q
        self._aim = q if pose is None else PoseTarget(self._robot, self._tip, pose, rest=q)
        self._controller.set_goal(self._goal)
        last = self._controller.command
        if (last.status, last.activity) == (SafetyStatus.stopping, Activity.waiting):  # after a touch
            self._controller.restart()
        self._said = None

    @property
    def _goal(self) -> Array | PoseGoal:
        return self._aim.goal if isinstance(self._aim, PoseTarget) else self._aim

    def step(self, q: Array, v: Array, mass_matrix: Array, bias: Array, obstacles: Obstacles) -> Array:
        """The torque (nv,) [Nm | N] of one period."""
        if self._told is not None:
            self._told.advance(self._settings.period)
        if self._scene_is_known and (self._told is None or not alike(self._told, obstacles)):
            self._controller.set_obstacles(obstacles, valid_for=math.inf)  # they are where the page has them
            self._told = obstacles
        self._said, self._seen, self._q = self._controller, obstacles, q
        self._time += self._settings.period  # that of the simulation, which may be slower than real time
        return self._loop.cycle(q, v, mass_matrix, bias, time=self._time).torque

    def look(self, q: Array, v: Array, obstacles: Obstacles) -> None:
        """Takes a step without time passing: of another controller, that does not plan ahead."""
        settings = copy.copy(self._settings)
        settings.synchronous = True
        settings.planner = settings.look_ahead = settings.local_minimum = None
        if self._has_camera:
            obstacles = self._controller.obstacles if self._time else Obstacles.none()
        self._said = Controller(self._arm, settings)
        self._said.set_goal(self._goal)
        self._said.set_obstacles(obstacles, valid_for=math.inf)
        self._said.step(q, v)
        self._seen, self._q = obstacles, q

    @property
    def posture(self) -> IkSolution | None:
        """Where the arm is led to; None where no posture for the pose is found yet."""
        aim, found = self._aim, None if self._said is None else self._said.target
        if not isinstance(aim, PoseTarget):
            return IkSolution(aim)
        if found is not None:
            return IkSolution(found, *aim.errors(found))
        near = IkSolution(self._near, *aim.errors(self._near))
        return near if near.found else None

    @property
    def system(self) -> GeometricSystem:
        """Of the controller, see `Controller.system`."""
        return self._controller.system

    @property
    def metric(self) -> Array:
        """(nv, nv) of the last step."""
        return self._controller.geometric_step.metric

    def record(self) -> StepRecord | None:
        """Of the last step; None before one."""
        if self._said is None:
            return None
        command, step = self._said.command, self._said.geometric_step
        link = "" if command.coordinate < 0 else self._said.labels[command.coordinate].name
        return StepRecord(
            self._said.explain(),
            f"{status_name(command.status)}, {status_name(command.activity)}",
            status_name(command.activity),
            (link, command.clearance),
            step.values,
            step.metric,
            self._said.activations,
            reason_of(self._said, self._obstacles, self._q),
        )

    @property
    def _obstacles(self) -> Obstacles:
        """That the last step saw."""
        return self._said.obstacles if self._has_camera and self._said is not None else self._seen

    def event_record(self) -> EventRecord | None:
        """What events are told of, of the last step; None before one."""
        if self._said is None:
            return None
        command = self._said.command
        link, obstacle, _ = binding(self._said, self._obstacles)
        limit = limit_in_words(command.limits, self._robot.coordinate_names)
        return EventRecord(
            command.activity, command.avoiding, self._said.searches, link, obstacle, command.status, limit
        )


def alike(told: Obstacles, seen: Obstacles) -> bool:
    """Whether what was told, moved on along its velocities, is still what is seen."""
    return (
        told.groups == seen.groups
        and np.array_equal(told.radii, seen.radii)
        and float(np.abs(told.points - seen.points).max(initial=0.0)) <= ASIDE
        and float(np.abs(told.velocities - seen.velocities).max(initial=0.0)) <= STILL
    )
