"""What an MJCF says of joints beside where they are: limits, actuators, and which follow others."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from sidestep.robot.urdf_elements import UrdfLimit

if TYPE_CHECKING:  # imported where it is used: URDF needs no MuJoCo
    import mujoco

TURN_VELOCITY = 2.0
"""Velocity limit of a hinge where none is given, [rad/s]: below that of the slowest joint of FR3, UR and xArm."""
SLIDE_VELOCITY = 0.2
"""Velocity limit of a slide where none is given, [m/s]: that of a gripper's finger."""


@dataclass(frozen=True)
class Actuation:
    """What drives the joints, by joint index.

    Attributes:
        joints: those with an actuator of their own, or of a tendon through them.
        effort: largest force of the actuators [Nm | N]; inf where an actuator has none.
        velocity: largest velocity that an actuator takes as command [rad/s | m/s].
    """

    joints: frozenset[int]
    effort: Mapping[int, float]
    velocity: Mapping[int, float]


@dataclass(frozen=True)
class Coupling:
    """Position = multiplier * position of `source` + offset; of no source, the offset alone."""

    source: int | None
    multiplier: float
    offset: float


def name_of(model: mujoco.MjModel, kind: Literal["body", "joint"], index: int) -> str:
    """The name of a body or joint, or one made for it, from its body's where it has none."""
    if kind == "body":
        return str(model.body(index).name) or f"body{index}"
    name = str(model.joint(index).name)
    if name:
        return name
    body = int(model.jnt_bodyid[index])
    rank = index - int(model.body_jntadr[body]) + 1
    made = f"{name_of(model, 'body', body)}_joint" + ("" if model.body_jntnum[body] == 1 else str(rank))
    taken = {str(model.joint(other).name) for other in range(model.njnt)}
    while made in taken:
        made += "_"
    return made


def actuation(model: mujoco.MjModel) -> Actuation:
    """Limits by actuator: of its force, else of a motor's command; of several on one joint the largest."""
    import mujoco

    transmission = mujoco.mjtTrn
    direct = (int(transmission.mjTRN_JOINT), int(transmission.mjTRN_JOINTINPARENT))
    effort: dict[int, float] = {}
    velocity: dict[int, float] = {}
    for index in range(model.nu):
        kind, target = int(model.actuator_trntype[index]), int(model.actuator_trnid[index][0])
        if kind in direct:
            arms = {target: 1.0}
        elif kind == int(transmission.mjTRN_TENDON):
            arms = _tendon(model, target)
        else:
            continue
        gear = abs(float(model.actuator_gear[index][0]))
        force, speed = _force(model, index), _commanded_velocity(model, index)
        for joint, arm in arms.items():
            ratio = gear * abs(arm)
            if ratio > 0.0:
                effort[joint] = max(effort.get(joint, 0.0), force * ratio)
                if speed is not None:
                    velocity[joint] = max(velocity.get(joint, 0.0), speed / ratio)
    return Actuation(frozenset(effort), effort, velocity)


def _tendon(model: mujoco.MjModel, tendon: int) -> dict[int, float]:
    """Joints of a fixed tendon and the coefficient of each; none of a spatial one."""
    import mujoco

    first = int(model.tendon_adr[tendon])
    return {
        int(model.wrap_objid[at]): float(model.wrap_prm[at])
        for at in range(first, first + int(model.tendon_num[tendon]))
        if int(model.wrap_type[at]) == int(mujoco.mjtWrap.mjWRAP_JOINT)
    }


def _force(model: mujoco.MjModel, index: int) -> float:
    """Largest force of an actuator. The command of a position or velocity servo is none."""
    import mujoco

    force = math.inf
    if model.actuator_forcelimited[index]:
        force = float(np.abs(model.actuator_forcerange[index]).max())
    motor = (
        int(model.actuator_gaintype[index]) == int(mujoco.mjtGain.mjGAIN_FIXED)
        and int(model.actuator_biastype[index]) == int(mujoco.mjtBias.mjBIAS_NONE)
        and int(model.actuator_dyntype[index]) != int(mujoco.mjtDyn.mjDYN_INTEGRATOR)
    )
    if motor and model.actuator_ctrllimited[index]:
        gain = abs(float(model.actuator_gainprm[index][0]))
        force = min(force, gain * float(np.abs(model.actuator_ctrlrange[index]).max()))
    return force


