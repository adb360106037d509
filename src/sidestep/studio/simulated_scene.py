"""The physics of the studio: one arm under torque among obstacles that are drawn about, in MuJoCo."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
import numpy.typing as npt

from sidestep.math.pose import from_quaternion, pose_at, pose_vector
from sidestep.robot import Robot
from sidestep.simulation.model import build_model
from sidestep.studio.messages import Course
from sidestep.studio.scene_obstacle import SceneObstacle, thing_of

Array = npt.NDArray[np.float64]

FOLLOW_TIME = 0.05  # [s] in which a drawn obstacle makes up 63 % of its way, below the speed limit
DRAG_SPEED = 1.0  # [m/s] at most of a drawn obstacle: what the hand of a person does near an arm
DRAG_ACCELERATION = 4.0  # [m/s^2] the same; a mouse jumps, and from a jump nothing can yield
THERE = 1e-4  # [m] from its target a drawn obstacle is put there
FAR = 3.0  # [m] from the origin; a thrown obstacle stops there


class MovableObstacle:
    """Where a thing is and how it moves now.

    Attributes:
        thing: what it is. pose: (4, 4), quaternion: (4,) of it. velocity: (3,) [m/s].
        target: pose it is drawn to, or None.
    """

    def __init__(self, thing: SceneObstacle) -> None:
        self.thing = thing
        self.pose = thing.start.copy()
        self.velocity = np.array(thing.obstacle.velocity, dtype=float)
        self.quaternion = pose_vector(self.pose)[3:]
        self.target: Array | None = None
        self.touched = False  # drawn or thrown: its script no longer counts

    @property
    def free(self) -> bool:
        return self.thing.obstacle.free

    @property
    def course(self) -> Course:
        """By what it moves: as its file says, held by a hand, or as it was left."""
        return "file" if not self.touched else "left" if self.target is None else "held"

    def scripted(self, time: float) -> None:
        """Sets the velocity that the scenario asks for at a time [s]."""
        motion = self.thing.obstacle.motion
        if self.touched or motion is None:
            return
        way = np.array(motion.to) - np.array(self.thing.obstacle.position)
        moves = motion.begin <= time < motion.end
        self.velocity = way / (motion.end - motion.begin) if moves else np.zeros(3)

    def advance(self, period: float) -> None:
        """Moves it by one period [s] towards its target, where it stays, or on along its velocity."""
        there = False
        if self.target is not None:
            way = self.target[:3, 3] - self.pose[:3, 3]
            distance = float(np.linalg.norm(way))
            # No faster than it can still be stopped from.
            speed = min(
                distance / max(FOLLOW_TIME, period), DRAG_SPEED, np.sqrt(2.0 * DRAG_ACCELERATION * distance)
            )
            change = way * (speed / max(distance, 1e-12)) - self.velocity
            size, most = float(np.linalg.norm(change)), DRAG_ACCELERATION * period
            self.velocity = self.velocity + change * min(1.0, most / max(size, 1e-12))
            there = distance < THERE and bool(np.linalg.norm(self.velocity) < 10.0 * most)
            if there:
                self.velocity = way / period
            if not np.array_equal(self.pose[:3, :3], self.target[:3, :3]):
                self.pose[:3, :3] = self.target[:3, :3]
                self.quaternion = pose_vector(self.pose)[3:]
        elif np.linalg.norm(self.pose[:3, 3]) > FAR:
            self.velocity = np.zeros(3)
        self.pose[:3, 3] += period * self.velocity
        if there:
            self.target, self.velocity = None, np.zeros(3)


class SimulatedScene:
    """The arm and the obstacles in MuJoCo, one control period at a time.

    Args:
        robot: with inertias and collision meshes.
        things: the obstacles.
        period: of control and physics [s].

    Raises:
        ValueError: see `build_model`.
    """

    def __init__(self, robot: Robot, things: Sequence[SceneObstacle], *, period: float) -> None:
        self.robot, self.period = robot, period
        self.actors: list[MovableObstacle] = [MovableObstacle(thing) for thing in things]
        self._build(np.array(robot.neutral), np.zeros(robot.num_coordinates))

    def _build(self, q: Array, v: Array) -> None:
        self._solids = [solid for actor in self.actors for solid in actor.thing.solids]
        self.built = build_model(self.robot, self._solids, timestep=self.period, visuals=False)
        self.data = mujoco.MjData(self.built.model)
        self.built.set_state(self.data, q, v)
        model = self.built.model
        self._free: list[tuple[MovableObstacle, int, int]] = []  # and its places in qpos and qvel
        mocap: list[int] = []
        self._driven = [actor for actor in self.actors if not actor.free]
        bodies = iter(self.built.object_bodies)
        for actor in self.actors:
            for _ in actor.thing.solids:
                body = next(bodies)
                if actor.free:
                    joint = int(model.body_jntadr[body])
                    place = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
                    self._free.append((actor, *place))
                else:
                    mocap.append(int(model.body_mocapid[body]))
        self._mocap = np.array(mocap, dtype=np.intp)
        for actor, at, dof in self._free:
            self.data.qpos[at : at + 7] = [*actor.pose[:3, 3], *actor.quaternion]
            self.data.qvel[dof : dof + 3] = actor.velocity
        self._write_driven()
        mujoco.mj_forward(model, self.data)

    def set_things(self, actors: Sequence[MovableObstacle]) -> None:
        """Other obstacles; the arm goes on as it is. Raises ValueError when two share a name."""
        q, v = self.state()
        before, self.actors = self.actors, list(actors)
        try:
            self._build(q, v)
        except ValueError:
            self.actors = before
            raise

    def set_state(self, q: Array, v: Array) -> None:
        """Puts the arm at q, v (nv,)."""
        self.built.set_state(self.data, q, v)
        mujoco.mj_forward(self.built.model, self.data)

    def state(self) -> tuple[Array, Array]:
        """q and v (nv,) of the arm."""
        return self.built.state(self.data)

    def begin(self, time: float) -> tuple[Array, Array]:
        """Computes what the control of the period from a time [s] on needs; returns q and v (nv,)."""
        for actor in self.actors:
            actor.scripted(time)
        self._write_driven()
        mujoco.mj_step1(self.built.model, self.data)
        return self.built.state(self.data)

    def dynamics(self) -> tuple[Array, Array]:
        """Mass matrix (nv, nv) and bias (nv,) after `begin`."""
        return self.built.mass_matrix(self.data), self.built.bias(self.data)

    def end(self, torque: Array) -> bool:
        """Applies the torque (nv,) for the period and moves the obstacles; whether the physics is still finite."""
        self.data.ctrl[self.built.actuators] = torque
        mujoco.mj_step2(self.built.model, self.data)
        for actor in self._driven:
            actor.advance(self.period)
        for actor, at, dof in self._free:
            if actor.target is not None:
                actor.advance(self.period)
                self.data.qpos[at : at + 7] = [*actor.pose[:3, 3], *actor.quaternion]
                self.data.qvel[dof : dof + 6] = [*actor.velocity, 0.0, 0.0, 0.0]
            else:
                actor.quaternion = self.data.qpos[at + 3 : at + 7].copy()
                actor.pose = pose_at(self.data.qpos[at : at + 3], from_quaternion(actor.quaternion))
                actor.velocity = self.data.qvel[dof : dof + 3].copy()
        bad = self.data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number
        return not bad and bool(np.isfinite(self.data.qvel).all())

    def draw(self, actor: MovableObstacle, pose: Array) -> None:
        """Draws an obstacle to a pose (4, 4), as a hand does."""
        actor.target, actor.touched = np.array(pose, dtype=float), True

    def put(self, actor: MovableObstacle, pose: Array) -> None:
        """Puts an obstacle at a pose (4, 4), at rest."""
        actor.target, actor.touched, actor.velocity = None, True, np.zeros(3)
        actor.pose = np.array(pose, dtype=float)
        actor.quaternion = pose_vector(actor.pose)[3:]
        for other, at, dof in self._free:
            if other is actor:
                self.data.qpos[at : at + 7] = [*actor.pose[:3, 3], *actor.quaternion]
                self.data.qvel[dof : dof + 6] = 0.0
        self._write_driven()
        mujoco.mj_forward(self.built.model, self.data)

    def throw(self, actor: MovableObstacle, velocity: Array) -> None:
        """Lets an obstacle fly on with a velocity (3,) [m/s]."""
        actor.target, actor.touched = None, True
        actor.velocity = np.array(velocity, dtype=float)
        for other, _, dof in self._free:
            if other is actor:
                self.data.qvel[dof : dof + 3] = velocity

    def contacts(self) -> tuple[str, ...]:
        """What of the arm touches what, each "link - obstacle", in the last period."""
        found = set()
        for index in range(self.data.ncon):
            contact = self.data.contact[index]
            owners = [self.built.geom_owner[int(geom)] for geom in contact.geom]
            links = [name for role, name in owners if role == "link"]
            if links and contact.dist <= 0.0:
                other = next(name for role, name in owners if role != "link")
                found.add(f"{links[0]} - {thing_of(other, [actor.thing for actor in self.actors])}")
        return tuple(sorted(found))

    def _write_driven(self) -> None:
        row = 0
        for actor in self._driven:
            offsets = actor.thing.offsets
            places = self._mocap[row : row + len(offsets)]
            self.data.mocap_pos[places] = offsets @ actor.pose[:3, :3].T + actor.pose[:3, 3]
            if actor.thing.cloud is None:
                self.data.mocap_quat[places] = actor.quaternion
            row += len(offsets)
