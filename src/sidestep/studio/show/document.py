"""What was read, as a document: for programs, and for the panel of the page."""

from __future__ import annotations

import math
from typing import Any

from sidestep._core import Joint, JointType
from sidestep.robot import Robot
from sidestep.studio.show.reading import Reading


def document(reading: Reading) -> dict[str, Any]:
    """Joints with limits, links, masses, postures and warnings; angles in rad, lengths in m, None for no limit."""
    robot = reading.robot
    return {
        "source": reading.source,
        "kind": reading.kind,
        "name": robot.name,
        "num_coordinates": robot.num_coordinates,
        "base": robot.frames[0].name,
        "tip": reading.tip,
        "mass_kg": reading.mass,
        "moving_mass_kg": reading.moving_mass,
        "default_acceleration_and_jerk": not reading.own_acceleration,
        "joints": [_joint(robot, k) for k in range(robot.num_coordinates)],
        "mimic": [
            {
                "joint": joint.name,
                "follows": robot.coordinate_names[joint.coordinate],
                "multiplier": joint.multiplier,
                "offset": joint.offset,
            }
            for joint in robot.joints
            if joint.name != robot.coordinate_names[joint.coordinate]
        ],
        "locked": robot.held,
        "links": [
            {
                "name": link.name,
                "moved_by": robot.joints[frame.joint].name if frame.joint >= 0 else None,
                "mass_kg": None if link.inertial is None else link.inertial.mass,
                "visual": [shape.kind for shape in link.visuals],
                "collision": [shape.kind for shape in link.collisions],
            }
            for frame, link in zip(robot.frames, robot.links, strict=True)
        ],
        "postures": {name: q.tolist() for name, q in robot.postures.items()},
        "allowed_pairs": [list(pair) for pair in robot.allowed_pairs],
        "warnings": list(reading.warnings),
    }


def _joint(robot: Robot, k: int) -> dict[str, Any]:
    limits, moved = robot.limits, _joints_of(robot, k)
    lower, upper = float(limits.lower[k]), float(limits.upper[k])
    sliding = moved[0].type == JointType.prismatic
    endless = not sliding and math.isinf(lower) and math.isinf(upper)
    return {
        "name": robot.coordinate_names[k],
        "kind": "prismatic" if sliding else "continuous" if endless else "revolute",
        "unit": "m" if sliding else "rad",
        "lower": finite(lower),
        "upper": finite(upper),
        "velocity": finite(limits.velocity[k]),
        "acceleration": finite(limits.acceleration[k]),
        "effort": finite(limits.effort[k]),
        "jerk": finite(limits.jerk[k]),
        "effort_rate": finite(limits.effort_rate[k]),
    }


def _joints_of(robot: Robot, k: int) -> list[Joint]:
    """The joints that follow a coordinate, the one with its name first."""
    return sorted(
        (joint for joint in robot.joints if joint.coordinate == k),
        key=lambda joint: joint.name != robot.coordinate_names[k],
    )


def finite(value: float) -> float | None:
    """A number, or None for an infinite one."""
    return float(value) if math.isfinite(value) else None


def document_with_touching(reading: Reading) -> dict[str, Any]:
    """The same after the meshes are loaded: with what they warn of, and the links that touch at `Robot.neutral`."""
    from sidestep.studio.show.shapes import drawable_shapes
    from sidestep.studio.show.touching import TouchCheck

    shapes = drawable_shapes(reading.robot)
    q = reading.robot.neutral
    return {
        **document(reading),
        "warnings": list(dict.fromkeys((*reading.warnings, *shapes.warnings))),
        "touching": {"configuration": q.tolist(), **TouchCheck(reading.robot).at(q).to_document()},
    }
