"""An arm in MuJoCo that is not what its model says, and a loop that drives it: what `plants.py` and others share.

The physics step is `PHYSICS_STEP`. The controller sees the measured state once a control period; torques are held
until the next one. Positions and velocities go to a drive as robots have their own, at the physics rate, with `ROTOR`
on every joint, the bias of the model that is told, and M = its mass matrix + `ROTOR`:
    position: u = M (3 w^2 e + 3 w e' + w^3 s) + bias,  e = q_d - q,  s the integral of e;  w = `DRIVE_RATE`
    velocity: u = M (2 w e + w^2 s) + bias,             e = v_d - v,  s the integral of e
q_d runs linearly from one command to the next, over a control period. s stands still where a motor is at its limit.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

import sidestep as ss
from sidestep.distance import SceneObject
from sidestep.robot import Robot, tip_of
from sidestep.simulation.model import SimulationModel, build_model

PHYSICS_STEP = 5e-4  # [s]
SAMPLE = 1e-3  # [s] between two true states that are kept
DRIVE_RATE = 60.0  # [1/s] where all poles of a drive are
BAD = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)
ROTOR = 0.1  # [kg m^2] of a drive's motor, seen from the joint
PAYLOAD_RADIUS = 0.05  # [m] of the ball of even density that an unknown payload is


@dataclass(frozen=True)
class Plant:
    """How an arm differs from what its model says.

    Attributes:
        payload: [kg] at the tip. friction: dry, [Nm] on every joint. armature: [kg m^2] on every joint.
        damping: [Nm s/rad] on every joint. torque_share: of the effort limits, what motors give.
        rate: of control [Hz]. delay: from state to command [s]. velocity_noise: of measured velocities, rms [rad/s].
        encoder_offset: of measured positions [rad], on each joint with a sign of its own.
        push: [N] on the last link in a random direction, for `push_time` [s], once every `push_every` [s] on average.
    """

    payload: float = 0.0
    friction: float = 0.0
    armature: float = 0.0
    damping: float = 0.0
    torque_share: float = 1.0
    rate: float = 1000.0
    delay: float = 0.0
    velocity_noise: float = 0.0
    encoder_offset: float = 0.0
    push: float = 0.0
    push_time: float = 0.2
    push_every: float = 1.5

    @property
    def steps_held(self) -> int:
        """Physics steps of one control period."""
        return max(1, round(1.0 / (self.rate * PHYSICS_STEP)))


@dataclass(frozen=True, eq=False)
class PlantMotion:
    """What happened.

    Attributes:
        q, v, applied: (S, nv) true state and torque of the motors [Nm], every `SAMPLE` seconds.
        acceleration, torque: (T, nv) of the command, every `period` [s].
        arrived: see `SimulatedArm.drive`.
        physics_contacts: samples at which MuJoCo pushed the arm away from a solid. Its convex parts stand out of the
            meshes (see `build_model`), so that this may be where nothing touched.
    """

    q: np.ndarray
    v: np.ndarray
    applied: np.ndarray
    acceleration: np.ndarray
    torque: np.ndarray
    period: float
    arrived: bool
    physics_contacts: int


class SimulatedArm:
    """A robot among solids in MuJoCo, as a plant; the solids are fixed.

    Args:
        robot: what the controller is told. objects: the solids. plant: how the arm differs.
        output: what of a command the arm takes: "torque", "velocity" or "position".
    """

    def __init__(
        self, robot: Robot, objects: tuple[SceneObject, ...], plant: Plant, output: str = "torque"
    ) -> None:
        self.robot, self.plant, self.output = robot, plant, output
        self.true = build_model(robot, objects, timestep=PHYSICS_STEP, visuals=False)
        self.told = build_model(robot, timestep=PHYSICS_STEP, visuals=False)
        model = self.true.model
        dofs = self.true.joint_velocities
        model.dof_frictionloss[dofs] = plant.friction
        model.dof_armature[dofs] += plant.armature + (0.0 if output == "torque" else ROTOR)
        model.dof_damping[dofs] += plant.damping
        if plant.payload > 0.0:
            add_payload(self.true, robot, plant.payload)
        self.most = plant.torque_share * robot.limits.effort
        self.last_body = int(model.jnt_bodyid[model.njnt - 1])
        self._told_data = mujoco.MjData(self.told.model)

    def told_dynamics(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mass matrix (nv, nv) and bias (nv,) of the model that is told."""
        return dynamics(self.told, self._told_data, q, v)

    def can_hold(self, q: np.ndarray) -> bool:
        """Whether the motors hold the true arm at q (nv,), with what dry friction may take."""
        _, gravity = dynamics(self.true, mujoco.MjData(self.true.model), q, np.zeros_like(q))
        return bool(np.all(np.abs(gravity) + self.plant.friction <= self.most))

    def drive(
        self,
        controller: ss.Controller,
        start: np.ndarray,
        duration: float,
        *,
        seed: int,
        goal: np.ndarray | None = None,
        tolerance: float = 0.02,
        before: Callable[[float, np.ndarray, np.ndarray], None] | None = None,
    ) -> PlantMotion:
        """Drives the arm from rest at `start` for a duration [s], or until it has been at the goal for 0.2 s.

        Args:
            controller: whose period is that of the plant. seed: of noise, offsets and pushes.
            goal: there every true joint is within `tolerance`, slower than `tolerance` a second.
            before: called before each step with time and measured state.
        """
        plant, rng = self.plant, np.random.default_rng((23, seed))
        count, held = len(start), plant.steps_held
        offset = plant.encoder_offset * rng.choice([-1.0, 1.0], size=count)
        data = mujoco.MjData(self.true.model)
        self.true.set_state(data, start, np.zeros(count))
        pushes = _pushes(rng, plant, duration)
        waiting: deque[np.ndarray] = deque()
        late = round(plant.delay / PHYSICS_STEP)
        _, gravity = self.told_dynamics(start, np.zeros(count))
        first = {"torque": gravity, "velocity": np.zeros(count), "position": start + offset}[self.output]
        waiting.extend([first] * late)
        motor = _Motor(self, first, offset)
        states: list[tuple[np.ndarray, ...]] = []
        commands: list[tuple[np.ndarray, ...]] = []
        pushed, every = 0, round(SAMPLE / PHYSICS_STEP)
        near_since, arrived = None, False
        for k in range(max(1, round(duration * plant.rate))):
            time = k / plant.rate
            mujoco.mj_step1(self.true.model, data)
            q, v = self.true.state(data)
            if any(data.warning[kind].number for kind in BAD):  # MuJoCo starts anew by itself then
                raise RuntimeError(f"the physics diverged at {time:.3f} s")
            measured = q + offset, v + plant.velocity_noise * rng.normal(size=count)
            if before is not None:
                before(time, *measured)
            command = controller.step(*measured)
            asked = np.array(getattr(command, self.output))
            for substep in range(held):
                if substep:
                    mujoco.mj_step1(self.true.model, data)
                waiting.append(asked)
                q, v = self.true.state(data)
                data.ctrl[self.true.actuators] = motor.torque(waiting.popleft(), q, v)
                if substep % every == 0:
                    states.append((q, v, data.ctrl[self.true.actuators].copy()))
                    pushed += bool(np.any(data.contact.dist <= 0.0))
                data.xfrc_applied[self.last_body, :3] = _push_at(pushes, time + substep * PHYSICS_STEP)
                mujoco.mj_step2(self.true.model, data)
            commands.append((command.acceleration, command.torque))
            if goal is None:
                continue
            near = np.abs(q - goal).max() < tolerance and np.abs(v).max() < tolerance
            near_since = (time if near_since is None else near_since) if near else None
            if near_since is not None and time - near_since >= 0.2:
                arrived = True
                break
        columns = [np.array(c) for rows in (states, commands) for c in zip(*rows, strict=True)]
        return PlantMotion(*columns, period=1.0 / plant.rate, arrived=arrived, physics_contacts=pushed)


