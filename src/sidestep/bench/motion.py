"""One motion of a method through a problem: integrated, or under torque control in MuJoCo."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from sidestep import _core
from sidestep._core import (
    Controller,
    ControllerSettings,
    PlanStatus,
    integrate,
)
from sidestep.arm.tight_places import tight_links
from sidestep.bench.problem import Problem, poses_over
from sidestep.robot import Robot, tip_of
from sidestep.robot.tolerance import tolerances
from sidestep.robot.turns import ways_to
from sidestep.simulation import Adapter, Arrival, ControllerAdapter, Simulation, StepRecord
from sidestep.simulation.pose_target import PoseTarget

Array = npt.NDArray[np.float64]

CHUNK = 1.0  # [s] integrated between two looks at arrival
POSE_TOLERANCE = 1e-3, math.radians(0.5)  # [m] and [rad] of a pose goal; the defaults of `ArrivalSettings`
FIRST_CHUNK = 0.02  # [s] the same until there is a path: a look of the planner


@dataclass(frozen=True)
class MotionSettings:
    """How problems are run.

    Attributes:
        period: control period [s]. duration: after it the arm has not arrived [s].
        tolerance: it has arrived once every joint is this close to the goal [rad], see `tolerances` of sliding joints.
        torque: under torque control in MuJoCo, with the real masses, instead of integrated.
        poses: the goal is the pose that the tip (`tip_of`) has at the goal configuration, in any posture: within
            `POSE_TOLERANCE`, in place of the tolerance.

    Raises:
        ValueError: a number that is not positive.
    """

    period: float = 0.001
    duration: float = 30.0
    tolerance: float = 0.05
    torque: bool = False
    poses: bool = False

    def __post_init__(self) -> None:
        for name in ("period", "duration", "tolerance"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} is {value}, must be positive and finite")


@dataclass(frozen=True, eq=False)
class Motion:
    """What happened, up to arrival or the end: T rows, one per period.

    Attributes:
        q, v, a: (T, nv); a is the change of v over the period, except in the last row.
        object_poses: (T, N, 7) of the solids.
        torque: (T, nv), or None where there was none.
        contacts: of MuJoCo, 0 without physics.
        arrived: within the duration.
        step_seconds: wall time [s] of steps, as a caller sees them: in the core, or from Python in MuJoCo.
        first_path_seconds: wall time [s] until the first path; None where none was found.
        planning_seconds: the same until it was improved.
        ended: what the controller was about at the end, see `Activity`; empty without a controller.
        safe: clearances bound every command, as the controller's do.
        pose_error: at the end, of a pose goal: [m] and [rad].
        tight: where it did not arrive, links that may need a finer cover, and how many ellipsoids: `tight_links`.
    """

    q: Array
    v: Array
    a: Array
    object_poses: Array
    torque: Array | None
    contacts: int
    arrived: bool
    step_seconds: Array
    first_path_seconds: float | None = None
    planning_seconds: float | None = None
    ended: str = ""
    safe: bool = False
    pose_error: tuple[float, float] | None = None
    tight: Mapping[str, int] = field(default_factory=dict)

    @property
    def first_motion_seconds(self) -> float:
        """Wall time [s] from the request to the first command."""
        return float(self.step_seconds[0])

    @property
    def path_length(self) -> float:
        """Sum of |dq| [rad | m], Euclidean, up to the end."""
        return float(np.linalg.norm(np.diff(self.q, axis=0), axis=1).sum())


class ProblemRunner(Protocol):
    """What moves an arm through problems."""

    def move(self, problem: Problem, settings: MotionSettings) -> Motion:
        """Runs one problem."""


@dataclass(frozen=True, eq=False)
class ControllerRunner:
    """The `Controller`, one for every problem, with the settings given in place of its defaults."""

    robot: Robot
    arm: _core.Arm
    settings: Mapping[str, Any] = field(default_factory=dict)

    def move(self, problem: Problem, settings: MotionSettings) -> Motion:
        """Runs one problem."""
        controller = Controller(
            self.arm,
            ControllerSettings(
                synchronous=True,
                seed=problem.index,
                period=settings.period,
                output="torque" if settings.torque else "acceleration",
                **self.settings,
            ),
        )
        pose = None
        if settings.poses:
            tip = tip_of(self.robot)
            pose = PoseTarget(self.robot, tip, self.robot.pose(problem.goal, tip))
        controller.set_goal(problem.goal if pose is None else pose.goal)
        if settings.torque:
            driver = ControllerAdapter(controller, _Changing(problem))
            motion = under_torque(self.robot, driver, problem, settings, pose)
            return self._told(motion, _planned(controller), controller, pose)
        columns = Columns(self.robot, problem, settings)
        q, v = problem.start, np.zeros_like(problem.start)
        seen = _Changing(problem)
        planned = _planned(controller)
        while steps := columns.next_steps(FIRST_CHUNK if planned is None else CHUNK):
            obstacles = seen(columns.done * settings.period)
            if obstacles is not None:
                controller.set_obstacles(obstacles, valid_for=np.inf)
            goal = problem.goal if pose is None else None
            part = integrate(controller, q, v, steps=steps, goal=goal, tolerance=settings.tolerance)
            near = columns.near(part.q) if pose is None else _at_pose(pose, part.q)
            columns.add(part.q, part.v, part.acceleration, part.step_seconds, near)
            q, v = part.last_q, part.last_v
            if planned is None:
                planned = _planned(controller)
        motion = columns.motion(problem)
        return self._told(motion, planned, controller, pose)

    def _told(
        self,
        motion: Motion,
        planned: tuple[float, float] | None,
        controller: Controller,
        pose: PoseTarget | None = None,
    ) -> Motion:
        """A motion with what its controller knows of it."""
        first, improved = (None, None) if planned is None else planned
        return replace(
            motion,
            first_path_seconds=first,
            planning_seconds=improved,
            ended="arrived" if motion.arrived else controller.command.activity.name,
            safe=True,
            pose_error=None if pose is None else pose.errors(motion.q[-1]),
            tight={} if motion.arrived else tight_links(controller, self.arm),
        )


def _at_pose(pose: PoseTarget, q: Array) -> npt.NDArray[np.bool_]:
    """Which of the rows (T, nv) have the pose; from the last on, as long as it does not."""
    near = np.zeros(len(q), dtype=bool)
    for k in reversed(range(len(q))):
        distance, angle = pose.errors(q[k])
        near[k] = distance < POSE_TOLERANCE[0] and angle < POSE_TOLERANCE[1]
        if not near[k]:
            break
    return near


def _planned(controller: Controller) -> tuple[float, float] | None:
    """Wall time [s] until the first path, and until it was improved; None before there is one."""
    plan = controller.plan
    if plan.status != PlanStatus.found:
        return None
    return plan.search_seconds, plan.search_seconds + plan.improvement_seconds


class _Changing:
    """What is seen of a problem when something comes or goes; between, points move by their velocities."""

    def __init__(self, problem: Problem) -> None:
        self._problem, self._looks = problem, [0.0, *problem.changes]

    def __call__(self, time: float) -> _core.Obstacles | None:
        """The obstacles at a time [s] that does not go back; None where they are as told before."""
        if not self._looks or time < self._looks[0]:
            return None
        while self._looks and time >= self._looks[0]:
            self._looks.pop(0)
        return self._problem.obstacles_at(time)


class Columns:
    """The rows of a motion as it is integrated, up to arrival."""

    def __init__(self, robot: Robot, problem: Problem, settings: MotionSettings) -> None:
        self._robot, self._goal, self._settings = robot, problem.goal, settings
        self._tolerances = tolerances(robot, settings.tolerance)
        self._total = max(1, round(settings.duration / settings.period))
        self._changes = problem.changes
        self._rows: list[tuple[Array, Array, Array]] = []
        self._times: list[Array] = []
        self.done, self.arrived = 0, False

    def next_steps(self, span: float) -> int:
        """How many steps come next [s]: not beyond a change of the scene; 0 at the end."""
        if self.arrived:
            return 0
        period = self._settings.period
        changes = (math.ceil(at / period) - self.done for at in self._changes)
        steps = (max(1, round(span / period)), self._total - self.done, *(n for n in changes if n > 0))
        return max(0, min(steps))

    def near(self, q: Array) -> npt.NDArray[np.bool_]:
        """Which of the rows (T, nv) are at the goal configuration."""
        away = ways_to(self._robot, q, self._goal)
        return np.asarray((away < self._tolerances).all(axis=1))

    def add(self, q: Array, v: Array, a: Array, seconds: Array, near: npt.NDArray[np.bool_]) -> None:
        """Rows that came next, and which of them are at the goal."""
        keep = len(q)
        if near.any():
            keep, self.arrived = int(near.argmax()) + 1, True
        self._rows.append((q[:keep], v[:keep], a[:keep]))
        self._times.append(seconds[:keep])
        self.done += keep

    def motion(self, problem: Problem) -> Motion:
        """All of it."""
        q, v, a = (np.concatenate(columns) for columns in zip(*self._rows, strict=True))
        poses = poses_over(problem.objects, np.arange(len(q), dtype=np.float64) * self._settings.period)
        return Motion(q, v, a, poses, None, 0, self.arrived, np.concatenate(self._times))


class _Timed:
    """A driver with a clock around it."""

    def __init__(self, driver: Adapter) -> None:
        self._driver = driver
        self.seconds: list[float] = []

    def drive(self, time_: float, q: Array, v: Array, mass_matrix: Array, bias: Array) -> StepRecord:
        """The driver's own."""
        begin = time.perf_counter()
        result = self._driver.drive(time_, q, v, mass_matrix, bias)
        self.seconds.append(time.perf_counter() - begin)
        return result


def under_torque(
    robot: Robot,
    driver: Adapter,
    problem: Problem,
    settings: MotionSettings,
    pose: PoseTarget | None = None,
) -> Motion:
    """Runs one problem in MuJoCo; pose: in place of the goal configuration."""
    simulation = Simulation(robot, problem.objects, timestep=settings.period, visuals=False)
    timed = _Timed(driver)
    run = simulation.run(
        timed,
        problem.start,
        problem.goal if pose is None else pose,
        settings.duration,
        arrival=Arrival(
            position=settings.tolerance if pose is None else POSE_TOLERANCE[1],
            distance=POSE_TOLERANCE[0],
            speed=float("inf"),
            hold=0.0,
        ),
    )
    return Motion(
        run.q,
        run.v,
        run.achieved,
        run.object_poses,
        run.torque,
        len(run.contacts),
        run.arrived,
        np.array(timed.seconds),
    )


# Their names in 0.2.
Mover: TypeAlias = ProblemRunner
ControllerMover: TypeAlias = ControllerRunner
