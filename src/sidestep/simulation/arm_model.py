"""A robot in a MuJoCo model: a body for each joint, its links' geoms, and torque motors."""

from __future__ import annotations

import mujoco
import numpy as np
import numpy.typing as npt

from sidestep._core import JointLimits, JointType
from sidestep.distance.convex_parts import convex_parts
from sidestep.math.pose import pose_at, pose_vector
from sidestep.robot import Robot
from sidestep.simulation.contacts import ARM_BIT
from sidestep.simulation.object_model import add_mesh

Array = npt.NDArray[np.float64]

STOPS = JointLimits.rounding  # [rad | m] of a joint beyond its position limits
COLLISION_GROUP, VISUAL_GROUP = 3, 2  # MuJoCo's own viewer shows groups 0 to 2 and hides 3
ARM_COLOUR = (0.85, 0.86, 0.88, 1.0)
LEAST_MASS = 1e-9  # [kg] and [kg m^2]; MuJoCo refuses moving bodies at or below 1e-15


def add_robot(
    spec: mujoco.MjSpec,
    robot: Robot,
    owners: dict[str, tuple[str, str]],
    *,
    damping: float,
    friction: float,
    visuals: bool,
) -> None:
    """Adds a body for each joint with the inertia and the geoms of the links that it carries, and its motors.

    Raises:
        ValueError: a moving link without inertia, or a mass or inertia that is not physical.
    """
    limits = robot.limits
    frames = {frame.name: frame for frame in robot.frames}
    base = spec.worldbody.add_body(name="robot_base")
    bodies: list[mujoco.MjsBody] = []
    for joint in robot.joints:
        parent = bodies[joint.parent] if joint.parent >= 0 else base
        pose = pose_vector(joint.placement)
        body = parent.add_body(name=f"joint:{joint.name}", pos=pose[:3], quat=pose[3:])
        bodies.append(body)
        hinge = (
            mujoco.mjtJoint.mjJNT_HINGE if joint.type == JointType.revolute else mujoco.mjtJoint.mjJNT_SLIDE
        )
        # Stops are a rounding error beyond the limits: what starts there is not thrown back.
        low, high = limits.lower[joint.coordinate] - STOPS, limits.upper[joint.coordinate] + STOPS
        ends = joint.multiplier * np.array([low, high])
        limited = bool(np.all(np.isfinite(ends)))
        body.add_joint(
            name=joint.name,
            type=hinge,
            axis=joint.axis,
            limited=mujoco.mjtLimited.mjLIMITED_TRUE if limited else mujoco.mjtLimited.mjLIMITED_FALSE,
            range=sorted(ends + joint.offset) if limited else [0.0, 0.0],
            damping=_joint_coefficient(damping),
            frictionloss=friction,
        )
    for index, body in enumerate(bodies):
        _set_inertia(body, robot, index)
    for link in robot.links:
        frame = frames[link.name]
        body = bodies[frame.joint] if frame.joint >= 0 else base
        _add_geoms(spec, body, robot, link.name, frame.placement, owners, visuals=visuals)
    for coordinate, name in enumerate(robot.coordinate_names):
        carrier = robot.joints[leader(robot, coordinate)]
        effort = float(limits.effort[coordinate])
        spec.add_actuator(
            name=name,
            target=carrier.name,
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            ctrlrange=[-effort, effort] if np.isfinite(effort) else [0.0, 0.0],
            ctrllimited=bool(np.isfinite(effort)),
        )
        for follower in robot.joints:
            if follower.coordinate == coordinate and follower.name != carrier.name:
                ratio = follower.multiplier / carrier.multiplier
                gear = spec.add_equality(
                    type=mujoco.mjtEq.mjEQ_JOINT,
                    objtype=mujoco.mjtObj.mjOBJ_JOINT,
                    name1=follower.name,
                    name2=carrier.name,
                )
                gear.data[0], gear.data[1] = follower.offset - ratio * carrier.offset, ratio


