"""One motion of a method through a problem: integrated, or under torque control in MuJoCo."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import (
    AccelerationFilter,
    Escape,
    Evasion,
    GeometricSystem,
    JointGoal,
    Obstacles,
    Plan,
    PlanStatus,
    TorqueController,
    rollout,
)
from sidestep.bench.method import Method
from sidestep.bench.problem import Problem, poses_over
from sidestep.guidance import GuidedMotion
from sidestep.robot import Robot
from sidestep.simulation import Arrival, Simulation

Array = npt.NDArray[np.float64]

CHUNK = 1.0  # [s] integrated between two looks at arrival


@dataclass(frozen=True)
class MotionSettings:
    """How problems are run.

    Attributes:
        period: control period [s]. duration: after it the arm has not arrived [s].
        tolerance: it has arrived once every joint is this close to the goal [rad | m].
        torque: under torque control in MuJoCo, with the real masses, instead of integrated.
        safe: clearances and limits bound the acceleration as well (`AccelerationFilter`, or the rows of the
            torque controller); for systems of barriers, as others have no clearances.
        escape: sub-goals where the arm is stuck (`Escape`), and barriers that leave a goal free among obstacles at rest
            (`GeometricSystem.relaxed_at`).
        evade: flights out of the way of what moves (`Evasion`); with `safe`.

    Raises:
        ValueError: a number that is not positive.
    """

    period: float = 0.001
    duration: float = 30.0
    tolerance: float = 0.05
    torque: bool = False
    safe: bool = False
    escape: bool = False
    evade: bool = False

    @classmethod
    def of(cls, method: Method, **numbers: Any) -> MotionSettings:
        """With all that belongs to a method; `numbers` are period, duration, tolerance and torque."""
        return cls(safe=method.safe, escape=method.escapes, evade=method.evades, **numbers)

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
        step_seconds: wall time [s] of steps: of the system alone, or with torque control of both from Python.
        first_path_seconds: wall time [s] until the first path; None where none was found.
        planning_seconds: the same until it was improved.
        ended: what the guide said at the end, see `GuideStatus`; empty without a guide.
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

    @property
    def first_motion_seconds(self) -> float:
        """Wall time [s] from the request to the first command."""
        return float(self.step_seconds[0])

    @property
    def path_length(self) -> float:
        """Sum of |dq| [rad | m], Euclidean, up to the end."""
        return float(np.linalg.norm(np.diff(self.q, axis=0), axis=1).sum())


def move(
    robot: Robot,
    system: GeometricSystem,
    problem: Problem,
    settings: MotionSettings,
    *,
    guided: GuidedMotion | None = None,
) -> Motion:
    """Runs one problem; with `guided`, made for it alone, a guide leads the goal of the system."""
    run = _under_torque if settings.torque else _integrated
    if guided is None:
        return run(robot, system, problem, settings, None)
    guided.set_goal(problem.goal)
    led = _Led(guided)
    motion = run(robot, system, problem, settings, led)
    plan = led.first_plan
    return replace(
        motion,
        first_path_seconds=None if plan is None else plan.search_seconds,
        planning_seconds=None if plan is None else plan.search_seconds + plan.improvement_seconds,
        ended="arrived" if motion.arrived else led.status,
    )


def _integrated(
    robot: Robot,
    system: GeometricSystem,
    problem: Problem,
    settings: MotionSettings,
    guided: _Led | None,
) -> Motion:
    look = CHUNK if guided is None else guided.period
    total, chunk = (max(1, round(span / settings.period)) for span in (settings.duration, look))
    q, v = problem.start, np.zeros_like(problem.start)
    relaxed, escape, evasion = _prepared(robot, system, problem, settings)
    guard = AccelerationFilter(robot, period=settings.period) if settings.safe else None
    rows: list[tuple[Array, Array, Array]] = []
    times: list[Array] = []
    done, arrived = 0, False
    while done < total and not arrived:
        changes = (math.ceil(at / settings.period) - done for at in problem.changes)
        steps = min(chunk, total - done, *(steps for steps in changes if steps > 0))
        at = done * settings.period
        obstacles = problem.obstacles_at(at)
        goal = problem.goal if guided is None else guided.goal(q, obstacles, at)
        part = rollout(
            relaxed.at(at) if guided is None else guided.moving,
            q,
            v,
            goal,
            obstacles,
            period=settings.period,
            steps=steps,
            time_steps=True,
            filter=guard,
            escape=escape,
            evasion=evasion,
        )
        near = np.abs(part.q - problem.goal).max(axis=1) < settings.tolerance
        keep = steps
        if near.any():
            keep, arrived = int(near.argmax()) + 1, True
        # The last row is where the next part begins; only at the end of the motion is it kept here.
        last = keep + 1 if not arrived and done + steps == total else keep
        rows.append((part.q[:last], part.v[:last], part.acceleration[:last]))
        times.append(part.step_seconds[:last])
        q, v = part.q[steps], part.v[steps]
        done += keep
    q, v, a = (np.concatenate(columns) for columns in zip(*rows, strict=True))
    poses = poses_over(problem.objects, np.arange(len(q), dtype=np.float64) * settings.period)
    return Motion(q, v, a, poses, None, 0, arrived, np.concatenate(times))


def _under_torque(
    robot: Robot,
    system: GeometricSystem,
    problem: Problem,
    settings: MotionSettings,
    guided: _Led | None,
) -> Motion:
    simulation = Simulation(robot, problem.objects, timestep=settings.period, visuals=False)
    relaxed, escape, evasion = _prepared(robot, system, problem, settings)
    timer = _Timer()
    run = simulation.run(
        _TimedSystem(relaxed, timer, settings.period, guided),
        _TimedController(TorqueController(robot, period=settings.period), timer),
        problem.start,
        problem.goal,
        settings.duration,
        problem.obstacles_at,
        arrival=Arrival(position=settings.tolerance, speed=float("inf"), hold=0.0),
        safe=settings.safe,
        escape=escape,
        evasion=evasion,
    )
    return Motion(
        run.q,
        run.v,
        run.achieved,
        run.object_poses,
        run.torque,
        len(run.contacts),
        run.arrived,
        np.array(timer.steps),
    )


def _prepared(
    robot: Robot,
    system: GeometricSystem,
    problem: Problem,
    settings: MotionSettings,
) -> tuple[_Relaxed, Escape | None, Evasion | None]:
    relaxed = _Relaxed(system, problem, relax=settings.escape)
    escape = Escape(robot, seed=problem.index) if settings.escape else None
    return relaxed, escape, Evasion(system, seed=problem.index) if settings.evade else None


class _Relaxed:
    """The system with barriers that leave the goal free, again whenever something comes or goes."""

    def __init__(self, system: GeometricSystem, problem: Problem, *, relax: bool) -> None:
        self._system, self._problem = system, problem
        self._looks = [0.0, *problem.changes] if relax else []
        self._current = system

    def at(self, time: float) -> GeometricSystem:
        """The system at a time [s] that does not go back; where all that is seen rests, relaxed at the goal."""
        while self._looks and time >= self._looks[0]:
            self._looks.pop(0)
            obstacles = self._problem.obstacles_at(time)
            moving = bool(np.any(obstacles.velocities))
            self._current = self._system if moving else self._system.relaxed_at(self._problem.goal, obstacles)
        return self._current


class _Led:
    """A guided motion that keeps what its guide says."""

    def __init__(self, guided: GuidedMotion) -> None:
        self._guided = guided
        self.period = guided.guide.period
        self.first_plan: Plan | None = None
        self.status = ""

    @property
    def moving(self) -> GeometricSystem:
        """What to move by, as of the last goal."""
        return self._guided.moving

    def goal(self, q: Array, obstacles: Obstacles, time: float) -> JointGoal:
        """Where to be drawn to."""
        guidance = self._guided.lead(q, obstacles, time)
        self.status = guidance.status.name
        if self.first_plan is None:
            plan = self._guided.guide.plan
            if plan.status is PlanStatus.found:
                self.first_plan = plan
        return guidance.goal


class _Timer:
    """Adds the time of a step's two calls."""

    def __init__(self) -> None:
        self.steps: list[float] = []


class _TimedSystem:
    def __init__(self, system: _Relaxed, timer: _Timer, period: float, guided: _Led | None) -> None:
        self._system, self._timer, self._period, self._guided = system, timer, period, guided

    def acceleration(self, q: Array, v: Array, goal: Any, obstacles: Obstacles) -> Any:
        begin = time.perf_counter()
        at = len(self._timer.steps) * self._period
        if self._guided is not None:
            goal = self._guided.goal(q, obstacles, at)
        system = self._system.at(at) if self._guided is None else self._guided.moving
        step = system.acceleration(q, v, goal, obstacles)
        self._timer.steps.append(time.perf_counter() - begin)
        return step


class _TimedController:
    def __init__(self, controller: TorqueController, timer: _Timer) -> None:
        self._controller, self._timer = controller, timer

    def solve(self, *state: Any, **clearances: Any) -> Any:
        begin = time.perf_counter()
        solution = self._controller.solve(*state, **clearances)
        self._timer.steps[-1] += time.perf_counter() - begin
        return solution
