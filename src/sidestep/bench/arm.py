"""A robot with what a benchmark needs of it: what moves it and a judge."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sidestep._core import Obstacles
from sidestep.bench.method import Method
from sidestep.bench.methods import build_runner
from sidestep.bench.motion import Motion, MotionSettings, ProblemRunner
from sidestep.bench.motion_bench_maker import MotionBenchMakerProblem
from sidestep.bench.outcome import Judge
from sidestep.bench.problem import Problem, SceneProblem
from sidestep.body import Body
from sidestep.distance import ExactClearance, SceneObject, SelfCollision
from sidestep.obstacles import Shape, obstacles_from_shapes
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]
Pair = tuple[str, str]

DESCRIPTIONS = (".urdf", ".xacro", ".xml", ".mjcf")  # suffixes of files, as against names


def load_robot(robot: str, *, locked: Mapping[str, float] | None = None) -> Robot:
    """A robot by its name or the path of its description, with joints locked where the problem asks for it."""
    if robot.endswith(DESCRIPTIONS):
        return Robot.from_urdf(Path(robot), locked=locked, locked_beyond_limits=True)
    return Robot.named(robot, locked=locked, locked_beyond_limits=True)


@dataclass(frozen=True, eq=False)
class Arm:
    """One robot, with its joints locked as one kind of problem asks for it.

    Attributes:
        robot: it. body: covers its links; the same for every opening of a gripper. runner: moves it.
        allowed: pairs of links that may touch. unknown: joints of the problem that it does not have.
    """

    robot: Robot
    body: Body
    runner: ProblemRunner
    allowed: tuple[Pair, ...] = ()
    unknown: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        robot: Robot,
        method: Method,
        body: Body,
        *,
        allowed: tuple[Pair, ...] = (),
        unknown: tuple[str, ...] = (),
    ) -> Arm:
        """A robot with a body of it, moved by a method."""
        return cls(robot, body, build_runner(method, robot, body), allowed, unknown)

    def move(self, problem: Problem, settings: MotionSettings) -> Motion:
        """Runs one problem."""
        return self.runner.move(problem, settings)

    @cached_property
    def judge(self) -> Judge:
        """On exact meshes."""
        return Judge(self.robot, self_collision=self.self_collision)

    @cached_property
    def self_collision(self) -> SelfCollision:
        """Without the pairs that may touch."""
        known = {link.name for link in self.robot.links}
        return SelfCollision(self.robot, allowed=[pair for pair in self.allowed if known.issuperset(pair)])

    @cached_property
    def clearance(self) -> ExactClearance:
        """To be put among the solids of a problem."""
        return ExactClearance(self.robot, ())

    def problem(
        self, source: MotionBenchMakerProblem, *, spacing: float, point_radius: float
    ) -> tuple[SceneProblem, Array]:
        """A published problem for this arm, with its goal within the limits; and the goal (nv,) as published.

        Args:
            source: as published.
            spacing: no point of a surface is farther than this from one of the points [m]; point_radius: theirs.
        """
        names = self.robot.coordinate_names
        start, goal = (np.array([state[name] for name in names]) for state in (source.start, source.goal))
        within = np.clip(goal, self.robot.limits.lower, self.robot.limits.upper)
        objects = tuple(SceneObject.from_shape(name, shape) for name, shape in source.shapes.items())
        problem = SceneProblem(
            name=source.set,
            index=source.index,
            start=start,
            goal=within,
            clearance=self.clearance.among(objects),
            obstacles=_points(list(source.shapes.values()), spacing, point_radius),
        )
        return problem, goal


class Arms:
    """The arms of problems of one robot: one for every way in which its other joints are held.

    Args:
        robot: name, or path of a description. method: how it is moved.
        body: of the robot as it is by default: ellipsoids of a link do not depend on where joints are locked.
    """

    def __init__(self, robot: str, method: Method, body: Body) -> None:
        self._name, self._method, self._body = robot, method, body
        self._plain = load_robot(robot)
        self._arms: dict[tuple[object, ...], Arm] = {}

    def of(self, problem: MotionBenchMakerProblem) -> Arm:
        """The arm of a problem.

        Raises:
            ValueError: the problem plans a joint that the robot does not have, or does not say where one is.
        """
        own = (*self._plain.coordinate_names, *self._plain.held)
        locked = {name: value for name, value in problem.held.items() if name in own}
        key = (*sorted(locked.items()), *problem.allowed, *problem.goal)
        if key not in self._arms:
            robot = load_robot(self._name, locked=locked)
            _check_joints(problem, robot)
            body = self._body.for_robot(robot, source=self._plain)
            self._arms[key] = Arm.of(
                robot,
                self._method,
                body,
                allowed=problem.allowed,
                unknown=tuple(name for name in problem.held if name not in own),
            )
        return self._arms[key]


def _points(shapes: Sequence[Shape], spacing: float, radius: float) -> Obstacles:
    return (
        obstacles_from_shapes(shapes, spacing=spacing, radius=radius, gaps_allowed=True)
        if shapes
        else Obstacles.none()
    )


def _check_joints(problem: MotionBenchMakerProblem, robot: Robot) -> None:
    names = robot.coordinate_names

    def listed(found: Iterable[str]) -> str:
        return ", ".join(found) or "none"

    if set(names) != set(problem.goal) or not set(names) <= set(problem.start):
        raise ValueError(
            f"{problem.set} {problem.index} plans the joints {listed(problem.goal)} from a start of "
            f"{listed(problem.start)}; robot {robot.name!r} has {listed(names)}"
        )