def _commanded_velocity(model: mujoco.MjModel, index: int) -> float | None:
    """Largest command of a velocity servo, whose force is kv (command - velocity); None of another actuator."""
    import mujoco

    gain, bias = float(model.actuator_gainprm[index][0]), model.actuator_biasprm[index]
    servo = (
        int(model.actuator_biastype[index]) == int(mujoco.mjtBias.mjBIAS_AFFINE)
        and int(model.actuator_dyntype[index]) != int(mujoco.mjtDyn.mjDYN_INTEGRATOR)
        and gain > 0.0
        and bias[1] == 0.0
        and math.isclose(float(bias[2]), -gain)
    )
    if not servo or not model.actuator_ctrllimited[index]:
        return None
    return float(np.abs(model.actuator_ctrlrange[index]).max())


def limit_of(
    model: mujoco.MjModel, joint: int, driven: Actuation, ranges: Mapping[int, tuple[float, float]]
) -> UrdfLimit:
    """Limits of a hinge or slide; a default velocity and no end of effort where the file gives none.

    `ranges` are position limits, by joint, that the file gives and the model does not apply.
    """
    import mujoco

    lower, upper = ranges.get(joint, (-math.inf, math.inf))
    if model.jnt_limited[joint]:
        lower, upper = (float(end) for end in model.jnt_range[joint])
    effort = driven.effort.get(joint, math.inf)
    if model.jnt_actfrclimited[joint]:
        effort = min(effort, float(np.abs(model.jnt_actfrcrange[joint]).max()))
    turns = int(model.jnt_type[joint]) == int(mujoco.mjtJoint.mjJNT_HINGE)
    velocity = driven.velocity.get(joint) or (TURN_VELOCITY if turns else SLIDE_VELOCITY)
    return UrdfLimit(lower=lower, upper=upper, velocity=velocity, effort=effort or math.inf)


def couplings(model: mujoco.MjModel, driven: Actuation) -> tuple[dict[int, Coupling], list[str]]:
    """Joints that follow others by `<equality><joint>`, and what could not be read.

    MuJoCo's equation is y - y0 = c0 + c1 (x - x0) + c2 (x - x0)^2 + …, with y0 and x0 the positions `qpos0`. Of the two
    the one without actuator follows; of two alike, the later one.
    """
    import mujoco

    found: dict[int, Coupling] = {}
    remarks = []
    for index in range(model.neq):
        if int(model.eq_type[index]) != int(mujoco.mjtEq.mjEQ_JOINT) or not model.eq_active0[index]:
            continue
        y, x = int(model.eq_obj1id[index]), int(model.eq_obj2id[index])
        c0, c1, *higher = (float(c) for c in model.eq_data[index][:5])
        y0 = float(model.qpos0[model.jnt_qposadr[y]])
        if x < 0:
            found.setdefault(y, Coupling(None, 0.0, y0 + c0))
            continue
        names = f"joints {name_of(model, 'joint', y)} and {name_of(model, 'joint', x)}"
        if any(higher) or c1 == 0.0:
            remarks.append(f"{names} are coupled by a curve, not a line; they are left uncoupled")
            continue
        x0 = float(model.qpos0[model.jnt_qposadr[x]])
        forward = Coupling(x, c1, y0 + c0 - c1 * x0)
        back = Coupling(y, 1.0 / c1, x0 - (y0 + c0) / c1)
        choices = [(y, forward), (x, back)]
        if (y in driven.joints, -y) > (x in driven.joints, -x):
            choices.reverse()
        for follower, coupling in choices:
            if follower not in found and _end(found, x + y - follower) != follower:
                found[follower] = coupling
                break
        else:
            remarks.append(f"{names} are coupled once more than they can be; this coupling is left out")
    return found, remarks


def _end(found: Mapping[int, Coupling], joint: int) -> int:
    while joint in found:
        source = found[joint].source
        if source is None:
            return joint
        joint = source
    return joint
