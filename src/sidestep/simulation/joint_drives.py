"""The drives of a simulated arm: what they are told becomes a torque within the arm's effort limits."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from sidestep._core import RigidBodyDynamics
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]
Output = Literal["torque", "acceleration", "velocity", "position"]
OUTPUTS: tuple[Output, ...] = get_args(Output)

FREQUENCY = (
    100.0  # [1/s] natural frequency w of the position drive: faster than the controller's feedback, 60
)
VELOCITY_GAIN = 200.0  # [1/s] gain k of the velocity drive, which has the same damping
STOP_FREQUENCY = 40.0  # [1/s] of the drive that follows a stop: torques change as slowly as the motors allow
STOP_SHARE = 0.5  # of the acceleration limits that a stop uses
STOP_JERK = 0.2  # share of the jerk limits with which it begins
STOP_RATE_SHARE = 0.5  # of the torque's rate that the reference of a stop uses; feedback has the rest
STOP_RATE = 20.0  # [1/s] of the last part of a stop: it ends without a leap of the acceleration
FOLLOWING = 0.005  # [s] at its velocity limit: farther a joint may not be behind a position drive's reference
OVERSPEED = 1.1  # share of the velocity limits that told positions may ask for
UNLIMITED = 10.0, 1000.0  # acceleration [rad/s^2] and jerk [rad/s^3] of a stop of joints without such limits


class JointDrives:
    """Computed-torque drives of every joint; they compensate gravity themselves.

    With M the mass matrix, h Coriolis and gravity, g gravity alone, u clipped to the effort limits:
        torque:        u = tau + g
        acceleration:  u = M a + h
        velocity:      u = M k (v_d - v) + h,                          k = `VELOCITY_GAIN`
        position:      u = M (w^2 (q_d - q) + 2 w (v_d - v)) + h,      w = `FREQUENCY`
    A position is to be reached at the end of the cycle. v_d is that between the last two commands; where none comes,
    q_d moves on with it. Positions that no arm can follow are a fault, see `fault`. A stop is a reference that slows
    down along its direction, and a position drive that follows it with w = `STOP_FREQUENCY`. Torques change no faster
    than their rate limits: a larger step, as after lost commands, is approached at that rate, all joints by the same
    share.

    Args:
        robot: with inertias and effort limits. period: of a cycle [s].
        ramps: False: torques leap as they are told.

    Attributes:
        asked: (nv,) torque that was asked for in the last cycle [Nm | N].
        leap: its change from the cycle before, as a share of what the motors can change, largest joint.
        fault: why told positions cannot be followed, in words; "" where they can.
    """

    def __init__(self, robot: Robot, *, period: float, ramps: bool = True) -> None:
        self._dynamics = RigidBodyDynamics(robot, robot.inertials)
        self._names, self._speed = robot.coordinate_names, robot.limits.velocity
        self._effort, self._effort_step = robot.limits.effort, robot.limits.effort_rate * period
        self._ramps = ramps
        limits = robot.limits
        self._stop_acceleration = STOP_SHARE * _finite(limits.acceleration, UNLIMITED[0])
        self._stop_jerk_step = STOP_JERK * period * _finite(limits.jerk, UNLIMITED[1])
        self._period = period
        self._output: Output | None = None  # None: a stop, or holding
        self._still = self._told = np.zeros(robot.num_coordinates)
        self._since = 1  # cycles since the last command
        self._q = self._v = self._a = self._told
        self._last: Array | None = None
        self.asked, self.leap, self.fault = self._told, 0.0, ""

    def hold(self, q: Array, v: Array, a: Array | None = None) -> None:
        """Comes to rest from q, v, a (nv,), and holds that place; without a from no acceleration."""
        self._output, self._q, self._v, self.fault = None, q, v, ""
        self._a = np.zeros_like(v) if a is None else a

    def take(self, output: Output, values: Array) -> None:
        """Takes a command (nv,) [Nm | N], [rad/s^2 | m/s^2], [rad/s | m/s] or [rad | m]."""
        if output == "position":
            if self._output == "position":
                self._v = (values - self._told) / (self._since * self._period)
                self._notice(np.abs(self._v) / self._speed, OVERSPEED, "a speed of {:.3g} times its limit")
            self._q = values
        elif output == "velocity":
            self._v = values
        self._output, self._told, self._since = output, values, 0

    def torque(self, q: Array, v: Array) -> Array:
        """Torque (nv,) [Nm | N] of the motors, gravity included, at q, v (nv,) for the next cycle."""
        if self._output == "torque":
            wanted = self._told + self._dynamics.bias(q, self._still)
        else:
            mass = self._dynamics.mass_matrix(q)
            wanted = mass @ self._acceleration(q, v, mass) + self._dynamics.bias(q, v)
        self.asked, self.leap = wanted, 0.0
        if self._last is not None:
            change = (
                wanted - self._last
            )  # all joints by one share: light links are not thrown about by heavy ones
            self.leap = float((np.abs(change) / self._effort_step).max())
            if self.leap > 1.0 and (self._ramps or self._output is None):
                wanted = self._last + change / self.leap
        self._since += 1
        self._last = np.clip(wanted, -self._effort, self._effort)
        return self._last

    def _acceleration(self, q: Array, v: Array, mass: Array) -> Array:
        """What the drives ask for (nv,); moves the reference of position drives on by a cycle."""
        if self._output == "acceleration":
            return self._told
        if self._output == "velocity":
            return VELOCITY_GAIN * (self._v - v)
        if self._output == "position":
            if self._since > 0:  # no command for this cycle
                self._q = self._q + self._period * self._v
            now = self._q - self._period * self._v
            self._notice(
                np.abs(now - q) / self._speed, FOLLOWING, "it is {:.3g} s at its velocity limit behind"
            )
            return FREQUENCY**2 * (now - q) + 2.0 * FREQUENCY * (self._v - v)
        w = STOP_FREQUENCY
        feedback = w**2 * (self._q - q) + 2.0 * w * (self._v - v)
        self._slow_down(mass)
        return self._a + feedback

    def _notice(self, found: Array, most: float, words: str) -> None:
        joint = int(np.argmax(found))
        if not found[joint] <= most and not self.fault:
            why = words.format(found[joint])
            self.fault = f"positions told to joint '{self._names[joint]}' cannot be followed: {why}"

    def _slow_down(self, mass: Array) -> None:
        """One cycle of the reference of a stop: all joints slow down in proportion, as fast as their motors allow."""
        most = float((np.abs(self._v) / self._stop_acceleration).max())  # [s] until it rests
        wanted = -self._v * min(STOP_RATE, 1.0 / max(most, 1e-9))
        change = np.clip(wanted - self._a, -self._stop_jerk_step, self._stop_jerk_step)
        used = float((np.abs(mass @ change) / self._effort_step).max())  # share of the torque's rate
        self._a = self._a + change / max(1.0, used / STOP_RATE_SHARE)
        self._v = self._v + self._period * self._a
        self._q = self._q + self._period * self._v


def _finite(limits: Array, otherwise: float) -> Array:
    return np.where(np.isfinite(limits), limits, otherwise)
