"""A method on its way to a goal: the system, what draws it, and how it gets out where it is stuck."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from sidestep._core import (
    Diagnosis,
    Escape,
    Evasion,
    GeometricSystem,
    JointGoal,
    MotionState,
    Obstacles,
    PlannerSettings,
    PoseGoal,
    RouteSettings,
    Step,
    is_fallback,
)
from sidestep.body import Body
from sidestep.guidance import GuidedMotion
from sidestep.robot import Robot
from sidestep.scenario import Scenario
from sidestep.scenario.settings import EscapeChoice, EvasionChoice, GuideChoice
from sidestep.simulation.pose_aim import PoseAim, Posture
from sidestep.studio.lookout import Lookout
from sidestep.studio.methods import Method

Array = npt.NDArray[np.float64]

STILL = 1e-3  # [m/s] an obstacle slower than this is at rest
ARRIVED = 0.01  # [rad | m] of all joints: nearer than that, not to come nearer is no dead end


class Pursuit:
    """What moves one arm by one method.

    Args:
        robot, tip: the arm, and the frame whose pose is a goal. body, system: of the method.
        written: the method and its numbers as a file has them: sub-goals, flights, guide, period of control.

    Raises:
        ValueError: that names the number at fault.
    """

    def __init__(
        self, robot: Robot, tip: str, method: Method, body: Body, system: GeometricSystem, written: Scenario
    ) -> None:
        self.system = system
        self._robot, self._tip, self._method = robot, tip, method
        self._period, self._written = written.simulation.period, written
        self._guide = (
            guide_of(written.guide, robot, body, system, synchronous=False) if method.guided else None
        )
        self._time, self._says = 0.0, ""
        self.forget()

    def forget(self) -> None:
        """The arm is suddenly elsewhere: what was found on its way is of no use."""
        self._lookout: Lookout | None = None
        if self._method.evades:
            choice = self._written.evasion
            evasion = evasion_of(choice, self.system)
            self._lookout = Lookout(evasion, delay=choice.delay, period=self._period)

    def begin(self, pose: Array | None, posture: Posture) -> None:
        """Goes to a posture, or a pose (4, 4) by it; what was stuck before is so no longer."""
        self._posture = posture
        self._potential = float("nan")
        self._aim: JointGoal | PoseAim = JointGoal(posture.q)
        if pose is not None:
            stiffness = float(self.system.stiffness[0, 0])
            self._aim = PoseAim(self._robot, self._tip, pose, stiffness=stiffness, posture=posture)
        if self._guide is not None:
            self._guide.set_goal(posture.q)
        self._escape = self._new_escape() if self._method.escapes else None
        self._arrived = False
        self.obstacles_changed()

    def obstacles_changed(self) -> None:
        """Obstacles came, went, or are suddenly elsewhere."""
        self._relaxed: GeometricSystem | None = None

    def step(self, q: Array, v: Array, obstacles: Obstacles) -> tuple[Step, Array]:
        """One period from q, v (nv,): the step of the system, and the wanted acceleration.

        That is the step's, to the goal, a sub-goal, or along the guide's path; or that of a flight out of the way.
        """
        aim, flight = self._goal(q), None
        if self._lookout is not None:
            moving = Obstacles.none() if self._relaxes(obstacles) else obstacles
            flight = self._lookout.follow(aim, q, v, moving)
        goal = self._attractor(aim, q, obstacles) if flight is None else JointGoal(flight.refuge)
        step = self._moving_by(obstacles).acceleration(q, v, goal, obstacles)
        self._potential = step.goal_potential if flight is None else float("nan")
        if flight is None or is_fallback(step.status):
            return step, np.asarray(step.acceleration)
        return step, np.asarray(flight.acceleration(q, v, self._period))

    def look(self, q: Array, v: Array, obstacles: Obstacles) -> Step:
        """The same to the goal alone, without time passing."""
        return self._moving_by(obstacles).acceleration(q, v, self._goal(q), obstacles)

    def at_goal(self, obstacles: Obstacles) -> Diagnosis:
        """What an arm at rest at the goal does."""
        q = self._posture.q
        return self._moving_by(obstacles).diagnose(q, np.zeros_like(q), q, obstacles)

    def is_free(self, q: Array, obstacles: Obstacles) -> bool:
        """Whether the arm may rest at q (nv,), as far as the system knows of clearances."""
        return self.system.diagnose(q, np.zeros_like(q), q, obstacles).state != MotionState.inside_barrier

    def places(self, obstacles: Obstacles) -> Array:
        """Where barriers are relaxed, (k, nv): the arm moves by the system relaxed at these places in turn."""
        if self._guide is not None:
            return self._guide.places
        return np.array([self._posture.q] if self._relaxes(obstacles) else []).reshape(
            -1, len(self._posture.q)
        )

    def in_words(self, words: str) -> str:
        """What the arm does, with what guides it."""
        if self._guide is not None:
            words = f"guide: {self._says}; {words}"
        if self._escape is not None and self._escape.escaping:
            words = f"leaves a dead end, sub-goal {self._escape.count}: {words}"
        if self._lookout is not None and self._lookout.flight is not None:
            words = f"steps out of the way: {words}"
        return self._posture.in_words(words)

    def _new_escape(self) -> Escape:
        return escape_of(self._written.escape, self._robot)

    def _goal(self, q: Array) -> JointGoal | PoseGoal:
        return self._aim.at(q) if isinstance(self._aim, PoseAim) else self._aim

    def _attractor(self, aim: JointGoal | PoseGoal, q: Array, obstacles: Obstacles) -> JointGoal | PoseGoal:
        self._time += self._period
        if self._guide is not None:
            guidance = self._guide.lead(q, obstacles, self._time)
            self._says = guidance.status.name.replace("_", " ")
            return guidance.goal
        if self._escape is None or not isinstance(aim, JointGoal):
            return aim
        if np.abs(q - aim.position).max() < ARRIVED:
            if not self._arrived:
                self._arrived, self._escape = True, self._new_escape()
            return aim
        self._arrived = False
        escaping = self._escape.escaping
        followed = self._escape.pursue(aim, q, self._potential, self._period)
        if self._escape.escaping and not escaping:
            if self.at_goal(obstacles).state == MotionState.inside_barrier:
                self._escape = self._new_escape()  # no way leads to a goal that is blocked
                return aim
        return followed

    def _relaxes(self, obstacles: Obstacles) -> bool:
        return self._method.safe and bool(np.abs(obstacles.velocities).max(initial=0.0) <= STILL)

    def _moving_by(self, obstacles: Obstacles) -> GeometricSystem:
        """The system, with barriers that leave the goal free as long as all obstacles are at rest."""
        if self._guide is not None:
            return self._guide.moving
        if not self._relaxes(obstacles):
            self._relaxed = None
            return self.system
        if self._relaxed is None:
            self._relaxed = self.system.relaxed_at(self._posture.q, obstacles)
        return self._relaxed


def escape_of(choice: EscapeChoice, robot: Robot) -> Escape:
    """Sub-goals where the arm is stuck; raises ValueError that names the number at fault."""
    return Escape(robot, **dataclasses.asdict(choice))


def evasion_of(choice: EvasionChoice, system: GeometricSystem) -> Evasion:
    """Flights out of the way of what moves; raises ValueError that names the number at fault."""
    return Evasion(system, **dataclasses.asdict(choice))


def guide_of(
    choice: GuideChoice, robot: Robot, body: Body, system: GeometricSystem, *, synchronous: bool
) -> GuidedMotion:
    """What leads the arm along a path; raises ValueError that names the number at fault."""
    return GuidedMotion(
        robot,
        body,
        system=system,
        planner=PlannerSettings(**dataclasses.asdict(choice.planner)),
        route=RouteSettings(**dataclasses.asdict(choice.route)),
        synchronous=synchronous,
    )
