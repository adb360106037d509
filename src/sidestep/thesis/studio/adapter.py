"""What moves the studio's arm by one of the thesis's systems."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sidestep._core import GeometricSystem, MotionProgram, MotionSolution, Obstacles, Step
from sidestep.body import Body
from sidestep.robot import Robot
from sidestep.scenario import Scenario
from sidestep.scenario.assembly import POSTURE_STARTS
from sidestep.scenario.torque_program import torque_qp_of
from sidestep.simulation.pose_target import IkSolution, solve_ik
from sidestep.simulation.run import status_name
from sidestep.studio.adapter import StepRecord
from sidestep.studio.reason import Reason
from sidestep.thesis.custom import system_of

Array = npt.NDArray[np.float64]


class SystemAdapter:
    """A geometric system, whose acceleration a torque program tracks; nothing keeps clearances.

    Args:
        robot: the arm. tip: the frame whose pose is a goal.
    """

    def __init__(self, robot: Robot, system: GeometricSystem, program: MotionProgram, tip: str) -> None:
        self.system = system
        self._robot, self._program, self._tip = robot, program, tip
        self._step: Step | None = None
        self._solution: MotionSolution | None = None

    def set_goal(self, pose: Array | None, q: Array, *, thorough: bool) -> None:
        """The same; thorough: the posture is looked for from everywhere, not only from q."""
        self.posture = IkSolution(q)
        if pose is not None:
            starts = POSTURE_STARTS if thorough else 1
            self.posture = solve_ik(self._robot, self._tip, pose, q, starts=starts)

    def step(self, q: Array, v: Array, mass_matrix: Array, bias: Array, obstacles: Obstacles) -> Array:
        """The torque (nv,) [Nm | N] of one period."""
        self.look(q, v, obstacles)
        assert self._step is not None
        self._solution = self._program.solve(q, v, self._step.acceleration, mass_matrix, bias)
        return self._solution.torque

    def look(self, q: Array, v: Array, obstacles: Obstacles) -> None:
        """A step of the system alone."""
        self._step = self.system.acceleration(q, v, self.posture.q, obstacles)

    @property
    def metric(self) -> Array:
        """(nv, nv) of the last step."""
        assert self._step is not None
        return self._step.metric

    def record(self) -> StepRecord | None:
        """Of the last step; None before one."""
        step, solution = self._step, self._solution
        if step is None:
            return None
        status = f"system {status_name(step.status)}"
        if solution is not None:
            status += f", torque program {status_name(solution.status)}"
        words = self.posture.in_words(step.diagnosis.describe())
        reason = Reason(pull=-step.goal_gradient)
        return StepRecord(words, status, values=step.values, metric=step.metric, reason=reason)

    def event_record(self) -> None:
        """No events: nothing is planned or kept off."""


def adapter_of(written: Scenario, robot: Robot, body: Body, tip: str) -> SystemAdapter:
    """What moves the arm, of a scenario of method custom.

    Raises:
        ValueError: names the number at fault.
    """
    system = system_of(written.embedding, written.system, robot, body)
    return SystemAdapter(robot, system, torque_qp_of(written, robot), tip)
