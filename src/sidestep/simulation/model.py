"""The MuJoCo model of a robot and a scene."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np
import numpy.typing as npt
import trimesh

from sidestep._core import JointLimits, JointType
from sidestep.distance.convex_parts import convex_parts
from sidestep.distance.scene import Scene, SceneObject, check_scene
from sidestep.robot import Robot
from sidestep.robot.pose import pose_at, pose_vector

Array = npt.NDArray[np.float64]

STOPS = JointLimits.rounding  # [rad | m] of a joint beyond its position limits

# Contact masks: two geoms touch when one's type meets the other's affinity. Arm and scene meet; the arm does
# not meet itself (neighbouring hulls overlap by construction); objects meet the floor, not each other (a
# cluster of obstacles may overlap, as in the thesis's 6.2.3).
ARM_BIT, SCENE_BIT = 1, 2
COLLISION_GROUP, VISUAL_GROUP = 3, 2  # MuJoCo's own viewer shows groups 0 to 2 and hides 3
ARM_COLOUR, OBSTACLE_COLOUR, FLOOR_COLOUR = (
    (0.85, 0.86, 0.88, 1.0),
    (0.80, 0.15, 0.13, 1.0),
    (0.93, 0.93, 0.93, 1.0),
)
LEAST_MASS = 1e-9  # [kg] and [kg m^2]; MuJoCo refuses moving bodies at or below 1e-15


@dataclass(frozen=True, eq=False)
class SimulationModel:
    """A compiled MuJoCo model and where the robot's parts are in it.

    Attributes:
        model: the MuJoCo model.
        joint_positions, joint_velocities: (nj,) indices into qpos and qvel of the robot's joints, mimic
            included.
        coordinate: (nj, nv) motion of each joint per coordinate; `offset` (nj,): joints = coordinate @ q +
            offset.
        leaders: (nv,) index of the joint that each coordinate is read from; what mimics it follows.
        actuators: (nv,) index of each coordinate's torque actuator.
        geom_owner: geom index to ("link" | "object" | "floor", name).
        object_bodies: body index of each scene object.
    """

    model: mujoco.MjModel
    joint_positions: npt.NDArray[np.intp]
    joint_velocities: npt.NDArray[np.intp]
    coordinate: Array
    offset: Array
    leaders: npt.NDArray[np.intp]
    actuators: npt.NDArray[np.intp]
    geom_owner: dict[int, tuple[str, str]]
    object_bodies: tuple[int, ...]

    def state(self, data: mujoco.MjData) -> tuple[Array, Array]:
        """Coordinates q and v (nv,) of the robot."""
        positions, velocities, offset, ratio = self._read
        return (data.qpos[positions] - offset) / ratio, data.qvel[velocities] / ratio

    def set_state(self, data: mujoco.MjData, q: Array, v: Array) -> None:
        """Puts the robot, mimic joints included, at (q, v)."""
        data.qpos[self.joint_positions] = self.coordinate @ q + self.offset
        data.qvel[self.joint_velocities] = self.coordinate @ v

    def mass_matrix(self, data: mujoco.MjData) -> Array:
        """M (nv, nv) in the robot's coordinates, after the forward kinematics of `data`."""
        full = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, data, full)
        projected: Array = self.coordinate.T @ full[self._rows, self.joint_velocities] @ self.coordinate
        return projected

    def bias(self, data: mujoco.MjData) -> Array:
        """C(q, v) v + g(q) (nv,) in the robot's coordinates."""
        projected: Array = self.coordinate.T @ data.qfrc_bias[self.joint_velocities]
        return projected

    def object_poses(self, data: mujoco.MjData) -> Array:
        """Position and quaternion (w, x, y, z) in the world of each scene object, (N, 7)."""
        poses = np.empty((len(self._bodies), 7))
        poses[:, :3], poses[:, 3:] = data.xpos[self._bodies], data.xquat[self._bodies]
        return poses

    @cached_property
    def _read(self) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp], Array, Array]:
        """Where each coordinate is in qpos and qvel, and its joint's offset and multiplier."""
        ratio = self.coordinate[self.leaders, np.arange(len(self.leaders))]
        positions, velocities = self.joint_positions[self.leaders], self.joint_velocities[self.leaders]
        return positions, velocities, self.offset[self.leaders], ratio

    @cached_property
    def _rows(self) -> npt.NDArray[np.intp]:
        return self.joint_velocities[:, None]

    @cached_property
    def _bodies(self) -> npt.NDArray[np.intp]:
        return np.array(self.object_bodies, dtype=np.intp)


