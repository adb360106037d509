"""Runs reach problems over processes and counts what came of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from sidestep._core import __version__
from sidestep.bench.method import Method
from sidestep.bench.methods import build_body, build_runner
from sidestep.bench.motion import MotionSettings, ProblemRunner
from sidestep.bench.outcome import Judge, Outcome, times_of
from sidestep.bench.own_method import OwnMethodRunner
from sidestep.bench.parallel import Progress, cpu_name, run_tasks
from sidestep.bench.problems import ProblemGenerator, ProblemSettings, ReachProblem
from sidestep.bench.step_times import StepTimes
from sidestep.body import Body
from sidestep.distance import SelfCollision
from sidestep.robot import Robot
from sidestep.robot.any_source import robot_from


@dataclass(frozen=True)
class BenchSettings:
    """What is run.

    Attributes:
        problems: what is drawn, and the robot. count: how many, from index 0.
        method: how the arm is moved, or a Python file of `OwnMethodRunner`. motion: how problems are run.
        jobs: processes. draft: with a coarser body, which is made in seconds; of the controller.
        finer: where the arm does not arrive, and touches nothing, it is run again with finer covers of the links that
            may be why, see `tight_links`: twice at most.

    Raises:
        ValueError: count or jobs below 1, a draft or finer covers for a method that has none, torque or poses for a
            file.
    """

    problems: ProblemSettings
    count: int = 100
    method: Method | Path = Method.controller
    motion: MotionSettings = field(default_factory=MotionSettings)
    jobs: int = 1
    draft: bool = False
    finer: bool = False

    def __post_init__(self) -> None:
        for name in ("count", "jobs"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} is {getattr(self, name)}, must be at least 1")
        if not (isinstance(self.method, Method) and self.method.safe):
            for name in ("draft", "finer"):
                if getattr(self, name):
                    raise ValueError(f"{name} is for the controller; the method is {self.method}")
        if isinstance(self.method, Path) and (self.motion.torque or self.motion.poses):
            raise ValueError(
                f"{self.method.name}: a method of your own gives accelerations, without --torque and --poses"
            )


@dataclass(frozen=True, eq=False)
class BenchResult:
    """What came of all problems, in order.

    Attributes:
        settings: what was asked for. problems, outcomes: one each, by index. times: of all steps.
    """

    settings: BenchSettings
    problems: tuple[ReachProblem, ...]
    outcomes: tuple[Outcome, ...]
    times: StepTimes

    def to_document(self, *, failures: bool = False) -> dict[str, Any]:
        """The figures for JSON; counts are numbers of problems, with `failures` also which and why.

        Collisions with a way out are those in which a search found one (`find_way_out`), where balls move.
        Each problem is one of success, collision or self_collision (or both), stuck, under_way when its time was over;
        limit_violations counts problems in which a position, velocity, acceleration, jerk or torque limit was broken at
        any step.
        """
        outcomes = self.outcomes
        clearances = [item.min_clearance_m for item in outcomes if item.min_clearance_m is not None]
        own = [item.min_self_clearance_m for item in outcomes if item.min_self_clearance_m is not None]
        arrivals = [item.time_s for item in outcomes if item.success]
        broken = sorted({name for item in outcomes for name in item.limits})
        document: dict[str, Any] = {
            "robot": self.problems[0].robot,
            "method": method_name(self.settings.method),
            "torque": self.settings.motion.torque,
            "poses": self.settings.motion.poses,
            "problems": len(outcomes),
            "success": sum(item.success for item in outcomes),
            "collision": sum(item.collision for item in outcomes),
            "collision_with_way_out": sum(
                item.way_out is not None and item.way_out.found for item in outcomes
            ),
            "stuck": sum(item.stuck for item in outcomes),
            "under_way": sum(item.late and item.under_way for item in outcomes),
            "self_collision": sum(item.self_collision for item in outcomes),
            "limit_violations": sum(bool(item.limits) for item in outcomes),
            "limits_broken": {
                name: {
                    "problems": sum(name in item.limits for item in outcomes),
                    "worst_excess": max(item.limits.get(name, 0.0) for item in outcomes),
                }
                for name in broken
            },
            "min_clearance_m": min(clearances, default=None),
            "min_self_clearance_m": min(own, default=None),
            "straight_line_blocked": sum(item.straight_line_blocked for item in outcomes),
            "success_where_blocked": sum(item.success and item.straight_line_blocked for item in outcomes),
            "median_arrival_s": float(np.median(arrivals)) if arrivals else None,
            "steps": sum(item.steps for item in outcomes),
            "step_us": self.times.microseconds(),
            "settings": {
                "obstacles": len(self.problems[0].radii),
                "seed": self.problems[0].seed,
                "fastest_obstacle_m_s": max(
                    float(np.linalg.norm(item.velocities, axis=1).max(initial=0.0)) for item in self.problems
                ),
                **{
                    key: value
                    for key, value in asdict(self.settings.motion).items()
                    if key not in ("torque", "poses")
                },
            },
            "draft": self.settings.draft,
            "finer": self.settings.finer,
            "jobs": self.settings.jobs,
            "cpu": cpu_name(),
            "version": __version__,
        }
        if failures:
            document["failures"] = [
                {"index": item.index, "reasons": item.reasons()} for item in outcomes if item.reasons()
            ]
        return document


def method_name(method: Method | Path) -> str:
    """What reports call a method: a file by its name."""
    return method.name if isinstance(method, Path) else method.value


def run_bench(
    settings: BenchSettings,
    *,
    problems: Sequence[ReachProblem] | None = None,
    progress: Progress | None = None,
) -> BenchResult:
    """Runs problems and judges them; the same settings give the same outcomes with any number of processes.

    Args:
        settings: what to run.
        problems: run these instead of drawing any; `settings.problems` and `count` are then not used.
        progress: told of how many are done, of all, and a word about the last one.
    """
    robot = settings.problems.robot if problems is None else problems[0].robot
    tasks: list[int | ReachProblem] = list(range(settings.count)) if problems is None else list(problems)
    if progress is not None:
        progress(0, len(tasks), "preparing the robot")
    make = partial(_Worker, settings, robot)
    worker = make(progress=progress)  # here first: bodies are made once, and the processes find them cached
    drawn, outcomes, times = [], [], StepTimes()
    for problem, outcome, steps in run_tasks(make, tasks, jobs=settings.jobs, worker=worker):
        drawn.append(problem)
        outcomes.append(outcome)
        times.merge(steps)
        if progress is not None:
            progress(len(outcomes), len(tasks), (outcome.reasons() or ["arrived"])[0])
    order = np.argsort([problem.index for problem in drawn], kind="stable")
    return BenchResult(settings, tuple(drawn[k] for k in order), tuple(outcomes[k] for k in order), times)


def _prepared(
    settings: BenchSettings, name: str, progress: Progress | None
) -> tuple[Robot, Body | None, ProblemRunner]:
    """The robot, its body where the method has one, and what moves it."""
    robot = robot_from(name, settings.problems.options)
    if isinstance(settings.method, Path):
        return robot, None, OwnMethodRunner.from_file(settings.method, robot)

    def show(link: str, done: int, in_all: int) -> None:
        if progress is not None:
            progress(0, settings.count, f"preparing {link} ({done} of {in_all})")

    body = build_body(settings.method, robot, draft=settings.draft, progress=show)
    return robot, body, build_runner(settings.method, robot, body)


class _Worker:
    """What a process needs for any problem."""

    def __init__(self, settings: BenchSettings, robot_name: str, *, progress: Progress | None = None) -> None:
        self.settings, self.robot_name = settings, robot_name
        self._robot, self._body, self._runner = _prepared(settings, robot_name, progress)
        own = SelfCollision(self._robot)
        self._generator = ProblemGenerator(settings.problems, robot=self._robot, self_collision=own)
        self._judge = Judge(self._robot, self_collision=own)

    def run(self, task: int | ReachProblem) -> tuple[ReachProblem, Outcome, StepTimes]:
        problem = self._generator.problem(task) if isinstance(task, int) else task
        method, runner, body = self.settings.method, self._runner, self._body
        while True:
            motion = runner.move(problem, self.settings.motion)
            outcome = self._judge.judge(problem, motion, self.settings.motion)
            again = self.settings.finer and motion.tight and outcome.only_short_of_goal
            if not again or body is None or isinstance(method, Path):
                return problem, outcome, times_of(motion)
            body = body.finer(self._robot, motion.tight)
            runner = build_runner(method, self._robot, body)
