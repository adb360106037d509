"""Limits of an arm's joints: from the file, in place of it, or as they are where neither says."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from sidestep._core import JointLimits, real_array
from sidestep.robot.drives import Drive
from sidestep.robot.link import Array
from sidestep.robot.plausibility import check_limits
from sidestep.robot.urdf_elements import Urdf, UrdfJoint

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
    urdf: Urdf,
    names: list[str],
    *,
    drives: Mapping[str, Drive],
    acceleration: LimitValues | None,
    velocity: LimitValues | None,
    effort: LimitValues | None,
    jerk: LimitValues | None,
    effort_rate: LimitValues | None,
) -> JointLimits:
    """The limits of the joints that have a coordinate each, as their own and those of joints that mimic them allow.

    Positions and velocities of a joint that mimics another bound that one. Its effort limit does not: it has no drive.

    Args:
        urdf: the description. names: of the joints that have a coordinate. drives: of every joint that moves.
            The others as in `Robot.from_urdf`.

    Raises:
        ValueError: limits that leave a joint nothing, or a limit that is wrong, with what is allowed.
    """
    joints, label, remarks = [urdf.joints[name] for name in names], urdf.label, urdf.remarks
    bounds = [position_bounds(joint) for joint in joints]
    for joint, (lower, upper) in zip(joints, bounds, strict=True):
        if not lower < upper:
            raise ValueError(
                f"{label}: joint {joint.name!r}: lower limit {lower} must be below upper {upper}"
                "; a joint without end is continuous"
            )
        if without_position_limits(joint):
            remarks.add(NO_POSITION, f"joint {joint.name!r}")
    bounds = [_bounded_by_followers(urdf, name, own, drives) for name, own in zip(names, bounds, strict=True)]
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
    final["velocity_limits"] = np.minimum(
        final["velocity_limits"], [_velocity_of_followers(urdf, name, drives) for name in names]
    )
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


def _followers(urdf: Urdf, name: str, drives: Mapping[str, Drive]) -> list[tuple[UrdfJoint, Drive]]:
    """The joints that mimic the joint `name`, also over others."""
    return [
        (urdf.joints[follower], drive)
        for follower, drive in drives.items()
        if drive.source == name and follower != name
    ]


def _bounded_by_followers(
    urdf: Urdf, name: str, own: tuple[float, float], drives: Mapping[str, Drive]
) -> tuple[float, float]:
    """Position limits `own` of a joint, less what takes those that mimic it beyond theirs.

    Where that leaves no place, as of fingers that mimic the other way round with copied limits, its own alone.
    """
    lower, upper = own
    said = [f"its own [{lower:g}, {upper:g}]"]
    for follower, drive in _followers(urdf, name, drives):
        least, most = position_bounds(follower)
        if least == most == 0.0:
            continue  # what exporters write where they know none
        said.append(f"[{least:g}, {most:g}] of {follower.name!r} = {drive.multiplier:g} q + {drive.offset:g}")
        if drive.multiplier == 0.0:
            if not least <= drive.offset <= most:
                lower, upper = math.inf, -math.inf
            continue
        ends = sorted((bound - drive.offset) / drive.multiplier for bound in (least, most))
        lower, upper = max(lower, ends[0]), min(upper, ends[1])
    if not lower < upper:
        urdf.remarks.add(
            "it has no place within the limits of itself and of the joints that mimic it, so that its own alone count: "
            f"{', '.join(said)}; correct them",
            f"joint {name!r} = q",
        )
        return own
    return lower, upper


def _velocity_of_followers(urdf: Urdf, name: str, drives: Mapping[str, Drive]) -> float:
    """Velocity of a joint at which the first of those that mimic it is as fast as it may be [rad/s | m/s]."""
    return min(
        (
            follower.limit.velocity / abs(drive.multiplier)
            for follower, drive in _followers(urdf, name, drives)
            if follower.limit is not None and follower.limit.velocity is not None and drive.multiplier != 0.0
        ),
        default=math.inf,
    )


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
