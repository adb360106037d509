"""A simulated arm as a robot is: it takes commands, says how it is, and comes to rest where nobody commands it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep.distance.scene import SceneObject
from sidestep.robot import Robot
from sidestep.simulation.joint_drives import JointDrives, Output
from sidestep.simulation.limit_watch import LimitWatch
from sidestep.simulation.link import HOLD_CYCLES
from sidestep.simulation.model import build_model
from sidestep.simulation.motion_record import MotionRecord
from sidestep.simulation.physics import Physics

Array = npt.NDArray[np.float64]

ROUNDING = 1e-6  # share of the torque's rate by which a change may exceed it


class Mode(IntEnum):
    """Who moves the arm."""

    waiting = 0  #: nobody yet: the world stands still
    controlled = 1  #: a client
    resting = 2  #: nobody any more: it comes to rest, or rests
    stopped = 3  #: the same, and it has stopped by itself: see `SimulatedRobot.trouble`


@dataclass(frozen=True, eq=False)
class Sample:
    """What the robot says of itself at the beginning of a cycle.

    Attributes:
        cycle: number. time: of the simulation [s]. mode: who moves it.
        taken: number of the newest command that it has taken, -1: none; taken_cycle: in which cycle.
        lost: cycles under control without a new one.
        q, v: (nv,). torque: (nv,) of the motors in the cycle before, gravity included [Nm | N].
        object_poses: (N, 7) position and quaternion (w, x, y, z) of the objects.
    """

    cycle: int
    time: float
    mode: Mode
    taken: int
    taken_cycle: int
    lost: int
    q: Array
    v: Array
    torque: Array
    object_poses: Array


class SimulatedRobot:
    """An arm among objects in MuJoCo behind its joint drives, cycle by cycle.

    The world stands still until the first `start`. A command for cycle k may come after the sample of cycle k. Where
    none comes, the drives hold the last torque, acceleration or velocity, and move positions on, for `hold_cycles`;
    then the arm brakes by itself and waits for another `start`.

    Args:
        robot: with inertias and effort limits. objects: the scene.
        start, velocity: (nv,) at time 0; the velocity is zero by default.
        period: of a cycle [s]. hold_cycles: see above. ramps: see `JointDrives`.
        record: takes every cycle, if given.

    Raises:
        ValueError: see `build_model`; or hold_cycles below 1.
    """

    def __init__(
        self,
        robot: Robot,
        objects: tuple[SceneObject, ...],
        start: Array,
        *,
        velocity: Array | None = None,
        period: float = 1e-3,
        hold_cycles: int = HOLD_CYCLES,
        ramps: bool = True,
        record: MotionRecord | None = None,
    ) -> None:
        if hold_cycles < 1:
            raise ValueError(f"hold_cycles is {hold_cycles}; allowed: 1 or more")
        self.robot, self.objects, self.period, self.hold_cycles = robot, objects, period, hold_cycles
        built = build_model(robot, objects, timestep=period, visuals=False)
        self._physics = Physics(built, objects, period=period)
        v = np.zeros_like(start) if velocity is None else velocity
        self._physics.begin(start, v)
        self._drives = JointDrives(robot, period=period, ramps=ramps)
        self._drives.hold(start, v)
        self._record = record
        self.limits = LimitWatch(robot.limits, period)
        self.mode, self.trouble = Mode.waiting, ""
        self.contacts: dict[str, int] = {}
        self.largest_force = 0.0
        self._cycle = 0
        self._output: Output | None = None
        self._taken, self._lost, self._silent = -1, 0, 0
        self._taken_cycle = 0
        self._longest_silence = self._leaps = 0
        self._largest_leap = 0.0
        self._torque = robot.bias(start, np.zeros_like(start))
        self._q, self._v = self._physics.measure(0.0)
        self._acceleration = np.zeros_like(self._v)  # over the cycle before

    @property
    def time(self) -> float:
        """Of the simulation [s]."""
        return self._cycle * self.period

    def start(self, output: Output) -> None:
        """A client begins to control the arm by an output."""
        self.mode, self.trouble, self._output = Mode.controlled, "", output
        self._taken, self._silent = -1, 0
        self._drives.hold(self._q, self._v, self._acceleration)

    def take(self, number: int, values: Array) -> None:
        """Takes command `number` (nv,) of the output that was started with; without control it is left.

        Raises:
            ValueError: a value that is not finite, or a wrong number of them.
        """
        if self.mode != Mode.controlled or number <= self._taken:
            return
        if values.shape != self._q.shape or not np.isfinite(values).all():
            raise ValueError(
                f"command {number} has {values.size} values, {np.isfinite(values).sum()} of them finite; allowed: "
                f"{self._q.size}, all finite"
            )
        assert self._output is not None
        self._drives.take(self._output, values)
        self._taken, self._silent, self._taken_cycle = number, 0, self._cycle

    def stop(self, trouble: str = "") -> None:
        """Ends the control: the arm comes to rest and holds. `trouble`: why it does so by itself."""
        if self.mode == Mode.controlled:
            self.mode, self.trouble = Mode.stopped if trouble else Mode.resting, trouble
            self._drives.hold(self._q, self._v, self._acceleration)

    def sample(self) -> Sample:
        """How the robot is at the beginning of this cycle."""
        return Sample(
            cycle=self._cycle,
            time=self.time,
            mode=self.mode,
            taken=self._taken,
            taken_cycle=self._taken_cycle,
            lost=self._lost,
            q=self._q,
            v=self._v,
            torque=self._torque,
            object_poses=self._physics.object_poses(),
        )

    def advance(self) -> None:
        """One cycle with what the drives were told; before the first `start` the world stands still.

        Raises:
            RuntimeError: the physics diverged.
        """
        if self.mode == Mode.waiting:
            return
        self._notice_silence()
        if self._drives.fault:
            self.stop(self._drives.fault)
        torque = self._drives.torque(self._q, self._v)
        if self._drives.leap > 1.0 + ROUNDING and self.mode == Mode.controlled:
            self._leaps += 1
            self._largest_leap = max(self._largest_leap, self._drives.leap)
        poses = self._physics.object_poses()
        v, contacts = self._physics.advance(torque, self.time)
        self._acceleration = (v - self._v) / self.period
        self.limits.observe(self._q, self._v, torque, self._acceleration, self._drives.asked)
        for contact in contacts:
            pair = f"{contact.link} - {contact.obstacle}"
            self.contacts[pair] = self.contacts.get(pair, 0) + 1
            self.largest_force = max(self.largest_force, contact.force)
        if self._record is not None:
            self._record.add(self.time, self._q, self._v, torque, poses)
        self._torque = torque
        self._cycle += 1
        self._q, self._v = self._physics.measure(self.time)

    @property
    def at_rest(self) -> bool:
        """Whether nobody controls the arm and it stands."""
        return self.mode != Mode.controlled and bool(np.abs(self._v).max() < 1e-3)

    def to_dict(self) -> dict[str, Any]:
        """What came of it, as plain values for JSON."""
        return {
            "robot": self.robot.name,
            "simulated_s": self.time,
            "cycles": self._cycle,
            "lost_cycles": self._lost,
            "longest_silence_cycles": self._longest_silence,
            "torque_leaps": {"cycles": self._leaps, "largest": self._largest_leap},
            "contacts": sum(self.contacts.values()),
            "contact_pairs": self.contacts,
            "largest_contact_force_n": self.largest_force,
            "limits": self.limits.to_dict(),
            "limits_exceeded": list(self.limits.broken),
            "trouble": self.trouble,
        }

    def _notice_silence(self) -> None:
        if self.mode != Mode.controlled:
            return
        if self._silent > 0 and self._taken >= 0:
            self._lost += 1
            self._longest_silence = max(self._longest_silence, self._silent)
        if self._silent >= self.hold_cycles and self._taken >= 0:
            self.stop(f"no command for {self._silent} cycles")
        self._silent += 1