def build_model(
    robot: Robot,
    objects: Scene = (),
    *,
    timestep: float = 1e-3,
    floor_height: float | None = None,
    joint_damping: float = 0.0,
    joint_friction: float = 0.0,
    visuals: bool = True,
) -> SimulationModel:
    """Builds the MuJoCo model of a robot with torque motors among the objects of a scene.

    Every link becomes a body with its own inertia; the motors apply torques up to the effort limits; position
    limits are MuJoCo's soft constraints, so a violation is pushed back and also shows in the record. There is
    no joint damping or friction unless asked for. The integrator is "implicitfast": without damping it is
    exactly semi-implicit Euler, and with damping it stays stable where Euler does not.

    MuJoCo collides convex shapes only. Each collision mesh is therefore covered by convex parts
    (`convex_parts`), and a mesh object by its one hull. Both hold the true solid, so no contact is missed,
    but a contact in a hollow can be reported where `ExactClearance` shows that there was none: the FR3's
    parts stand out by 1 to 2 mm on average, 16 mm at worst. The arm does not collide with itself nor with the
    floor; objects not with each other.

    Args:
        robot: with inertias on every moving link.
        objects: fixed, free (floating, gravity compensated, until touched) and moving (driven) objects.
        timestep: of the physics [s].
        floor_height: z of a floor [m] that free objects can fall on; None: no floor.
        joint_damping: [Nm s/rad | N s/m] on every joint.
        joint_friction: dry friction [Nm] on every joint.
        visuals: with the visual meshes, which MuJoCo's own pictures show and which take most of the time.

    Raises:
        ValueError: a moving link without inertia, a mass or inertia that is not physical, a timestep that is
            not positive, or two objects with one name.
    """
    if not (np.isfinite(timestep) and timestep > 0.0):
        raise ValueError(f"timestep must be positive, got {timestep}")
    scene = check_scene(objects)
    spec = mujoco.MjSpec()
    spec.modelname = robot.name
    spec.option.timestep = timestep
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.compiler.degree = False  # joint ranges are in radians
    spec.compiler.balanceinertia = False
    spec.worldbody.add_light(pos=[0.0, -1.5, 2.5], dir=[0.0, 0.5, -0.85])
    spec.worldbody.add_camera(
        name="overview", pos=[1.7, -1.4, 1.3], xyaxes=[0.64, 0.77, 0.0, -0.32, 0.27, 0.91]
    )
    owners: dict[str, tuple[str, str]] = {}
    _add_robot(spec, robot, owners, damping=joint_damping, friction=joint_friction, visuals=visuals)
    for item in scene:
        _add_object(spec, item, owners)
    if floor_height is not None:
        spec.worldbody.add_geom(
            name="floor",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[5.0, 5.0, 0.1],
            pos=[0.0, 0.0, floor_height],
            rgba=FLOOR_COLOUR,
            contype=SCENE_BIT,
            conaffinity=SCENE_BIT,
        )
        owners["floor"] = ("floor", "floor")
    try:
        model = spec.compile()
    except ValueError as error:
        raise ValueError(f"MuJoCo refuses the model of robot {robot.name!r}: {error}") from error
    return _locate(model, robot, scene, owners)


