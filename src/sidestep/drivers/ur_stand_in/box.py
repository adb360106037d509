"""The controller box: its joints, program and safety, and what it says of them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from sidestep.arm import Arm
from sidestep.drivers.ur_stand_in.joints import TORQUE_CONSTANT, Array, Brake, Joints
from sidestep.drivers.ur_stand_in.program import ControlProgram, ProtectiveStop, ScriptError
from sidestep.drivers.ur_stand_in.registers import Registers
from sidestep.drivers.ur_stand_in.tip import tip_pose

# Safety modes, robot modes and states of the program, by their numbers in RTDE.
NORMAL, PROTECTIVE, EMERGENCY = 1, 3, 7
POWER_OFF, IDLE, RUNNING = 3, 5, 7
STOPPED, PLAYING = 1, 2
JOINT_RUNNING, JOINT_IDLE = 253, 255
SAFETY_BITS = {NORMAL: 1 << 0, PROTECTIVE: 1 << 2 | 1 << 10, EMERGENCY: 1 << 6 | 1 << 7 | 1 << 10}
SAFETY_WORDS = {NORMAL: "NORMAL", PROTECTIVE: "PROTECTIVE_STOP", EMERGENCY: "ROBOT_EMERGENCY_STOP"}
MODE_WORDS = {POWER_OFF: "POWER_OFF", IDLE: "IDLE", RUNNING: "RUNNING"}


class Box:
    """One robot with its controller. Time is its own: `step` moves it on by one period.

    Attributes:
        arm: the model. period: [s]. time: since it was switched on [s].
        joints, registers: what moves, and what programs and clients share.
        safety, mode: numbers as RTDE sends them.
        freedrive: whether somebody holds the freedrive button.
        counts: how many protective stops, programs and program errors there were.
    """

    def __init__(
        self,
        arm: Arm,
        start: Array,
        *,
        period: float,
        unlock_after: float,
        log: Callable[[str], None],
    ) -> None:
        """Switched on, brakes released, no program.

        Args:
            arm: the model. start: (6,) [rad]. period: [s].
            unlock_after: [s] from a protective stop until it may be unlocked.
            log: is told what happens.
        """
        self.arm, self.period, self.time = arm, period, 0.0
        self.joints, self.registers = Joints(arm, start, period), Registers()
        self.safety, self.mode, self.freedrive = NORMAL, RUNNING, False
        self.counts = {"protective stops": 0, "programs": 0, "program errors": 0}
        self.unlock_after, self._stopped_at, self.log = unlock_after, -math.inf, log
        self._program: ControlProgram | None = None

    @property
    def playing(self) -> bool:
        """Whether a program runs."""
        return self._program is not None

    def step(self) -> None:
        """One period: the program, then the joints."""
        self.time += self.period
        if self._program is not None:
            try:
                if not self._program.step(self.time - self.registers.written):
                    self.stop_program()
            except ProtectiveStop as asked:
                self.protective_stop(str(asked))
            except ScriptError as error:
                self.counts["program errors"] += 1
                self.log(f"program error: {error}")
                self.stop_program()
        trouble = self.joints.step()
        if trouble and self.safety == NORMAL:
            self.protective_stop(trouble)

    def run_script(self, script: str) -> None:
        """Starts what a client sent, if the robot may move; only the control program of ur-rtde is known."""
        if self.safety != NORMAL or self.mode != RUNNING or self.freedrive:
            self.log(f"script refused: {self.safety_words}, {self.mode_words}, freedrive {self.freedrive}")
        elif "def rtde_control" not in script:
            self.log(f"script refused: not that of ur-rtde, but {script[:40]!r}")
        else:
            self.stop_program()
            self.counts["programs"] += 1
            self.registers.values["input_int_register_0"] = 0
            self.registers.written = self.time
            self._program = ControlProgram(self.joints, self.registers)
            self.log("program started")

    def stop_program(self) -> None:
        """The program ends and the arm brakes."""
        if self._program is not None:
            self._program = None
            self.log("program stopped")
        self.joints.motion = Brake()
        self.registers.set_output(0)

    def protective_stop(self, why: str) -> None:
        """The arm brakes and stays until somebody unlocks it."""
        self.stop_program()
        self.safety, self._stopped_at = PROTECTIVE, self.time
        self.counts["protective stops"] += 1
        self.log(f"protective stop: {why}")

    def unlock(self) -> str:
        """Ends a protective stop; what the dashboard answers."""
        if self.safety != PROTECTIVE:
            return "Protective stop releasing"
        if self.time - self._stopped_at < self.unlock_after:
            return (
                f"Cannot unlock protective stop until {self.unlock_after:g}s after occurrence. "
                "Always inspect cause of protective stop before unlocking"
            )
        self.safety = NORMAL
        self.log("protective stop unlocked")
        return "Protective stop releasing"

    def emergency_stop(self, pressed: bool) -> None:
        """Somebody presses the button, or releases it: then the power is off."""
        if pressed:
            self.stop_program()
            self.safety = EMERGENCY
        elif self.safety == EMERGENCY:
            self.safety, self.mode = NORMAL, POWER_OFF
        self.log(f"emergency stop {'pressed' if pressed else 'released'}")

    def switch_on(self) -> None:
        """Somebody ends every stop, switches the power on and releases the brakes."""
        self.safety, self.mode, self.freedrive = NORMAL, RUNNING, False
        self.log("switched on")

    def set_freedrive(self, held: bool) -> None:
        """Somebody holds the freedrive button, or lets go: no program runs meanwhile."""
        if held:
            self.stop_program()
        self.freedrive = held
        self.log(f"freedrive {'held' if held else 'ended'}")

    @property
    def safety_words(self) -> str:
        """The safety mode, as the dashboard names it."""
        return SAFETY_WORDS[self.safety]

    @property
    def mode_words(self) -> str:
        """The robot's mode, as the dashboard names it."""
        return MODE_WORDS[self.mode]

    def value(self, name: str) -> Any:
        """What RTDE sends for a variable; 0 where the stand-in has no such thing.

        Args:
            name: as in RTDE's guide.
        """
        if name in self.registers.values:
            return self.registers.values[name]
        return KNOWN[name](self) if name in KNOWN else 0


KNOWN: dict[str, Callable[[Box], Any]] = {  # by their names in RTDE's guide
    "timestamp": lambda box: box.time,
    "actual_q": lambda box: box.joints.position,
    "actual_qd": lambda box: box.joints.velocity,
    "target_q": lambda box: box.joints.target,
    "target_qd": lambda box: box.joints.target_velocity,
    "target_qdd": lambda box: box.joints.target_acceleration,
    "target_moment": lambda box: box.joints.torque,
    "actual_current": lambda box: box.joints.torque / TORQUE_CONSTANT,
    "target_current": lambda box: box.joints.torque / TORQUE_CONSTANT,
    "actual_TCP_pose": lambda box: tip_pose(box.arm, box.joints.position),
    "robot_mode": lambda box: box.mode,
    "joint_mode": lambda box: (JOINT_RUNNING if box.mode == RUNNING else JOINT_IDLE,) * 6,
    "safety_mode": lambda box: box.safety,
    "safety_status": lambda box: box.safety,
    "safety_status_bits": lambda box: SAFETY_BITS[box.safety],
    "robot_status_bits": lambda box: int(box.mode == RUNNING) | box.playing << 1 | box.freedrive << 2,
    "runtime_state": lambda box: PLAYING if box.playing else STOPPED,
    "speed_scaling": lambda box: 1.0,
    "target_speed_fraction": lambda box: 1.0,
}
