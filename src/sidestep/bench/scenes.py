"""Runs published problems over processes, and reports on each set of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from sidestep._core import __version__
from sidestep.bench.arm import Arm, Arms, load_robot
from sidestep.bench.method import Method
from sidestep.bench.methods import build_body
from sidestep.bench.motion import MotionSettings
from sidestep.bench.motion_bench_maker import MotionBenchMakerProblem
from sidestep.bench.outcome import Outcome, times_of
from sidestep.bench.parallel import Progress, Worker, cpu_name, run_tasks
from sidestep.bench.points import POINT_RADIUS, SPACING
from sidestep.bench.problem import Problem
from sidestep.bench.step_times import StepTimes
from sidestep.bench.time_ratio import ratio_to_jerk_limited_optimum, ratio_to_optimum
from sidestep.distance import Clearance, EllipsoidClearance, SceneObject
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]
Task = TypeVar("Task")


@dataclass(frozen=True)
class SceneSettings:
    """What is run.

    Attributes:
        robot: name for `Robot.named`, or the path of a URDF. method: how the arm is moved.
        motion: how problems are run. jobs: processes.
        spacing: no point of a surface is farther than this from one that the controller sees [m].
        point_radius: of those points [m].
        only_clearances: measure start and goal and move nothing.
        finer: where the arm does not arrive, and touches nothing, it is run again with finer covers of the links that
            may be why, see `tight_links`: twice at most.
        time_ratio: of the motions that arrive, see `ratio_to_optimum`; needs the package toppra.
        jerk_time_ratio: of the same motions, see `ratio_to_jerk_limited_optimum`; needs casadi as well.

    Raises:
        ValueError: jobs below 1, a length that is not positive.
    """

    robot: str
    method: Method = Method.controller
    motion: MotionSettings = field(default_factory=MotionSettings)
    jobs: int = 1
    spacing: float = SPACING
    point_radius: float = POINT_RADIUS
    only_clearances: bool = False
    finer: bool = False
    time_ratio: bool = False
    jerk_time_ratio: bool = False

    def __post_init__(self) -> None:
        if self.jobs < 1:
            raise ValueError(f"jobs is {self.jobs}, must be at least 1")
        if not (np.isfinite(self.spacing) and self.spacing > 0.0):
            raise ValueError(f"spacing is {self.spacing}, must be positive and finite [m]")
        if not (np.isfinite(self.point_radius) and self.point_radius >= 0.0):
            raise ValueError(f"point_radius is {self.point_radius}, must be >= 0 and finite [m]")


@dataclass(frozen=True, eq=False)
class EndClearances:
    """How near an end of a problem is to solids: exactly, and for the covering body.

    Attributes:
        exact: of the meshes. covered: of the ellipsoids, None for a body without; below 0 it is inside.
    """

    exact: Clearance
    covered: Clearance | None

    @classmethod
    def at(cls, q: Array, arm: Arm, objects: Sequence[SceneObject]) -> EndClearances:
        """Measured at q (nv,), where the objects are at first."""
        covered = None
        if arm.body.levels is not None:
            covered = EllipsoidClearance(arm.robot, arm.body, objects).distance(q)
        return cls(arm.clearance.among(objects).distance(q), covered)


@dataclass(frozen=True, eq=False)
class SceneOutcome:
    """What came of one published problem.

    Attributes:
        set, index: which one. start, goal: clearances there, of the goal as published.
        goal_beyond_limits: [rad | m] by which the published goal is outside the position limits; the arm is
            sent to the nearest configuration within.
        goal_effort: largest share of its effort limit that gravity takes of a joint at the goal; above 1 no torque
            holds the arm there. None where no torque moves it.
        outcome: of the motion, None if there was none. path_length: sum of |dq| [rad | m].
        first_path_s: until the first path; planning_s: until it was improved; None where none is planned.
        first_motion_s: until the first command.
        num_points: that the controller saw at first. unknown_joints: held joints that the robot does not have.
        tolerance: of arriving [rad], see `tolerances`. arrives: it should arrive; False where the goal stays blocked.
        ended: what the guide said at the end; empty without a guide.
        time_ratio: see `ratio_to_optimum`; None where it was not asked for or there is none.
        jerk_time_ratio: see `ratio_to_jerk_limited_optimum`; None where it was not asked for, NaN where none is found.
        tight: links that may need a finer cover, and how many ellipsoids, see `Motion`. finer: those of this run,
            beyond what the body has.
    """

    set: str
    index: int
    start: EndClearances
    goal: EndClearances
    goal_beyond_limits: float
    outcome: Outcome | None
    path_length: float
    first_path_s: float | None
    planning_s: float | None
    first_motion_s: float
    num_points: int
    unknown_joints: tuple[str, ...]
    tolerance: float
    arrives: bool = True
    ended: str = ""
    goal_effort: float | None = None
    time_ratio: float | None = None
    jerk_time_ratio: float | None = None
    tight: Mapping[str, int] = field(default_factory=dict)
    finer: Mapping[str, int] = field(default_factory=dict)

    @property
    def solved(self) -> bool:
        """Arrived where it should, touched nothing, broke no limit."""
        return not self.reasons()

    def reasons(self) -> list[str]:
        """What went wrong, a sentence each; empty when the problem is solved."""
        if self.outcome is None:
            return ["nothing was moved"]
        found = self.outcome.reasons(arrives=self.arrives)
        if self.goal_beyond_limits > self.tolerance:
            found.append(f"the goal is {self.goal_beyond_limits:.3f} rad beyond the position limits")
        if found and self.goal_effort is not None and self.goal_effort > 1.0:
            found.append(
                f"gravity takes {100.0 * self.goal_effort:.0f} % of a joint's effort limit at the goal"
            )
        if found and self.ended:
            found.append(f"the controller says {self.ended}")
        covered = self.goal.covered
        if found and covered is not None and covered.distance <= 0.0:
            found.append(
                f"the goal has the covering body in collision: {covered.link} is {-1e3 * covered.distance:.1f} "
                f"mm deep in {covered.obstacle}, its mesh is {1e3 * self.goal.exact.distance:.1f} mm away"
            )
        return found


@dataclass(frozen=True, eq=False)
class SceneResult:
    """What came of all problems, in order, and the times of all steps."""

    settings: SceneSettings
    outcomes: tuple[SceneOutcome, ...]
    times: StepTimes

    def to_document(self, *, failures: bool = False) -> dict[str, Any]:
        """The figures for JSON: per set and of all; with `failures` also which problems failed, and why.

        Each quantile is over the solved problems, those of clearances at the ends over all of them.
        """
        sets = list(dict.fromkeys(item.set for item in self.outcomes))
        document: dict[str, Any] = {
            "robot": self.settings.robot,
            "method": self.settings.method.value,
            "torque": self.settings.motion.torque,
            "all": _figures(self.outcomes),
            "sets": {name: _figures([item for item in self.outcomes if item.set == name]) for name in sets},
            "step_us": self.times.microseconds(),
            "settings": {
                "spacing_m": self.settings.spacing,
                "point_radius_m": self.settings.point_radius,
                **{key: value for key, value in asdict(self.settings.motion).items() if key != "torque"},
            },
            "unknown_joints": sorted({name for item in self.outcomes for name in item.unknown_joints}),
            "jobs": self.settings.jobs,
            "cpu": cpu_name(),
            "version": __version__,
        }
        if failures:
            document["failures"] = [
                {"set": item.set, "index": item.index, "reasons": item.reasons()}
                for item in self.outcomes
                if item.reasons()
            ]
        if self.settings.finer:
            document["finer"] = [
                {"set": item.set, "index": item.index, "links": dict(item.finer), "solved": item.solved}
                for item in self.outcomes
                if item.finer
            ]
        return document


def _figures(items: Sequence[SceneOutcome]) -> dict[str, Any]:
    moved = [item.outcome for item in items if item.outcome is not None]
    solved = [(item, item.outcome) for item in items if item.solved and item.outcome is not None]
    clearances = [o.min_clearance_m for _, o in solved if o.min_clearance_m is not None]
    jerk_ratios = [i.jerk_time_ratio for i, _ in solved if i.jerk_time_ratio is not None]
    figures: dict[str, Any] = {"problems": len(items)}
    if moved:
        figures |= {
            "tolerances": sorted({item.tolerance for item in items}),
            "solved": len(solved),
            "arrived": sum(item.arrived for item in moved),
            "collision": sum(item.collision for item in moved),
            "self_collision": sum(item.self_collision for item in moved),
            "limit_violations": sum(bool(item.limits) for item in moved),
            "ended": dict(Counter(item.ended for item in items if item.ended)),
            "straight_line_blocked": sum(item.straight_line_blocked for item in moved),
            "first_path_ms": _upper([i.first_path_s for i, _ in solved if i.first_path_s is not None], 1e3),
            "planning_ms": _upper([i.planning_s for i, _ in solved if i.planning_s is not None], 1e3),
            "first_motion_ms": _upper([i.first_motion_s for i, _ in solved], 1e3),
            "path_length_rad": _upper([i.path_length for i, _ in solved]),
            "motion_s": _upper([o.time_s for _, o in solved]),
            "time_ratio": _upper([i.time_ratio for i, _ in solved if i.time_ratio is not None]),
            "jerk_time_ratio": _upper(jerk_ratios),
            "jerk_time_ratio_unsolved": int(np.isnan(jerk_ratios).sum()),
            "min_clearance_mm": _lower(clearances, 1e3),
        }
    figures["goal_beyond_limits"] = sum(item.goal_beyond_limits > 0.0 for item in items)
    efforts = [item.goal_effort for item in items if item.goal_effort is not None]
    figures["goal_beyond_effort"] = sum(effort > 1.0 for effort in efforts)
    figures["goal_effort"] = _upper(efforts)
    figures["points"] = int(np.median([item.num_points for item in items]))
    for end in ("start", "goal"):
        ends: list[EndClearances] = [getattr(item, end) for item in items]
        covered = [item.covered.distance for item in ends if item.covered is not None]
        figures[f"{end}_clearance_mm"] = _lower([item.exact.distance for item in ends], 1e3)
        figures[f"{end}_clearance_of_body_mm"] = _lower(covered, 1e3)
        figures[f"{end}_inside_body"] = sum(value <= 0.0 for value in covered)
    return figures


def _upper(values: Sequence[float], scale: float = 1.0) -> dict[str, float] | None:
    """Median and the quantiles that matter where less is better."""
    return _quantiles(values, {"median": 50.0, "p95": 95.0, "p99": 99.0, "max": 100.0}, scale)


def _lower(values: Sequence[float], scale: float = 1.0) -> dict[str, float] | None:
    """Median and the quantiles that matter where more is better."""
    return _quantiles(values, {"min": 0.0, "p1": 1.0, "p5": 5.0, "median": 50.0}, scale)


def _quantiles(values: Sequence[float], wanted: dict[str, float], scale: float) -> dict[str, float] | None:
    finite = [value for value in values if np.isfinite(value)]
    if not finite:
        return None
    return {name: round(scale * float(np.percentile(finite, share)), 3) for name, share in wanted.items()}


def run_scenes(
    settings: SceneSettings, problems: Sequence[MotionBenchMakerProblem], *, progress: Progress | None = None
) -> SceneResult:
    """Runs problems and judges them; any number of processes gives the same outcomes.

    Args:
        settings: how. problems: at least one.
        progress: told of how many are done, of all, and a word about the last one.

    Raises:
        ValueError: no problem, or one that the robot's joints do not fit.
        MissingExtraError: a ratio is asked for whose package is not installed.
    """
    if not problems:
        raise ValueError("there is no problem to run")
    if settings.jerk_time_ratio:
        import casadi  # noqa: F401  here, before anything moves
    return collect(settings, partial(_Worker, settings), list(problems), progress)


def collect(
    settings: SceneSettings,
    make: Callable[[], Worker[Task, tuple[SceneOutcome, StepTimes]]],
    tasks: Sequence[Task],
    progress: Progress | None,
) -> SceneResult:
    """Runs tasks over processes and puts their outcomes in order; see `run_tasks`."""
    if progress is not None:
        progress(0, len(tasks), "preparing the robot")
    worker = make()  # here first: bodies are made once, and the processes find them cached
    outcomes, times = [], StepTimes()
    for outcome, steps in run_tasks(make, tasks, jobs=settings.jobs, worker=worker):
        outcomes.append(outcome)
        times.merge(steps)
        if progress is not None:
            word = f"{outcome.set} {outcome.index}: {(outcome.reasons() or ['solved'])[0]}"
            progress(len(outcomes), len(tasks), word)
    outcomes.sort(key=lambda item: (item.set, item.index))
    return SceneResult(settings, tuple(outcomes), times)


class _Worker:
    """What a process needs for any problem."""

    def __init__(self, settings: SceneSettings) -> None:
        self.settings = settings
        self._robot = load_robot(settings.robot)
        self._body = build_body(settings.method, self._robot)
        self._arms = Arms(settings.robot, settings.method, self._body)

    def run(self, task: MotionBenchMakerProblem) -> tuple[SceneOutcome, StepTimes]:
        outcome, times = self._run(task, self._arms)
        body, finer = self._body, dict[str, int]()
        while (
            self.settings.finer
            and outcome.tight
            and outcome.outcome is not None
            and outcome.outcome.only_short_of_goal
        ):
            finer |= outcome.tight
            body = body.finer(self._robot, outcome.tight)
            settings = self.settings
            outcome, times = self._run(task, Arms(settings.robot, settings.method, body))
            outcome = replace(outcome, finer=dict(finer))
        return outcome, times

    def _run(self, task: MotionBenchMakerProblem, arms: Arms) -> tuple[SceneOutcome, StepTimes]:
        settings, arm = self.settings, arms.of(task)
        problem, goal = arm.problem(task, spacing=settings.spacing, point_radius=settings.point_radius)
        return judged(arm, problem, settings, set=task.set, goal=goal)


def judged(
    arm: Arm,
    problem: Problem,
    settings: SceneSettings,
    *,
    set: str,
    goal: Array | None = None,
    arrives: bool = True,
) -> tuple[SceneOutcome, StepTimes]:
    """Moves the arm through a problem, unless only ends are asked for, and says what came of it.

    Args:
        arm, problem, settings: what is moved, through what, how. set: name under which it is reported.
        goal: as published (nv,), where the problem has another. arrives: it should arrive.
    """
    published = problem.goal if goal is None else goal
    motion = None if settings.only_clearances else arm.move(problem, settings.motion)
    ratio = jerk_ratio = None
    if motion is not None and motion.arrived:
        duration, limits = settings.motion.period * (len(motion.q) - 1), arm.robot.limits
        if settings.time_ratio:
            ratio = ratio_to_optimum(motion.q, duration, limits)
        if settings.jerk_time_ratio:
            jerk_ratio = ratio_to_jerk_limited_optimum(motion.q, duration, limits)
    outcome = SceneOutcome(
        set=set,
        index=problem.index,
        start=EndClearances.at(problem.start, arm, problem.objects),
        goal=EndClearances.at(published, arm, [o for o in problem.objects if o.present[1] == np.inf]),
        goal_beyond_limits=float(np.abs(published - problem.goal).max()),
        outcome=None if motion is None else arm.judge.judge(problem, motion, settings.motion),
        path_length=0.0 if motion is None else motion.path_length,
        first_path_s=None if motion is None else motion.first_path_seconds,
        planning_s=None if motion is None else motion.planning_seconds,
        first_motion_s=0.0 if motion is None else motion.first_motion_seconds,
        num_points=len(problem.obstacles_at(0.0)),
        unknown_joints=arm.unknown,
        tolerance=settings.motion.tolerance,
        arrives=arrives,
        ended="" if motion is None else motion.ended,
        goal_effort=_effort_at(problem.goal, arm.robot) if settings.motion.torque else None,
        time_ratio=ratio,
        jerk_time_ratio=jerk_ratio,
        tight={} if motion is None else motion.tight,
    )
    return outcome, StepTimes() if motion is None else times_of(motion)


def _effort_at(q: Array, robot: Robot) -> float:
    """Largest share of an effort limit that gravity takes at q (nv,)."""
    return float(np.abs(robot.bias(q, np.zeros_like(q)) / robot.limits.effort).max())
