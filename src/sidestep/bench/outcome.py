"""What came of a motion, judged on exact meshes between samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sidestep.bench.motion import Motion, MotionSettings
from sidestep.bench.problem import Problem, between_jumps
from sidestep.bench.step_times import StepTimes
from sidestep.bench.way_out import WayOut, find_way_out
from sidestep.distance import ExactClearance, SelfCollision
from sidestep.distance.clearance import FINEST
from sidestep.robot import Robot
from sidestep.robot.turns import ways_to
from sidestep.simulation.evaluation import excess_over, outside_of
from sidestep.simulation.joint_words import pose_in_words

Array = npt.NDArray[np.float64]

LATELY = 1.0  # [s] at the end, in which a motion that is under way comes nearer
NEARER = 0.2, 0.05  # by this share of the velocity limit, or of what was left
TOLERANCE = 1e-3  # [m] of minimum clearances: the true one is at most this much smaller than the one reported


@dataclass(frozen=True)
class Outcome:
    """What came of one problem, from the start to arrival or the end of the time.

    Attributes:
        index: of the problem. arrived: within the time. time_s: of the motion. steps: of it.
        error_rad: largest joint error at its end.
        straight_line_blocked: of the problem.
        min_clearance_m: exact, from any solid, between samples too; None without any. Below 0: overlap.
        clearance_pair, clearance_time_s: between what, and when.
        contacts: contact points that MuJoCo counted; 0 without physics.
        min_self_clearance_m: exact, between the links that may not touch; None without such. 0: touch.
        self_pair: between which.
        limits: worst excess of the limits that were broken at a sample, by name, in the limit's unit.
        diverged: the state was not finite any more; the motion ends there.
        way_out: of a collision of a safe method with what moves, see `find_way_out`; None elsewhere.
        pose_error: at the end, where the goal was a pose: [m] and [rad].
        under_way: it did not arrive, and still came nearer when the time was over.
    """

    index: int
    arrived: bool
    time_s: float
    steps: int
    error_rad: float
    straight_line_blocked: bool
    min_clearance_m: float | None
    clearance_pair: str
    clearance_time_s: float
    contacts: int
    min_self_clearance_m: float | None
    self_pair: str
    limits: dict[str, float]
    diverged: bool
    way_out: WayOut | None = None
    pose_error: tuple[float, float] | None = None
    under_way: bool = False

    @property
    def collision(self) -> bool:
        """It touched a solid."""
        return self.contacts > 0 or (self.min_clearance_m is not None and self.min_clearance_m <= 0.0)

    @property
    def self_collision(self) -> bool:
        """It touched itself."""
        return self.min_self_clearance_m is not None and self.min_self_clearance_m <= 0.0

    @property
    def success(self) -> bool:
        """It arrived and touched nothing on the way."""
        return self.arrived and not self.collision and not self.self_collision

    @property
    def stuck(self) -> bool:
        """It touched nothing, did not arrive, and comes no nearer."""
        return self.late and not self.under_way

    @property
    def late(self) -> bool:
        """It touched nothing and did not arrive in time."""
        return not self.arrived and not self.collision and not self.self_collision

    @property
    def only_short_of_goal(self) -> bool:
        """It did not arrive, and nothing else went wrong."""
        return self.late and not self.limits

    def reasons(self, *, arrives: bool = True) -> list[str]:
        """What went wrong, a sentence each; empty when nothing did. `arrives`: it should."""
        found = []
        if self.diverged:
            found.append(f"the motion diverged after {self.time_s:.3f} s")
        if self.collision:
            clearance = 0.0 if self.min_clearance_m is None else self.min_clearance_m
            counted = f", {self.contacts} MuJoCo contacts" if self.contacts else ""
            found.append(
                f"collision: {self.clearance_pair} {1e3 * clearance:.1f} mm"
                f" at {self.clearance_time_s:.2f} s{counted}"
                + (f"; {self.way_out.sentence}" if self.way_out else "")
            )
        if self.self_collision:
            found.append(f"self-collision: {self.self_pair}")
        if not arrives and self.arrived:
            found.append("it arrived at a goal that is blocked")
        if arrives and self.late:
            away = f"{self.error_rad:.2f} rad from the goal"
            if self.pose_error is not None:
                distance, angle = self.pose_error
                away = f"{pose_in_words(distance, angle)} from the pose"
            found.append(f"{'under way' if self.under_way else 'stuck'}: {away} after {self.time_s:.1f} s")
        found += [f"{name} limit exceeded by {value:.3g}" for name, value in self.limits.items()]
        return found


class Judge:
    """Judges motions of one robot on its exact meshes.

    Args:
        robot: the arm. self_collision: its checker, if it is made already.
    """

    def __init__(self, robot: Robot, *, self_collision: SelfCollision | None = None) -> None:
        self.robot = robot
        self._self = self_collision or SelfCollision(robot)
        self._clearance = ExactClearance(robot, ())

    def judge(self, problem: Problem, motion: Motion, settings: MotionSettings) -> Outcome:
        """What came of a motion through a problem; see `Outcome`."""
        finite = np.isfinite(motion.q).all(axis=1) & np.isfinite(motion.v).all(axis=1)
        end = len(motion.q) if finite.all() else int(finite.argmin())
        q = motion.q[:end]
        clearance, pair, touched, when = None, "", "", 0.0
        if problem.objects:
            exact = self._clearance.among(problem.objects)
            for first, last in between_jumps(motion.object_poses[:end]):
                worst = exact.decided_minimum(
                    q[first:last], motion.object_poses[first:last], tolerance=TOLERANCE
                )
                measured = worst.clearance.distance
                measured = measured if worst.lower_bound > 0.0 else min(measured, worst.lower_bound)
                if clearance is None or measured < clearance:
                    clearance = measured
                    touched = worst.clearance.obstacle
                    pair = f"{worst.clearance.link} - {touched}"
                    when = (first + worst.sample) * settings.period
        own, tolerance = self._self.minimum_over(q, tolerance=TOLERANCE), TOLERANCE
        while FINEST < own.distance <= tolerance:  # too close to say at this tolerance
            tolerance = own.distance / 2.0
            own = self._self.minimum_over(q, tolerance=tolerance)
        way_out = None
        if motion.safe and clearance is not None and clearance <= 0.0 and end == len(motion.q):
            way_out = self._find_way_out(problem, motion, touched, when, settings.period)
        return Outcome(
            index=problem.index,
            arrived=motion.arrived,
            time_s=settings.period * (end - 1),
            steps=len(motion.step_seconds),
            error_rad=float(ways_to(self.robot, q[-1], problem.goal).max()),
            straight_line_blocked=problem.straight_line_blocked,
            min_clearance_m=clearance,
            clearance_pair=pair,
            clearance_time_s=float(when),
            contacts=motion.contacts,
            min_self_clearance_m=own.distance if own.pair else None,
            self_pair=" - ".join(own.pair),
            limits=self._limits(motion, end, settings.period),
            diverged=end < len(motion.q),
            way_out=way_out,
            pose_error=motion.pose_error,
            under_way=not motion.arrived
            and end == len(motion.q)
            and self._under_way(q, problem.goal, settings.period),
        )

    def _under_way(self, q: Array, goal: Array, period: float) -> bool:
        """Whether the joint that is farthest, in time at its velocity limit, came nearer at the end of q (T, nv)."""
        before = q[max(0, len(q) - 1 - round(LATELY / period))]
        velocity = self.robot.limits.velocity
        speed = np.where(np.isfinite(velocity), velocity, 1.0)
        left = [float((ways_to(self.robot, at, goal) / speed).max()) for at in (before, q[-1])]
        span = min(LATELY, (len(q) - 1) * period)
        return left[0] - left[1] > min(NEARER[0] * span, NEARER[1] * left[0])

    def _find_way_out(
        self, problem: Problem, motion: Motion, touched: str, when: float, period: float
    ) -> WayOut | None:
        (item,) = (item for item in problem.objects if item.name == touched)
        if item.motion != "moving":
            return None
        return find_way_out(
            problem,
            motion,
            item,
            when,
            period=period,
            clearance=self._clearance,
            self_collision=self._self,
        )

    def _limits(self, motion: Motion, end: int, period: float) -> dict[str, float]:
        limits = self.robot.limits
        q = motion.q[:end]
        beyond = {
            "position": excess_over(outside_of(q, limits), np.zeros(1)),
            "velocity": excess_over(np.abs(motion.v[:end]), limits.velocity),
            "acceleration": excess_over(np.abs(motion.a[:end]), limits.acceleration),
        }
        if motion.torque is not None:
            beyond["torque"] = excess_over(np.abs(motion.torque[:end]), limits.effort)
            rates = np.abs(np.diff(motion.torque[:end], axis=0)) / period
            beyond["torque rate"] = excess_over(rates, limits.effort_rate)
        elif motion.safe:  # of physics they are the plant's, not the command's
            jerks = np.abs(np.diff(motion.a[: end - 1], axis=0)) / period
            beyond["jerk"] = excess_over(jerks, limits.jerk)
        return {name: worst for name, (count, worst) in beyond.items() if count > 0}


def times_of(motion: Motion) -> StepTimes:
    """The times of the steps of a motion."""
    times = StepTimes()
    times.add(motion.step_seconds)
    return times