class _Motor:
    """Turns commands into torques within what the motors give."""

    def __init__(self, arm: SimulatedArm, first: np.ndarray, offset: np.ndarray) -> None:
        self.arm, self.offset = arm, offset
        self.most = arm.most
        self.last, self.wanted, self.rate = first, first, np.zeros_like(first)
        self.begin, self.sum = first, np.zeros_like(first)
        self.age = 0

    def torque(self, command: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        if self.arm.output == "torque":
            return np.clip(command, -self.most, self.most)
        mass, bias = self.arm.told_dynamics(q, v)
        mass, w = mass + ROTOR * np.eye(len(q)), DRIVE_RATE
        if self.arm.output == "velocity":
            error = command - v
            raw = mass @ (2.0 * w * error + w**2 * self.sum) + bias
        else:
            if command is not self.last:
                self.begin, self.last, self.age = self.wanted, command, 0
                self.rate = (command - self.begin) * self.arm.plant.rate
            self.age += 1
            moving = self.age <= self.arm.plant.steps_held
            self.wanted = self.begin + min(1.0, self.age / self.arm.plant.steps_held) * (
                self.last - self.begin
            )
            error = self.wanted - (q + self.offset)
            speed = self.rate - v if moving else -v
            raw = mass @ (3.0 * w**2 * error + 3.0 * w * speed + w**3 * self.sum) + bias
        self.sum = self.sum + PHYSICS_STEP * np.where(np.abs(raw) < self.most, error, 0.0)
        return np.clip(raw, -self.most, self.most)


def dynamics(
    built: SimulationModel, data: mujoco.MjData, q: np.ndarray, v: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Mass matrix (nv, nv) and bias (nv,) of a model at q and v (nv,)."""
    model = built.model
    built.set_state(data, q, v)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_crb(model, data)
    mujoco.mj_comVel(model, data)
    mujoco.mj_rne(model, data, 0, data.qfrc_bias)
    return built.mass_matrix(data), built.bias(data)


def add_payload(built: SimulationModel, robot: Robot, mass: float) -> None:
    """Adds a ball of a mass [kg] with its centre at the tip of the robot, to the body that carries it."""
    tip = next(frame for frame in robot.frames if frame.name == tip_of(robot))
    body = int(built.model.body(f"joint:{robot.joints[tip.joint].name}").id)
    model = built.model
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[body])
    R = turn.reshape(3, 3)
    parts = [
        (
            float(model.body_mass[body]),
            model.body_ipos[body].copy(),
            R @ np.diag(model.body_inertia[body]) @ R.T,
        ),
        (mass, tip.placement[:3, 3], 0.4 * mass * PAYLOAD_RADIUS**2 * np.eye(3)),
    ]
    total, com, inertia = combined(parts)
    values, axes = np.linalg.eigh(inertia)
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, axes.ravel())
    model.body_mass[body], model.body_ipos[body] = total, com
    model.body_inertia[body], model.body_iquat[body] = values, quaternion
    mujoco.mj_setConst(model, mujoco.MjData(model))


def combined(parts: list[tuple[float, np.ndarray, np.ndarray]]) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre (3,) and inertia (3, 3) about it of bodies, each with these three, in one frame."""
    total = sum(mass for mass, _, _ in parts)
    com = sum(mass * center for mass, center, _ in parts) / total
    inertia = np.zeros((3, 3))
    for mass, center, own in parts:
        r = center - com
        inertia += own + mass * (r @ r * np.eye(3) - np.outer(r, r))
    return total, com, inertia


def _pushes(rng: np.random.Generator, plant: Plant, duration: float) -> list[tuple[float, float, np.ndarray]]:
    """When pushes begin and end [s], and their forces (3,) [N]."""
    found, time = [], 0.0
    while plant.push > 0.0 and time < duration:
        time += plant.push_time + rng.exponential(plant.push_every)
        direction = rng.normal(size=3)
        found.append((time, time + plant.push_time, plant.push * direction / np.linalg.norm(direction)))
    return found


def _push_at(pushes: list[tuple[float, float, np.ndarray]], time: float) -> np.ndarray:
    return next((force for begin, end, force in pushes if begin <= time < end), np.zeros(3))
