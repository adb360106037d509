"""Obstacles that come and go while the arm moves, among random balls or in published scenes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from itertools import islice, product

import numpy as np
import numpy.typing as npt

from sidestep._core import Obstacles
from sidestep.bench.arm import Arm, Arms, load_robot
from sidestep.bench.methods import build_body
from sidestep.bench.motion_bench_maker import MotionBenchMakerProblem
from sidestep.bench.parallel import Progress
from sidestep.bench.problem import Problem
from sidestep.bench.problems import ProblemGenerator, ProblemSettings
from sidestep.bench.scenes import SceneOutcome, SceneResult, SceneSettings, collect, judged
from sidestep.bench.step_times import StepTimes
from sidestep.bench.workspace import Workspace
from sidestep.distance import SceneObject
from sidestep.math.pose import moved
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]

RADII = (0.05, 0.08)  # [m] of the ball that comes
ALONG = (0.4, 0.8)  # of the straight line in joint space: where the ball is in the way of the tip
OFFSET = 0.05  # [m] standard deviation of its centre from the tip there
APPEARS = (0.3, 1.0)  # [s] when it is suddenly there
PASSES = (1.0, 3.0)  # [s] when it drifts through that place
SPEEDS = (0.1, 0.4)  # [m/s] of its drift
CLEARS = (3.0, 6.0)  # [s] when it leaves the goal
FROM_START = 0.15  # [m] at least, exact, from the arm at its start when the ball comes
FROM_GOAL = 0.03  # [m] at least from the arm at its goal, where the goal is to stay free
BLOCKED_WITHIN = 0.01  # [rad | m] of a goal with a ball in it, in every joint: within it an arm has arrived
MOST_CORNERS = 1024  # of the box around the goal that are looked at: all of ten joints
FROM_SHOULDER = 0.35  # [m] at least between its way and the shoulder: nearer, the arm cannot yield
TRIES = 2000  # balls drawn for one problem
REPLACED_BY = 100_000  # added to the number of a random problem that no ball fits, for another in its place
REPLACEMENTS = 10  # problems tried


class Kind(StrEnum):
    """What the ball does."""

    sudden = "sudden"  #: it is suddenly in the way, and stays
    drift = "drift"  #: it drifts through the arm's way, and on
    blocked = "blocked"  #: it is in the goal, and stays
    cleared = "cleared"  #: it is in the goal, and then leaves

    @property
    def in_goal(self) -> bool:
        """The ball is in the goal at first, and at the corners of the box of BLOCKED_WITHIN around it."""
        return self in (Kind.blocked, Kind.cleared)


@dataclass(frozen=True, eq=False)
class DynamicProblem:
    """A problem at rest, and a ball that comes, drifts or goes.

    Attributes:
        base: the problem without it. kind: what it does. ball: it, with the time in which it is there.
    """

    base: Problem
    kind: Kind
    ball: SceneObject

    @property
    def index(self) -> int:
        """Of the base."""
        return self.base.index

    @property
    def start(self) -> Array:
        """(nv,) [rad | m]."""
        return self.base.start

    @property
    def goal(self) -> Array:
        """(nv,) [rad | m]."""
        return self.base.goal

    @property
    def objects(self) -> tuple[SceneObject, ...]:
        """Those of the base, and the ball."""
        return (*self.base.objects, self.ball)

    @property
    def straight_line_blocked(self) -> bool:
        """Of the base."""
        return self.base.straight_line_blocked

    @property
    def changes(self) -> tuple[float, ...]:
        """When the ball comes and goes."""
        return tuple(at for at in self.ball.present if 0.0 < at < np.inf)

    def obstacles_at(self, time: float) -> Obstacles:
        """What is there at a time [s], with the ball as one point of its radius."""
        rest = self.base.obstacles_at(time)
        if not self.ball.is_present(time):
            return rest
        return Obstacles(
            np.vstack([rest.points, self.ball.pose_at(time)[:3, 3]]),
            np.append(rest.radii, self.ball.size[0]),
            np.vstack([rest.velocities, self.ball.velocity]),
        )


def with_ball(base: Problem, kind: Kind, arm: Arm, workspace: Workspace, *, seed: int) -> DynamicProblem:
    """Adds a ball that depends on (seed, index, kind) alone, whatever moves the arm.

    Args:
        base: the problem. kind: what the ball does. arm: whose way it is in. workspace: of its robot.
        seed: of the ball.

    Raises:
        ValueError: no ball among 2000 was in the way and clear of the start.
    """
    rng = np.random.default_rng((seed, base.index, list(Kind).index(kind)))
    for _ in range(TRIES):
        radius = float(rng.uniform(*RADII))
        share = 1.0 if kind.in_goal else float(rng.uniform(*ALONG))
        through = _tip(arm.robot, base.start + share * (base.goal - base.start))
        through = through + workspace.directions.T @ rng.normal(scale=OFFSET, size=len(workspace.directions))
        direction, speed = workspace.direction(rng), float(rng.uniform(*SPEEDS))
        passes, appears, clears = (float(rng.uniform(*span)) for span in (PASSES, APPEARS, CLEARS))
        velocity = speed * direction if kind is Kind.drift else np.zeros(3)
        ball = SceneObject.ball(
            "ball",
            through - passes * velocity,
            radius=radius,
            motion="moving",
            velocity=velocity.tolist(),
            present={
                Kind.sudden: (appears, np.inf),
                Kind.cleared: (0.0, clears),
            }.get(kind, (0.0, np.inf)),
        )
        if _fits(ball, kind, base, arm, workspace):
            return DynamicProblem(base, kind, ball)
    raise ValueError(f"problem {base.index}: none of {TRIES} balls is in the way and clear of the start")


def _tip(robot: Robot, q: Array) -> Array:
    """The middle (3,) of the last link with geometry, in the world."""
    link, mesh = [(x.name, mesh) for x in robot.links if (mesh := robot.collision_mesh(x.name)) is not None][
        -1
    ]
    return np.asarray(moved(mesh.bounds.mean(axis=0), robot.pose(q, link)), dtype=np.float64)


def _fits(ball: SceneObject, kind: Kind, base: Problem, arm: Arm, workspace: Workspace) -> bool:
    alone = arm.clearance.among([ball])
    if alone.distance(base.start).distance < FROM_START:
        return False
    at_goal = alone.distance(base.goal).distance
    if kind.in_goal:
        corners = islice(product((-BLOCKED_WITHIN, BLOCKED_WITHIN), repeat=len(base.goal)), MOST_CORNERS)
        return at_goal < 0.0 and all(alone.distance(base.goal + np.array(x)).distance < 0.0 for x in corners)
    if kind is Kind.sudden and at_goal < FROM_GOAL:
        return False
    away = workspace.shoulder - ball.pose[:3, 3]
    if np.any(ball.velocity):
        along = ball.velocity / np.linalg.norm(ball.velocity)
        away = away - (away @ along) * along
    return bool(np.linalg.norm(away) - ball.size[0] >= FROM_SHOULDER)


def run_dynamic(
    settings: SceneSettings,
    *,
    count: int = 10,
    seed: int = 0,
    obstacles: int = 5,
    scenes: Sequence[MotionBenchMakerProblem] = (),
    progress: Progress | None = None,
) -> SceneResult:
    """Runs every kind on random problems, and on published ones if there are any; the sets are the kinds.

    Args:
        settings: how. count: random problems of each kind. seed: of these and of the balls.
        obstacles: balls at rest of the random problems.
        scenes: published problems; each is run with every kind.
        progress: told of how many are done, of all, and a word about the last one.

    Raises:
        ValueError: there is nothing to run, or a number is out of range.
    """
    if count < 0 or count + len(scenes) == 0:
        raise ValueError(f"count is {count}, must be at least 1, or 0 with scenes")
    random = ProblemSettings(robot=settings.robot, obstacles=obstacles, seed=seed)
    tasks: list[tuple[Kind, int | MotionBenchMakerProblem]] = [
        (kind, source) for source in (*range(count), *scenes) for kind in Kind
    ]
    return collect(settings, partial(_Worker, settings, random), tasks, progress)


class _Worker:
    """What a process needs for any problem."""

    def __init__(self, settings: SceneSettings, random: ProblemSettings) -> None:
        self.settings, self.random = settings, random
        robot = load_robot(settings.robot)
        body = build_body(settings.method, robot)
        self._arms = Arms(settings.robot, settings.method, body)
        self._arm = Arm.of(robot, settings.method, body)
        self._generator = ProblemGenerator(random, robot=robot, self_collision=self._arm.self_collision)
        self._workspace = Workspace.of(robot)

    def run(self, task: tuple[Kind, int | MotionBenchMakerProblem]) -> tuple[SceneOutcome, StepTimes]:
        kind, source = task
        settings = self.settings
        if kind.in_goal:  # beside the ball, within a wider tolerance, it would have arrived
            tolerance = min(settings.motion.tolerance, BLOCKED_WITHIN)
            settings = replace(settings, motion=replace(settings.motion, tolerance=tolerance))
        if isinstance(source, int):
            arm, name, problem = self._arm, "random", self._random_problem(kind, source)
        else:
            arm, name = self._arms.of(source), source.set
            base, _ = arm.problem(source, spacing=settings.spacing, point_radius=settings.point_radius)
            problem = with_ball(base, kind, arm, self._workspace, seed=self.random.seed)
        return judged(arm, problem, settings, set=f"{name} {kind.value}", arrives=kind is not Kind.blocked)

    def _random_problem(self, kind: Kind, index: int) -> DynamicProblem:
        """The random problem of that number, or the first in its place that a ball fits."""
        generator = self._generator
        for number in range(index, index + REPLACEMENTS * REPLACED_BY, REPLACED_BY):
            base = generator.problem(number)
            try:
                return with_ball(base, kind, self._arm, self._workspace, seed=self.random.seed)
            except ValueError as error:
                unfit = error
        raise unfit
