"""An arm in words, for people who check what was read."""

from __future__ import annotations

import math

import numpy as np

from sidestep import _core

ASSUMED_ACCELERATION = (
    10.0  # [rad/s^2 | m/s^2] of `sidestep.robot.limits`, which needs packages; a test compares
)
ASSUMED_JERK = 100.0  # [1/s] times the acceleration limit; likewise


def summary_of(arm: _core.Arm, *, draft: bool) -> str:
    """Name, joints with limits, reach, mass, tip, body, and what was assumed; one fact a line."""
    tree, limits = arm.robot, arm.limits
    slides = {joint.coordinate for joint in tree.joints if joint.type == _core.JointType.prismatic}
    assumed = [
        limits.acceleration[j] == ASSUMED_ACCELERATION
        and limits.jerk[j] == ASSUMED_JERK * limits.acceleration[j]
        for j in range(arm.num_coordinates)
    ]
    lines = [f"{arm.name}: {arm.num_coordinates} joints, from {arm.provenance.source!r}"]
    for j, name in enumerate(tree.coordinate_names):
        unit = "m" if j in slides else "rad"
        effort = (
            f", {limits.effort[j]:.4g} {'N' if j in slides else 'Nm'}"
            if np.isfinite(limits.effort[j])
            else ""
        )
        lines.append(
            f"  {name}: {_range(limits.lower[j], limits.upper[j], unit)}, {limits.velocity[j]:.4g} {unit}/s, "
            f"{limits.acceleration[j]:.4g} {unit}/s²{' (usual default)' if assumed[j] else ''}{effort}"
        )
    tip = max(enumerate(tree.frames), key=lambda frame: (frame[1].joint, frame[0]))[1].name
    lines.append(f"  tip {tip!r}, up to {_reach(tree):.2f} m from the base")
    if arm.has_dynamics:
        lines.append(f"  mass that moves: {sum(body.mass for body in arm.inertials):.1f} kg")
    else:
        lines.append("  no inertias: torque output needs mass matrix and bias in every step")
    overshoot = max((proof.mean_overshoot for proof in arm.proof), default=math.nan)
    lines.append(
        f"  body: {len(arm.body.weights)} ellipsoids{' (draft)' if draft else ''}, "
        f"at most {1e3 * overshoot:.0f} mm outside a link in the mean"
    )
    if not np.isfinite(limits.effort).all():
        lines.append("  no effort limits in some joints: no torque output")
    if all(assumed):
        lines.append(
            f"  acceleration {ASSUMED_ACCELERATION:g} /s² and jerk {ASSUMED_JERK * ASSUMED_ACCELERATION:g} /s³ in all "
            "joints are what is assumed where a description has none; acceleration_limits and jerk_limits set them"
        )
    return "\n".join(lines)


def _range(lower: float, upper: float, unit: str) -> str:
    if math.isinf(lower) and math.isinf(upper):
        return "turns without end"
    return f"{lower:.4g} to {upper:.4g} {unit}"


def _reach(tree: _core.Robot) -> float:
    """Farthest that a frame gets from the root, of 500 configurations [m]."""
    rng = np.random.default_rng(0)
    lower, upper = (np.clip(x, -math.pi, math.pi) for x in (tree.limits.lower, tree.limits.upper))
    names = [frame.name for frame in tree.frames if frame.joint >= 0]
    return max(
        float(np.linalg.norm(tree.pose(q, name)[:3, 3]))
        for q in rng.uniform(lower, upper, (500, len(lower)))
        for name in names[-3:]  # the outermost: none before them gets farther
    )
