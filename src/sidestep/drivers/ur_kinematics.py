"""Whether a robot and an arm of Sidestep are the same: where each has the flange."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from sidestep._core import Robot

BASE, FLANGE = "base", "tool0"  # links of every description of a UR
POSTURES = ((0.0,) * 6, (0.4, -1.2, 1.0, -0.7, 0.9, 0.3), (-1.1, -0.6, -1.4, 0.5, -0.8, 1.2))  # [rad]


def check_kinematics(
    flange_at: Callable[[list[float]], Sequence[float]], robot: Robot, tolerance: float
) -> None:
    """Compares the flange's position in the robot's base frame at some postures, none of which the arm goes to.

    Args:
        flange_at: what the robot says for joint positions [rad]: pose of its flange in its base, position first [m].
        robot: the model. tolerance: [m]; a robot's own calibration differs from the description by some millimetres.

    Raises:
        ValueError: they differ by more, or the model lacks the links "base" and "tool0".
    """
    missing = {BASE, FLANGE} - {frame.name for frame in robot.frames}
    if missing:
        raise ValueError(
            f"arm {robot.name!r} lacks {sorted(missing)}, links by which it is compared with the robot"
        )
    for posture in POSTURES:
        said = np.array(flange_at(list(posture))[:3])
        q = np.array(posture)
        base, flange = robot.pose(q, BASE), robot.pose(q, FLANGE)
        ours = base[:3, :3].T @ (flange[:3, 3] - base[:3, 3])
        if not float(np.linalg.norm(said - ours)) <= tolerance:
            raise ValueError(
                f"at joint positions {posture} the robot has its flange at {np.round(said, 3).tolist()} m, the arm "
                f"{robot.name!r} at {np.round(ours, 3).tolist()} m: it is another arm (the shipped ur5 and ur10 are of "
                "the CB3 series); make one from the robot's own URDF"
            )
