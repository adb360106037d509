"""The MuJoCo model of a robot and a scene."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np
import numpy.typing as npt

from sidestep.distance.scene import Scene, SceneObject, check_scene
from sidestep.math.matrices import product
from sidestep.math.pose import pose_at
from sidestep.robot import Robot
from sidestep.simulation.arm_model import add_robot, leader
from sidestep.simulation.contacts import SCENE_BIT
from sidestep.simulation.object_model import add_object

Array = npt.NDArray[np.float64]

FLOOR_COLOUR = (0.93, 0.93, 0.93, 1.0)


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
        link_frames: frame name to its body index and its pose (4, 4) in that body.
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
    link_frames: dict[str, tuple[int, Array]]

    def state(self, data: mujoco.MjData) -> tuple[Array, Array]:
        """Coordinates q and v (nv,) of the robot."""
        positions, velocities, offset, ratio = self._read
        return (data.qpos[positions] - offset) / ratio, data.qvel[velocities] / ratio

    def set_state(self, data: mujoco.MjData, q: Array, v: Array) -> None:
        """Puts the robot, mimic joints included, at (q, v)."""
        data.qpos[self.joint_positions] = self.coordinate @ q + self.offset
        data.qvel[self.joint_velocities] = self.coordinate @ v

    def link_pose(self, data: mujoco.MjData, link: str) -> Array:
        """X_WL (4, 4) of a link or another frame of the robot, after the forward kinematics of `data`.

        Raises:
            ValueError: the robot has no such frame; names those that it has.
        """
        if link not in self.link_frames:
            raise ValueError(f"no frame {link!r} on this robot, allowed: {', '.join(self.link_frames)}")
        body, X_BL = self.link_frames[link]
        X_WB = pose_at(data.xpos[body], data.xmat[body].reshape(3, 3))
        return product(X_WB, X_BL)

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
    add_robot(spec, robot, owners, damping=joint_damping, friction=joint_friction, visuals=visuals)
    for item in scene:
        add_object(spec, item, owners)
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


def _locate(
    model: mujoco.MjModel, robot: Robot, scene: tuple[SceneObject, ...], owners: dict[str, tuple[str, str]]
) -> SimulationModel:
    joints = [model.joint(joint.name) for joint in robot.joints]
    carriers = [model.body("robot_base").id] + [
        model.body(f"joint:{joint.name}").id for joint in robot.joints
    ]
    coordinate = np.zeros((len(joints), robot.num_coordinates))
    for row, joint in enumerate(robot.joints):
        coordinate[row, joint.coordinate] = joint.multiplier
    return SimulationModel(
        model=model,
        joint_positions=np.array([int(j.qposadr[0]) for j in joints], dtype=np.intp),
        joint_velocities=np.array([int(j.dofadr[0]) for j in joints], dtype=np.intp),
        coordinate=coordinate,
        offset=np.array([joint.offset for joint in robot.joints]),
        leaders=np.array([leader(robot, c) for c in range(robot.num_coordinates)], dtype=np.intp),
        actuators=np.array([model.actuator(name).id for name in robot.coordinate_names], dtype=np.intp),
        geom_owner={model.geom(name).id: owner for name, owner in owners.items()},
        object_bodies=tuple(int(model.body(f"object:{item.name}").id) for item in scene),
        link_frames={
            frame.name: (int(carriers[frame.joint + 1]), np.array(frame.placement)) for frame in robot.frames
        },
    )
