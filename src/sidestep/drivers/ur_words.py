"""What a UR says of itself, in words: numbers of RTDE and names of its models."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sidestep._core import JointLimits

NORMAL, PROTECTIVE_STOP = 1, 3  # of the safety mode
MAY_MOVE = (NORMAL, 2)  # safety modes: normal, reduced
RUNNING = 7  # of the robot's mode
PROGRAM_RUNNING, FREEDRIVE = 1 << 1, 1 << 2  # of the robot's status bits
SAFETY = {
    3: "PROTECTIVE_STOP; find out why, then call recover()",
    4: "RECOVERY: a joint is beyond its safety limit; move it back on the pendant",
    5: "SAFEGUARD_STOP; it ends at the safeguard",
    6: "SYSTEM_EMERGENCY_STOP; release it, then switch on and release the brakes",
    7: "ROBOT_EMERGENCY_STOP; release it, then switch on and release the brakes",
    8: "VIOLATION of a safety limit; restart the safety system on the pendant",
    9: "FAULT of the safety system; see the pendant",
    10: "VALIDATE_JOINT_ID; see the pendant",
    11: "UNDEFINED_SAFETY_MODE; see the pendant",
    12: "AUTOMATIC_MODE_SAFEGUARD_STOP; it ends at the safeguard",
    13: "SYSTEM_THREE_POSITION_ENABLING_STOP; it ends at the enabling device",
}
MODES = {
    -1: "NO_CONTROLLER",
    0: "DISCONNECTED",
    1: "CONFIRM_SAFETY",
    2: "BOOTING",
    3: "POWER_OFF",
    4: "POWER_ON",
    5: "IDLE",
    6: "BACKDRIVE",
    7: "RUNNING",
    8: "UPDATING_FIRMWARE",
}
JOINTS = (
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)
FASTEST = 40.0  # [rad/s²] the largest acceleration that ur-rtde sends
OVER_SPEED = 11.0  # [°/s] by which a joint may exceed its rated speed before the safety system stops it
# Rated speeds [°/s] and torques [Nm] of the joints, from the data sheets; the shipped arm of the CB3 series.
_RATED = {
    "UR3": ((180.0, 180.0, 180.0, 360.0, 360.0, 360.0), (56.0, 56.0, 28.0, 12.0, 12.0, 12.0)),
    "UR5": ((180.0,) * 6, (150.0, 150.0, 150.0, 28.0, 28.0, 28.0)),
    "UR10": ((120.0, 120.0, 180.0, 180.0, 180.0, 180.0), (330.0, 330.0, 150.0, 56.0, 56.0, 56.0)),
    "UR16": ((120.0, 120.0, 180.0, 180.0, 180.0, 180.0), (330.0, 330.0, 150.0, 56.0, 56.0, 56.0)),
}
SHIPPED = {"UR5": "ur5", "UR10": "ur10"}


@dataclass(frozen=True)
class Status:
    """What a UR said of itself last.

    Attributes:
        safety, mode: its safety mode and its mode, as RTDE numbers them. bits: of the robot's status.
    """

    safety: int
    mode: int
    bits: int

    @property
    def is_running_a_program(self) -> bool:
        """Whether a script runs."""
        return bool(self.bits & PROGRAM_RUNNING)

    def why_it_rests(self) -> str:
        """Why the robot cannot move, in its own words and what to do; "": it can."""
        if self.safety not in MAY_MOVE:
            return f"safety mode {self.safety}: {SAFETY.get(self.safety, 'unknown')}"
        if self.mode != RUNNING:
            return (
                f"robot mode {self.mode}: {MODES.get(self.mode, 'unknown')}; switch on and release the brakes"
            )
        if self.bits & FREEDRIVE:
            return "the freedrive button is pressed"
        return ""


def limits_of(model: str) -> JointLimits | None:
    """What the safety system of a model allows at most (`OVER_SPEED` above its rated speeds); None: not known here.

    Args:
        model: as the dashboard names it, for example "UR10".
    """
    if model not in _RATED:
        return None
    speeds, torques = _RATED[model]
    turn = np.full(len(JOINTS), 2.0 * math.pi)
    return JointLimits(
        lower=-turn,
        upper=turn,
        velocity=np.radians(np.array(speeds) + OVER_SPEED),
        acceleration=np.full(len(JOINTS), FASTEST),
        effort=np.array(torques),
    )