def leader(robot: Robot, coordinate: int) -> int:
    """Index of the joint that carries a coordinate's motor: the one that mimics nothing."""
    carried = [i for i, joint in enumerate(robot.joints) if joint.coordinate == coordinate]
    plain = [i for i in carried if robot.joints[i].multiplier == 1.0 and robot.joints[i].offset == 0.0]
    return (plain or carried)[0]


def _joint_coefficient(value: float) -> float | list[float]:
    """Joint damping as this MuJoCo wants it: one number before polynomial damping came, three since."""
    joint = mujoco.MjSpec().worldbody.add_body().add_joint()
    return value if np.ndim(joint.damping) == 0 else [value, *[0.0] * (np.size(joint.damping) - 1)]


def _set_inertia(body: mujoco.MjsBody, robot: Robot, joint: int) -> None:
    """Sums the inertias of the links that this joint carries, at their placements, into one."""
    mass, moment, parts = 0.0, np.zeros(3), []
    for frame in robot.frames:
        inertial = robot.link(frame.name).inertial if frame.joint == joint else None
        if inertial is None:
            continue
        R, p = frame.placement[:3, :3], frame.placement[:3, 3]
        center = R @ inertial.com + p
        mass += inertial.mass
        moment += inertial.mass * center
        parts.append((inertial.mass, center, R @ inertial.inertia @ R.T))
    carrying = ", ".join(f.name for f in robot.frames if f.joint == joint)
    if mass < LEAST_MASS:
        raise ValueError(
            f"joint {robot.joints[joint].name!r} of robot {robot.name!r} carries links ({carrying}) without "
            f"mass; the simulation needs an <inertial> with positive mass on every moving link"
        )
    com = moment / mass
    inertia = np.zeros((3, 3))
    for part_mass, center, part_inertia in parts:
        r = center - com
        inertia += part_inertia + part_mass * (r @ r * np.eye(3) - np.outer(r, r))
    principal, axes = np.linalg.eigh(0.5 * (inertia + inertia.T))
    slack = 1e-6 * principal[2]
    if principal[0] < LEAST_MASS or principal[2] > principal[0] + principal[1] + slack:
        raise ValueError(
            f"links {carrying} of robot {robot.name!r} have principal inertias "
            f"{', '.join(f'{value:.3g}' for value in principal)} kg m^2; a rigid body needs all of them "
            f"positive and each at most the sum of the other two"
        )
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    pose = pose_vector(pose_at(com, axes))
    body.explicitinertial = True
    body.mass, body.ipos, body.iquat = mass, pose[:3], pose[3:]
    body.inertia = np.minimum(principal, [np.inf, np.inf, principal[0] + principal[1]])


def _add_geoms(
    spec: mujoco.MjSpec,
    body: mujoco.MjsBody,
    robot: Robot,
    link: str,
    placement: Array,
    owners: dict[str, tuple[str, str]],
    *,
    visuals: bool,
) -> None:
    for i, geometry in enumerate(robot.link(link).geometries):
        for k, corners in enumerate(convex_parts(np.array(geometry.mesh().triangles, dtype=float))):
            name = f"collision:{link}:{i}:{k}"
            spec.add_mesh(name=name, uservert=corners.ravel())
            _add_geom(body, name, placement, touches=True)
            owners[name] = ("link", link)
    for i, geometry in enumerate(robot.link(link).visuals if visuals else ()):
        name = f"visual:{link}:{i}"
        if add_mesh(spec, name, geometry.mesh()):
            _add_geom(body, name, placement, touches=False)


def _add_geom(body: mujoco.MjsBody, name: str, placement: Array, *, touches: bool) -> None:
    pose = pose_vector(placement)
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=name,
        pos=pose[:3],
        quat=pose[3:],
        rgba=ARM_COLOUR,
        contype=ARM_BIT if touches else 0,
        conaffinity=0,
        group=COLLISION_GROUP if touches else VISUAL_GROUP,
        mass=0.0,
    )
