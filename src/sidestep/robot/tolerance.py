"""How near is near enough: tolerances by the kind of joint."""

from __future__ import annotations

import numpy as np

from sidestep.robot.link import Array
from sidestep.robot.model import Robot

SLIDING = 0.1  # [m/rad] of the tolerance of turning joints, as `ArrivalSettings` have it: 0.05 rad and 5 mm


def tolerances(robot: Robot, angle: float) -> Array:
    """Of every joint (nv,): `angle` [rad] where it turns, a tenth of that [m] where it slides."""
    slides = np.array([unit == "m" for unit in robot.coordinate_units])
    return np.asarray(np.where(slides, SLIDING * angle, angle))