def _add_robot(
    spec: mujoco.MjSpec,
    robot: Robot,
    owners: dict[str, tuple[str, str]],
    *,
    damping: float,
    friction: float,
    visuals: bool,
) -> None:
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
        leader = robot.joints[_leader(robot, coordinate)]
        effort = float(limits.effort[coordinate])
        spec.add_actuator(
            name=name,
            target=leader.name,
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            ctrlrange=[-effort, effort] if np.isfinite(effort) else [0.0, 0.0],
            ctrllimited=bool(np.isfinite(effort)),
        )
        for follower in robot.joints:
            if follower.coordinate == coordinate and follower.name != leader.name:
                ratio = follower.multiplier / leader.multiplier
                gear = spec.add_equality(
                    type=mujoco.mjtEq.mjEQ_JOINT,
                    objtype=mujoco.mjtObj.mjOBJ_JOINT,
                    name1=follower.name,
                    name2=leader.name,
                )
                gear.data[0], gear.data[1] = follower.offset - ratio * leader.offset, ratio


def _leader(robot: Robot, coordinate: int) -> int:
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
        if _add_mesh(spec, name, geometry.mesh()):
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


def _add_mesh(spec: mujoco.MjSpec, name: str, mesh: trimesh.Trimesh) -> bool:
    """Adds a mesh asset; False for a flat or empty one, which has no hull to collide."""
    if len(mesh.faces) < 4 or np.linalg.matrix_rank(mesh.vertices - mesh.vertices[0], tol=1e-6) < 3:
        return False
    spec.add_mesh(
        name=name,
        uservert=np.asarray(mesh.vertices, dtype=float).ravel(),
        userface=np.asarray(mesh.faces, dtype=int).ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
    return True


def _add_object(spec: mujoco.MjSpec, item: SceneObject, owners: dict[str, tuple[str, str]]) -> None:
    pose = pose_vector(item.pose)
    body = spec.worldbody.add_body(name=f"object:{item.name}", pos=pose[:3], quat=pose[3:])
    if item.motion == "free":
        body.add_freejoint()
        body.gravcomp = 1.0
    body.mocap = item.motion == "moving"
    name = f"object:{item.name}"
    mesh_name = ""
    if item.mesh is not None:
        mesh_name = name
        if not _add_mesh(spec, name, item.mesh):
            raise ValueError(f"object {item.name!r}: its mesh is flat or empty, MuJoCo needs a volume")
    types = {
        "sphere": "SPHERE",
        "box": "BOX",
        "cylinder": "CYLINDER",
        "capsule": "CAPSULE",
        "plane": "PLANE",
        "mesh": "MESH",
    }
    size = np.zeros(3)
    if item.kind == "plane":
        size[:] = item.size[0]  # of the drawing alone
    elif item.kind == "box":
        size[:] = 0.5 * np.array(item.size)
    elif item.kind in ("cylinder", "capsule"):
        size[:2] = item.size[0], 0.5 * item.size[1]
    elif item.kind == "sphere":
        size[0] = item.size[0]
    body.add_geom(
        name=name,
        type=getattr(mujoco.mjtGeom, f"mjGEOM_{types[item.kind]}"),
        meshname=mesh_name,
        size=size,
        rgba=OBSTACLE_COLOUR,
        contype=SCENE_BIT,
        conaffinity=ARM_BIT,
        mass=item.mass,
    )
    owners[name] = ("object", item.name)


def _locate(
    model: mujoco.MjModel, robot: Robot, scene: tuple[SceneObject, ...], owners: dict[str, tuple[str, str]]
) -> SimulationModel:
    joints = [model.joint(joint.name) for joint in robot.joints]
    coordinate = np.zeros((len(joints), robot.num_coordinates))
    for row, joint in enumerate(robot.joints):
        coordinate[row, joint.coordinate] = joint.multiplier
    return SimulationModel(
        model=model,
        joint_positions=np.array([int(j.qposadr[0]) for j in joints], dtype=np.intp),
        joint_velocities=np.array([int(j.dofadr[0]) for j in joints], dtype=np.intp),
        coordinate=coordinate,
        offset=np.array([joint.offset for joint in robot.joints]),
        leaders=np.array([_leader(robot, c) for c in range(robot.num_coordinates)], dtype=np.intp),
        actuators=np.array([model.actuator(name).id for name in robot.coordinate_names], dtype=np.intp),
        geom_owner={model.geom(name).id: owner for name, owner in owners.items()},
        object_bodies=tuple(int(model.body(f"object:{item.name}").id) for item in scene),
    )
