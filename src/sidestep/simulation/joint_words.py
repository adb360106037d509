"""Errors of joints and poses in words: revolute joints in rad, prismatic joints in mm, poses in mm and degrees."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from sidestep.robot import Robot

Array = npt.NDArray[np.float64]


def largest_ways(robot: Robot, ways: Array) -> tuple[float | None, float | None]:
    """The largest |way| of revolute joints [rad] and of prismatic joints [m] among (nv,); None without such a joint."""
    slides = np.array([unit == "m" for unit in robot.coordinate_units])
    sizes = np.abs(ways)
    turning, sliding = sizes[~slides], sizes[slides]
    return (
        float(turning.max()) if turning.size else None,
        float(sliding.max()) if sliding.size else None,
    )


def in_words(
    angle: float | None, length: float | None, *, radians: str = ".4g", millimetres: str = ".4g"
) -> str:
    """An angle [rad] and a length [m], either of which may be None, such as "0.31 rad and 12 mm".

    `radians` and `millimetres` are the formats of the numbers.
    """
    words = [] if angle is None else [f"{angle:{radians}} rad"]
    if length is not None:
        words.append(f"{1000.0 * length:{millimetres}} mm")
    return " and ".join(words)


def pose_in_words(distance: float, angle: float) -> str:
    """An error of a pose, by distance [m] and angle [rad], such as "1228 mm and 56°"; below 10 with a tenth."""
    numbers = 1000.0 * distance, math.degrees(angle)
    millimetres, degrees = (f"{value:.{1 if value < 10.0 else 0}f}" for value in numbers)
    return f"{millimetres} mm and {degrees}°"
