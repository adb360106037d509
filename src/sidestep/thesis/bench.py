"""The thesis's methods in the benchmarks: what moves an arm through their problems. See `BenchMethod`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sidestep._core import GeometricSystem, MotionProgram, rollout
from sidestep.bench.motion import CHUNK, Columns, Motion, MotionSettings, under_torque
from sidestep.bench.problem import Problem
from sidestep.body import Body
from sidestep.robot import Robot
from sidestep.thesis.adapter import SystemAdapter
from sidestep.thesis.system import ThesisNumbers, thesis_system


@dataclass(frozen=True, eq=False)
class SystemRunner:
    """A geometric system alone, as the thesis's methods are; under torque its acceleration is tracked."""

    robot: Robot
    system: GeometricSystem

    def move(self, problem: Problem, settings: MotionSettings) -> Motion:
        """Runs one problem."""
        if settings.poses:
            raise ValueError("pose goals are for the methods 'controller' and 'barrier'; the thesis has none")
        if settings.torque:
            program = MotionProgram(self.robot, period=settings.period)
            return under_torque(
                self.robot,
                SystemAdapter(self.system, problem.goal, problem.obstacles_at, program),
                problem,
                settings,
            )
        columns = Columns(self.robot, problem, settings)
        q, v = problem.start, np.zeros_like(problem.start)
        while steps := columns.next_steps(CHUNK):
            part = rollout(
                self.system,
                q,
                v,
                problem.goal,
                problem.obstacles_at(columns.done * settings.period),
                period=settings.period,
                steps=steps,
                time_steps=True,
            )
            columns.add(
                part.q[:-1],
                part.v[:-1],
                part.acceleration[:-1],
                part.step_seconds[:-1],
                columns.near(part.q[:-1]),
            )
            q, v = part.q[-1], part.v[-1]
        return columns.motion(problem)


@dataclass(frozen=True)
class ThesisMethod:
    """The thesis's system, switched (T6.2) or not (T2.12)."""

    switched: bool

    def body(self, robot: Robot) -> Body:
        """A mixture with the thesis's number of Gaussians."""
        return Body.fit(robot, components=ThesisNumbers().components)

    def runner(self, robot: Robot, body: Body) -> SystemRunner:
        """The system alone."""
        return SystemRunner(robot, thesis_system(robot, body, switched=self.switched))


SWITCHED, UNSWITCHED = ThesisMethod(switched=True), ThesisMethod(switched=False)
