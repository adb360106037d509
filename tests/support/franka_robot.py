"""A Franka Research 3 without a robot: what `pylibfranka` gives, on a clock of its own, with the robot's rules.

Every 1 ms it judges what it was sent by backward differences against what it goes on from, and ends the motion where
a limit is broken. A cycle without an answer it goes on alone: positions and velocities at the last acceleration,
torques as they were. It drops answers that come late, and stops after 20 lost cycles in a row. What it says of itself
is rounded to single precision. The arm follows positions and velocities exactly, and torques by the mass matrix.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np

from sidestep.robot import Robot as Model

T = 0.001  # [s]
START = np.array([0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398])  # as Franka's examples begin
MOST_LOST = 20
# Of the position-based velocity limits: fastest, offset, deceleration; the joints' ends.
SPEED = np.array([2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26])
OFFSET = np.array([0.3, 0.2, 0.2, 0.3, 0.35, 0.35, 0.35])
DECELERATION = np.array([6.0, 2.585, 3.5, 4.0, 17.0, 5.5, 17.0])
LOWER = np.array([-2.7501, -1.7918, -2.9065, -3.0481, -2.8101, 0.54092, -3.0196])
UPPER = np.array([2.7501, 1.7918, 2.9065, -0.1458, 2.8101, 4.5205, 3.0196])


class FrankaException(Exception):
    pass


class ControlException(RuntimeError):
    pass


class CommandException(RuntimeError):
    pass


class NetworkException(RuntimeError):
    pass


class RobotMode(Enum):
    Idle, Move, Reflex = range(3)


class ControllerMode(Enum):
    JointImpedance = 0


class RealtimeConfig(Enum):
    kEnforce, kIgnore = range(2)


@dataclass
class _Message:
    values: list[float]
    motion_finished: bool = False


class Torques(_Message):
    pass


class JointVelocities(_Message):
    pass


class JointPositions(_Message):
    pass


@dataclass
class Duration:
    seconds: float

    def to_sec(self) -> float:
        return self.seconds


@dataclass
class RobotState:
    q: list[float]
    dq: list[float]
    tau_J: list[float]
    q_d: list[float]
    dq_d: list[float]
    ddq_d: list[float]
    tau_J_d: list[float]
    robot_mode: RobotMode
    control_command_success_rate: float


@dataclass
class FrankaRobot:
    """The robot and its clock, with all of `pylibfranka` that a driver uses; `Robot` connects to it."""

    q: np.ndarray = field(default_factory=START.copy)
    now: float = 0.0  # [s]
    mode: RobotMode = RobotMode.Idle
    reflex: str = ""
    unplugged: bool = False
    lost: int = 0  # cycles in all
    cycles: int = 0  # of control
    recovered: int = 0

    ControlException, CommandException, NetworkException = (
        ControlException,
        CommandException,
        NetworkException,
    )
    FrankaException, RobotMode, ControllerMode = FrankaException, RobotMode, ControllerMode
    RealtimeConfig, Torques = RealtimeConfig, Torques
    JointVelocities, JointPositions = JointVelocities, JointPositions

    def __post_init__(self) -> None:
        self.model = Model.named("fr3")
        self.v, self.torque = np.zeros(7), np.zeros(7)
        self.told = [self.q.copy(), np.zeros(7), np.zeros(7)]
        self.kind: type[_Message] | None = None
        self._answer: _Message | None = None
        self._in_a_row, self._armed, self._tick = 0, False, 0

    def monotonic(self) -> float:
        """The clock, for what stands in for the module `time`."""
        return self.now

    def Robot(self, address: str, config: RealtimeConfig) -> FrankaRobot:
        if address != "robot":
            raise NetworkException(f"no robot at {address}")
        return self

    def sleep(self, seconds: float) -> None:
        """Time passes, in which the robot goes on."""
        self.now += seconds
        while (self._tick + 1) * T <= self.now + 1e-9:
            self._tick += 1
            self._cycle()

    def read_once(self) -> RobotState:
        self._wait(self._tick)
        return self._state()

    def start_torque_control(self) -> ActiveControl:
        return self._start(Torques)

    def start_joint_velocity_control(self, mode: ControllerMode) -> ActiveControl:
        return self._start(JointVelocities)

    def start_joint_position_control(self, mode: ControllerMode) -> ActiveControl:
        return self._start(JointPositions)

    def stop(self) -> None:
        """It brakes by itself: here at once."""
        self.mode, self.v, self.kind = RobotMode.Idle, np.zeros(7), None

    def automatic_error_recovery(self) -> None:
        self.recovered += 1
        self.mode, self.reflex = RobotMode.Idle, ""

    def _start(self, kind: type[_Message]) -> ActiveControl:
        if self.mode != RobotMode.Idle:
            raise CommandException(f"command rejected: {self.reflex}")
        self.mode, self.kind = RobotMode.Move, kind
        self.told = [self.q.copy(), np.zeros(7), np.zeros(7)]
        self.torque = np.zeros(7)
        self._answer, self._armed, self._in_a_row = None, False, 0
        return ActiveControl(self)

    def _wait(self, after: int) -> None:
        if self.unplugged:
            raise NetworkException("UDP receive: Timeout")
        if self._tick <= after:
            self.sleep((after + 1) * T - self.now)

    def _state(self) -> RobotState:
        values = [self.q, self.v, self.torque + self.model.bias(self.q, np.zeros(7)), *self.told, self.torque]
        rate = 1.0 - min(self._in_a_row + self.lost, 100) / 100.0 if self.kind else 0.0
        return RobotState(*(np.float32(value).astype(float).tolist() for value in values), self.mode, rate)

    def _cycle(self) -> None:
        answer, self._answer = self._answer, None
        if self.kind is None or not (self._armed or answer):
            return
        self._armed = True
        self.cycles += 1
        self.lost += answer is None
        self._in_a_row = 0 if answer else self._in_a_row + 1
        if self._in_a_row >= MOST_LOST:
            self._abort("communication_constraints_violation")
        elif self.kind is Torques:
            self._move_by_torque(answer)
        else:
            self._move_along(answer)

    def _move_by_torque(self, answer: _Message | None) -> None:
        if answer is not None:
            rate = (np.array(answer.values) - self.torque) / T
            if np.abs(rate).max() > 1000.0:
                self._abort("controller_torque_discontinuity")
                return
            self.torque = np.array(answer.values)
        bias = self.model.bias(self.q, self.v) - self.model.bias(self.q, np.zeros(7))
        self.v = self.v + T * np.linalg.solve(self.model.mass_matrix(self.q), self.torque - bias)
        self.q = self.q + T * self.v

    def _move_along(self, answer: _Message | None) -> None:
        p, v, a = self.told
        if answer is None:
            next_v, next_a = v + T * a, a
        else:
            values = np.array(answer.values)
            next_v = (values - p) / T if self.kind is JointPositions else values
            next_a = (next_v - v) / T
            room_above = np.sqrt(2.0 * DECELERATION * np.maximum(0.0, UPPER - self.q)) - OFFSET
            room_below = np.sqrt(2.0 * DECELERATION * np.maximum(0.0, self.q - LOWER)) - OFFSET
            if np.abs(next_a - a).max() / T > 5000.0:
                self._abort("joint_motion_generator_acceleration_discontinuity")
                return
            if np.abs(next_a).max() > 10.0:
                self._abort("joint_motion_generator_velocity_discontinuity")
                return
            if (next_v > np.minimum(SPEED, room_above)).any() or (
                -next_v > np.minimum(SPEED, room_below)
            ).any():
                self._abort("joint_motion_generator_velocity_limits_violation")
                return
        self.told = [p + T * next_v, next_v, next_a]
        self.q, self.v = self.told[0].copy(), next_v.copy()

    def _abort(self, why: str) -> None:
        self.mode, self.reflex, self.kind, self.v = RobotMode.Reflex, why, None, np.zeros(7)


class ActiveControl:
    """A motion that is under way."""

    def __init__(self, robot: FrankaRobot) -> None:
        self._robot, self._read = robot, robot._tick
        self._first = True

    def readOnce(self) -> tuple[RobotState, Duration]:
        robot, before = self._robot, self._read
        robot._wait(before)
        self._check()
        self._read = robot._tick
        passed = 0 if self._first else self._read - before
        self._first = False
        return robot._state(), Duration(passed * T)

    def writeOnce(self, message: Any) -> None:
        robot = self._robot
        self._check()
        assert type(message) is robot.kind
        assert len(message.values) == 7
        assert all(map(math.isfinite, message.values))
        if message.motion_finished:
            robot.stop()
        elif self._read == robot._tick:  # late answers are dropped
            robot._answer = message

    def _check(self) -> None:
        if self._robot.kind is None:
            raise ControlException(f"motion aborted by reflex! [{self._robot.reflex!r}]")
