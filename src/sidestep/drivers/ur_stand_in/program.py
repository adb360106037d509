"""The script that `ur-rtde` sends to a UR, as far as a driver needs it: commands come by registers."""

from __future__ import annotations

import math

import numpy as np

from sidestep.drivers.ur_stand_in.joints import Brake, Joints, Servo, Speed
from sidestep.drivers.ur_stand_in.registers import Registers
from sidestep.drivers.ur_stand_in.tip import tip_pose

READY, DONE = 1, 2  # what output_int_register_0 says of the command in input_int_register_0
NOTHING, SPEED_J, SERVO_J, SPEED_STOP, SERVO_STOP = 0, 9, 11, 15, 16
PROTECTIVE_STOP, STOP_L, STOP_J, WATCHDOG, FORWARD_KINEMATICS, STOP_SCRIPT = 31, 33, 34, 35, 44, 255
AT_ONCE = (SPEED_J, SERVO_J)  # need no answer
ROUNDING = 1e-9  # [s] of the box's clock
SLOWEST_STOP = 0.1  # [rad/s²]


class ProtectiveStop(Exception):
    """The program has asked for a protective stop."""


class ScriptError(Exception):
    """The program cannot go on, and says why."""


class ControlProgram:
    """Reads a command from the registers once a period and moves the joints by it.

    Attributes:
        watchdog: [s] how long the registers may stay unwritten; inf: no watchdog.
    """

    def __init__(self, joints: Joints, registers: Registers) -> None:
        """Begins: ready for a command."""
        self.watchdog = math.inf
        self._joints, self._registers = joints, registers
        self._answered = self._stops = False
        registers.set_output(READY)

    def step(self, silence: float) -> bool:
        """Obeys the registers' command; false: the program has ended.

        Args:
            silence: for how long nobody has written to the registers [s].

        Raises:
            ProtectiveStop: it was asked for.
            ScriptError: the command is none that this program knows, or its values are not allowed.
        """
        if silence > self.watchdog + ROUNDING:
            raise ScriptError(
                f"the watchdog ended the program: no input for {1e3 * silence:.0f} ms, at most "
                f"{1e3 * self.watchdog:.0f} ms are allowed"
            )
        if self._stops:
            self._stops = not self._joints.resting
            if self._stops:
                return True
            self._registers.set_output(DONE)
        command = self._registers.command
        if command in AT_ONCE:
            self._move(command)
            self._registers.set_output(READY)
        elif command == NOTHING:
            self._answered = False
            self._registers.set_output(READY)
        elif not self._answered:
            self._answered = True
            return self._obey(command)
        return True

    def _move(self, command: int) -> None:
        values = self._registers.doubles(11)
        if not np.isfinite(values).all():
            raise ScriptError(f"command {command} with {values.tolist()}: not finite")
        if command == SERVO_J:
            lookahead, gain = float(values[9]), float(values[10])
            if not (0.03 <= lookahead <= 0.2 and 100.0 <= gain <= 2000.0):
                raise ScriptError(f"servoj with lookahead_time {lookahead} and gain {gain}")
            self._joints.motion = Servo(values[:6].copy(), lookahead, gain)
        else:
            if not values[6] > 0.0:
                raise ScriptError(f"speedj with an acceleration of {values[6]} rad/s²")
            self._joints.motion = Speed(values[:6].copy(), float(values[6]))

    def _obey(self, command: int) -> bool:
        value = float(self._registers.doubles(1)[0])
        if command == STOP_SCRIPT:
            return False
        if command == PROTECTIVE_STOP:
            raise ProtectiveStop("the program asked for it")
        if command in (SPEED_STOP, SERVO_STOP, STOP_J, STOP_L):
            self._joints.motion, self._stops = Brake(max(SLOWEST_STOP, value)), True
            return True
        if command == WATCHDOG:
            self.watchdog = 1.0 / value if value > 0.0 else math.inf
        elif command == FORWARD_KINEMATICS:
            self._registers.set_output_doubles(tip_pose(self._joints.arm, self._registers.doubles(6)))
        else:
            raise ScriptError(f"command {command} is not known to the stand-in")
        self._registers.set_output(DONE)
        return True
