"""How the stand-in's joints move: a servo that follows what the program asks for, and drives that follow the servo."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from sidestep.arm import Arm

Array: TypeAlias = NDArray[np.float64]

FASTEST = 40.0  # [rad/s²] the largest acceleration that a script may ask for, and that the target may have
OVER_SPEED = math.radians(
    11.0
)  # [rad/s] the safety limit of a joint's speed beyond its rated speed: 191 and 180 °/s
BRAKE = 20.0  # [rad/s²] of the brakes in a stop that nobody has asked for
DRIVE_LAG = 0.004  # [s] by which the joints follow the target
TORQUE_CONSTANT = 10.0  # [Nm/A] of the currents that are sent: a UR says currents, not torques


@dataclass(frozen=True)
class Servo:
    """`servoj`: q'' = gain (q_d - q - lookahead v), q and v: of the target.

    Attributes:
        position: q_d (6,) [rad]. lookahead: [s]. gain: [1/s²].
    """

    position: Array
    lookahead: float
    gain: float


@dataclass(frozen=True)
class Speed:
    """`speedj`: the target's velocity goes straight to v_d; the joint that needs longest with this acceleration.

    Attributes:
        velocity: v_d (6,) [rad/s]. acceleration: [rad/s²].
    """

    velocity: Array
    acceleration: float


@dataclass(frozen=True)
class Brake:
    """To rest, all joints at once.

    Attributes:
        deceleration: of the fastest joint [rad/s²].
    """

    deceleration: float = BRAKE


Motion: TypeAlias = Servo | Speed | Brake


class Joints:
    """Six joints that follow a `Motion`; `step` says what a UR would stop for.

    Attributes:
        motion: what they do.
        target, target_velocity, target_acceleration: (6,) [rad], [/s], [/s²] what the servo asks of the drives.
        position, velocity: (6,) [rad], [rad/s] of the joints: (target - position) / `DRIVE_LAG` is the velocity.
        torque: (6,) [Nm] of the model at the target, gravity included.
    """

    def __init__(self, arm: Arm, start: Array, period: float) -> None:
        """At rest.

        Args:
            arm: the model, whose limits are those of the joints.
            start: (6,) [rad]. period: of a step [s].
        """
        self.arm, self.period = arm, period
        self.motion: Motion = Brake()
        self.target, self.position = start.copy(), start.copy()
        self.target_velocity, self.target_acceleration = np.zeros_like(start), np.zeros_like(start)
        self.velocity = np.zeros_like(start)
        self.torque = arm.bias(start, self.velocity)
        self._kept = math.exp(-period / DRIVE_LAG)  # share of the lag that is left after a step

    @property
    def resting(self) -> bool:
        """Whether the target stands still and the joints have come to it (0.1 mrad/s)."""
        return not self.target_velocity.any() and float(np.abs(self.velocity).max()) < 1e-4

    def step(self) -> str | None:
        """Moves by one period; why a UR would stop by itself, or None."""
        wanted = self._acceleration()
        trouble = self._trouble(wanted)
        self.target_acceleration = wanted
        self.target_velocity = self.target_velocity + self.period * wanted
        if not isinstance(self.motion, Servo):
            self.target_velocity[np.abs(self.target_velocity) < 1e-12] = 0.0
        self.target = self.target + self.period * self.target_velocity
        before = self.position
        self.position = self.target + self._kept * (self.position - self.target)
        self.velocity = (self.position - before) / self.period
        self.torque = self.arm.mass_matrix(self.target) @ wanted + self.arm.bias(
            self.target, self.target_velocity
        )
        return trouble

    def _acceleration(self) -> Array:
        motion, v = self.motion, self.target_velocity
        if isinstance(motion, Servo):
            return np.asarray(motion.gain * (motion.position - self.target - motion.lookahead * v))
        goal = np.zeros_like(v) if isinstance(motion, Brake) else motion.velocity
        change, limit = goal - v, motion.deceleration if isinstance(motion, Brake) else motion.acceleration
        farthest = float(np.abs(change).max())
        share = min(1.0, limit * self.period / farthest) if farthest > 0.0 else 0.0
        return np.asarray(share * change / self.period)

    def _trouble(self, acceleration: Array) -> str | None:
        limits, names = self.arm.limits, self.arm.robot.coordinate_names
        speed = np.abs(self.target_velocity + self.period * acceleration)
        torque = np.abs(self.torque)
        beyond = np.maximum(self.target - limits.upper, limits.lower - self.target)
        rules = (
            (
                np.abs(acceleration),
                np.full_like(speed, FASTEST),
                "a sudden change of the target: {:.1f} rad/s²",
            ),
            (speed, limits.velocity + OVER_SPEED, "the joint is too fast: {:.2f} rad/s"),
            (torque, limits.effort, "the joint needs too much torque: {:.0f} Nm"),
            (beyond, np.zeros_like(speed), "the joint is beyond its limit by {:.3f} rad"),
        )
        for values, most, words in rules:
            if (values > most).any():
                worst = int(np.argmax(values - most))
                return f"{names[worst]}: " + words.format(values[worst])
        return None
