"""Limits of an arm's joints: from the file, in place of it, or as they are where neither says."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from sidestep._core import JointLimits, real_array
from sidestep.robot.link import Array
from sidestep.robot.plausibility import check_limits
from sidestep.robot.remarks import Remarks
from sidestep.robot.urdf import UrdfJoint

LimitValues: TypeAlias = ArrayLike | Mapping[str, float]
"""A number for every joint, one per coordinate (nv,), or some by the names of their joints."""

DEFAULT_ACCELERATION_LIMIT = 10.0
"""Acceleration limit where none is given, [rad/s^2] or [m/s^2], as URDF has none: the FR3's official value on
every joint, that of the thesis's controller, and the order of what other arms of this size are rated for."""
_DEFAULT_JERK = 100.0  # [1/s] times the acceleration limit: that of the core
NO_EFFORT = (
    "no effort limit is given (missing or zero); torque output needs one: pass effort_limits, for example "
    "effort_limits={{{name!r}: 87.0}} [Nm | N]"
)
NO_VELOCITY = (
    "no velocity limit is given (missing or zero), so that there is none; pass velocity_limits, for example "
    "velocity_limits={{{name!r}: 2.0}} [rad/s | m/s]"
)
NO_POSITION = (
    "lower and upper limit are both 0, which counts as not given, so that it turns without end; write the limits into "
    "the file, or lock the joint"
)


def limits_of(
    joints: Sequence[UrdfJoint],
    *,
    label: str,
    remarks: Remarks,
    acceleration: LimitValues | None,
    velocity: LimitValues | None,
    effort: LimitValues | None,
    jerk: LimitValues | None,
    effort_rate: LimitValues | None,
) -> JointLimits:
    """The limits of the joints that have a coordinate each; arguments as in `Robot.from_urdf`."""
    names = [joint.name for joint in joints]
    bounds = [position_bounds(joint) for joint in joints]
    for joint, (lower, upper) in zip(joints, bounds, strict=True):
        if not lower < upper:
            raise ValueError(
                f"{label}: joint {joint.name!r}: lower limit {lower} must be below upper {upper}"
                "; a joint without end is continuous"
            )
        if without_position_limits(joint):
            remarks.add(NO_POSITION, f"joint {joint.name!r}")
    written = {
        "velocity_limits": [math.inf if j.limit is None else j.limit.velocity for j in joints],
        "effort_limits": [math.inf if j.limit is None else j.limit.effort for j in joints],
    }
    final = {}
    for (what, values), given, kind in zip(
        written.items(), (velocity, effort), (NO_VELOCITY, NO_EFFORT), strict=True
    ):
        filled = [math.inf if value is None else value for value in values]
        final[what] = _per_coordinate(filled if given is None else given, what, names, filled)
        open_joints = [
            name
            for name, value, now in zip(names, values, final[what], strict=True)
            if value is None and math.isinf(now)
        ]
        for name in open_joints:
            remarks.add(kind.format(name=open_joints[0]), f"joint {name!r}")
    check_limits(joints, final["velocity_limits"], final["effort_limits"], remarks)
    usual = np.full(len(names), DEFAULT_ACCELERATION_LIMIT)
    accelerations = _per_coordinate(
        usual if acceleration is None else acceleration, "acceleration_limits", names, usual
    )
    jerks = _DEFAULT_JERK * accelerations
    return JointLimits(
        lower=np.array([lower for lower, _ in bounds]),
        upper=np.array([upper for _, upper in bounds]),
        velocity=final["velocity_limits"],
        acceleration=accelerations,
        effort=final["effort_limits"],
        jerk=None if jerk is None else _per_coordinate(jerk, "jerk_limits", names, jerks),
        effort_rate=None
        if effort_rate is None
        else _per_coordinate(effort_rate, "effort_rate_limits", names, np.full(len(names), math.inf)),
    )


def position_bounds(joint: UrdfJoint) -> tuple[float, float]:
    """Lower and upper position limit [rad | m]; infinite where there is none."""
    if joint.limit is None or without_position_limits(joint):
        return -math.inf, math.inf
    return joint.limit.lower, joint.limit.upper


def without_position_limits(joint: UrdfJoint) -> bool:
    """Whether a revolute joint has a limit of 0 to 0, which exporters write where they know none."""
    return (
        joint.type == "revolute" and joint.limit is not None and joint.limit.lower == joint.limit.upper == 0.0
    )


def stands_still(joint: UrdfJoint) -> bool:
    """Whether the position limits of a joint leave it one place."""
    lower, upper = position_bounds(joint)
    return lower == upper


def _per_coordinate(value: LimitValues, what: str, names: list[str], otherwise: ArrayLike) -> Array:
    if isinstance(value, Mapping):
        unknown = [repr(name) for name in value if name not in names]
        if unknown:
            raise ValueError(
                f"{what}: the robot has no coordinate {', '.join(unknown)}; its joints are: {', '.join(names)}"
            )
        by_name = dict(zip(names, np.asarray(otherwise, dtype=float), strict=True)) | dict(value)
        value = [by_name[name] for name in names]
    array = real_array(value, what)
    if array.shape not in ((), (len(names),)):
        raise ValueError(
            f"{what} has shape {array.shape}, expected a number or ({len(names)},) for {', '.join(names)}"
        )
    array = np.broadcast_to(array, (len(names),)).copy()
    for name, entry in zip(names, array, strict=True):
        if not entry > 0.0:
            raise ValueError(f"{what}: {entry} for {name!r}, must be positive")
    return array
