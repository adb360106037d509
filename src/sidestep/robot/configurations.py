"""Configurations of an arm: drawn within its limits, and checked against them."""

from __future__ import annotations

from zlib import crc32

import numpy as np
from numpy.typing import ArrayLike

from sidestep import _core
from sidestep.robot.degrees import degrees_hint
from sidestep.robot.link import Array


def finite_interval(limits: _core.JointLimits) -> tuple[Array, Array]:
    """The position limits, with 2 pi from the one bound, or ±pi, where a coordinate is not bounded."""
    lower, upper = np.array(limits.lower), np.array(limits.upper)
    free = np.isinf(lower) & np.isinf(upper)
    lower[free], upper[free] = -np.pi, np.pi
    below, above = np.isinf(lower), np.isinf(upper)
    lower[below], upper[above] = upper[below] - 2.0 * np.pi, lower[above] + 2.0 * np.pi
    return lower, upper


def random_configurations(robot: _core.Robot, count: int, seed: int) -> Array:
    """See `Robot.random_configurations`."""
    lower, upper = finite_interval(robot.limits)
    shares = [
        np.random.default_rng((seed, crc32(name.encode()))).random(count) for name in robot.coordinate_names
    ]
    values: Array = lower + (upper - lower) * np.stack(shares, axis=1)
    return values


def checked(robot: _core.Robot, q: ArrayLike, name: str) -> Array:
    """See `Robot.check_configuration`."""
    array = _shaped(robot, q, name)
    limits, rounding = robot.limits, _core.JointLimits.rounding
    for k, (joint, value, lower, upper) in enumerate(
        zip(robot.coordinate_names, array, limits.lower, limits.upper, strict=True)
    ):
        if not (np.isfinite(value) and lower - rounding <= value <= upper + rounding):
            turns = {item.coordinate for item in robot.joints if item.type == _core.JointType.revolute}
            unit, hint = "rad" if k in turns else "m", degrees_hint(array[sorted(turns)])
            raise ValueError(
                f"{name}: joint {joint!r} is {value} {unit}, allowed: [{lower}, {upper}] {unit}{hint}"
            )
    return array


def finite_vector(robot: _core.Robot, value: ArrayLike, name: str) -> Array:
    """The value as an array (nv,); raises ValueError where it has another shape or is not finite."""
    array = _shaped(robot, value, name)
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite, got {array}")
    return array


def _shaped(robot: _core.Robot, value: ArrayLike, name: str) -> Array:
    array: Array = _core.real_array(value, name)
    if array.shape != (robot.num_coordinates,):
        raise ValueError(f"{name} has shape {array.shape}, expected ({robot.num_coordinates},)")
    return array
