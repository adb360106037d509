"""Closed loops in which things go wrong: what the controller is told differs from what is there."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from sidestep import _core
from sidestep._core import Command, Controller, ControllerSettings, JointLimits, Obstacles
from sidestep.arm import Arm
from sidestep.bench.motion import Motion, MotionSettings
from sidestep.bench.outcome import Judge
from sidestep.bench.problem import poses_over
from sidestep.distance import ExactClearance, SceneObject
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]
Tell = Callable[[Controller, int, Array], None]
Sense = Callable[[int, Array, Array], tuple[Array, Array] | None]

PERIOD = 1e-3  # [s]
CONTACT_STRIDE = 5  # samples between two looks for the first contact
ROUNDING = 1e-6  # relative, and absolute below 1: how far beyond a limit counts as kept


def load_with_meshes(name: str) -> tuple[Arm, Robot]:
    """An arm, and its robot with the meshes by which motions are judged.

    Raises:
        ValueError: it has no meshes here.
    """
    arm = Arm.load(name)
    if not isinstance(arm.robot, Robot):
        raise ValueError(
            f"robot {name!r} has no meshes here, which motions are judged by; see `sidestep robots`"
        )
    return arm, arm.robot


def as_it_is(step: int, q: Array, v: Array) -> tuple[Array, Array]:
    """A perfect measurement."""
    return q, v


@dataclass(frozen=True, eq=False)
class Encounter:
    """What an arm meets; a `Problem` whose goal does not matter.

    Attributes:
        index: seed of the controller. start: (nv,) [rad | m], at rest. steps: periods.
        objects: the solids by which the motion is judged.
        tell: called as tell(controller, step, q) before each step: goals, obstacles.
        sense: the measured (q, v) from the true ones; None: the controller is not called in this period.
    """

    index: int
    start: Array
    steps: int
    objects: tuple[SceneObject, ...]
    tell: Tell
    sense: Sense = as_it_is
    straight_line_blocked: bool = False
    changes: tuple[float, ...] = ()

    @property
    def goal(self) -> Array:
        """The start: arrival is not judged."""
        return self.start

    def obstacles_at(self, time: float) -> Obstacles:
        """Nothing: `tell` hands obstacles over itself."""
        return Obstacles.none()


class Plant(Protocol):
    """What carries out commands."""

    def state(self) -> tuple[Array, Array]:
        """The true q and v (nv,)."""

    def apply(self, command: Command) -> None:
        """One period."""


class IdealPlant:
    """An arm that has the commanded acceleration: v += a T, q += v T."""

    def __init__(self, start: Array) -> None:
        self._q, self._v = start.copy(), np.zeros_like(start)

    def state(self) -> tuple[Array, Array]:
        """See `Plant`."""
        return self._q, self._v

    def apply(self, command: Command) -> None:
        """See `Plant`."""
        self._v = self._v + PERIOD * command.acceleration
        self._q = self._q + PERIOD * self._v


class TorquePlant:
    """The arm in MuJoCo under torque, without contacts.

    Args:
        robot: the arm. start: (nv,). joint_friction, joint_damping: see `build_model`.
        edit: changes the model before it is run.
    """

    def __init__(
        self,
        robot: Robot,
        start: Array,
        *,
        joint_friction: float = 0.0,
        joint_damping: float = 0.0,
        edit: Callable[[Any], None] | None = None,
    ) -> None:
        import mujoco

        from sidestep.simulation.model import build_model

        self._mujoco = mujoco
        self._built = build_model(
            robot,
            (),
            timestep=PERIOD,
            visuals=False,
            joint_friction=joint_friction,
            joint_damping=joint_damping,
        )
        model = self._built.model
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
        if edit is not None:
            edit(model)
        self._data = mujoco.MjData(model)
        self.put(start, np.zeros_like(start))

    def state(self) -> tuple[Array, Array]:
        """See `Plant`."""
        q, v = self._built.state(self._data)
        return q.copy(), v.copy()

    def put(self, q: Array, v: Array) -> None:
        """Puts the arm at a state, as a person who moves it does."""
        self._built.set_state(self._data, q, v)
        self._mujoco.mj_forward(self._built.model, self._data)

    def apply(self, command: Command) -> None:
        """See `Plant`."""
        self._data.ctrl[self._built.actuators] = command.torque
        self._mujoco.mj_step(self._built.model, self._data)


@dataclass(frozen=True, eq=False)
class Course:
    """What happened in an encounter: a motion, and the status of every step."""

    motion: Motion
    statuses: tuple[str, ...]


def run_encounter(
    arm: _core.Arm, encounter: Encounter, *, output: str, plant: Plant, **settings: Any
) -> Course:
    """Runs the loop: sense, step, apply. Period 1 ms, synchronous, so that it repeats.

    Args:
        arm: what the controller knows. encounter: what it meets. output: see `ControllerSettings`.
        plant: what carries out the commands. settings: others of `ControllerSettings`.
    """
    controller = Controller(
        arm, ControllerSettings(output=output, synchronous=True, seed=encounter.index, **settings)
    )
    columns: dict[str, list[Array]] = {"q": [], "v": [], "a": [], "torque": []}
    statuses: list[str] = []
    for step in range(encounter.steps):
        q, v = plant.state()
        encounter.tell(controller, step, q)
        sensed = encounter.sense(step, q, v)
        if sensed is not None or not statuses:
            controller.step(*(sensed or (q, v)))
        command = controller.command
        for name, value in zip(columns, (q, v, command.acceleration, command.torque), strict=True):
            columns[name].append(np.array(value))
        statuses.append(command.status.name)
        if not (np.isfinite(command.acceleration).all() and np.isfinite(command.torque).all()):
            raise RuntimeError(f"step {step}: a command that is not finite")
        plant.apply(command)
    rows = {name: np.array(column) for name, column in columns.items()}
    times: Array = PERIOD * np.arange(encounter.steps, dtype=np.float64)
    motion = Motion(
        q=rows["q"],
        v=rows["v"],
        a=rows["a"],
        object_poses=poses_over(encounter.objects, times),
        torque=rows["torque"] if output == "torque" else None,
        contacts=0,
        arrived=False,
        step_seconds=np.zeros(encounter.steps),
        safe=True,
    )
    return Course(motion, tuple(statuses))


@dataclass(frozen=True)
class Verdict:
    """What the exact meshes say of a course.

    Attributes:
        clearance_m: least distance to any solid, between samples too; inf without any.
        self_clearance_m: between links that may not touch; inf without such.
        pair: what came nearest. contact_s: time of the first contact; None without.
        contact_speed: fastest joint then [rad/s | m/s].
        way_out: a motion within the limits would have touched nothing, see `find_way_out`; None: not looked for.
        beyond: by limit: steps beyond it before the first contact, and the worst ratio (position: [rad | m] beyond).
        statuses: how often each status was told. before_contact: the status 50 ms before the first contact.
    """

    clearance_m: float
    self_clearance_m: float
    pair: str
    contact_s: float | None
    contact_speed: float | None
    way_out: bool | None
    beyond: dict[str, tuple[int, float]]
    statuses: dict[str, int] = field(default_factory=dict)
    before_contact: str = ""

    @property
    def contact(self) -> bool:
        """It touched a solid or itself."""
        return self.clearance_m <= 0.0 or self.self_clearance_m <= 0.0


class EncounterJudge:
    """Judges courses of one robot on its exact meshes; the controller's ellipsoids have no say."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self._judge = Judge(robot)

    def judge(self, encounter: Encounter, course: Course) -> Verdict:
        """What came of an encounter."""
        motion = course.motion
        outcome = self._judge.judge(encounter, motion, MotionSettings(period=PERIOD))
        clearance = np.inf if outcome.min_clearance_m is None else outcome.min_clearance_m
        own = np.inf if outcome.min_self_clearance_m is None else outcome.min_self_clearance_m
        first = None
        if clearance <= 0.0:
            first = self._first_contact(encounter, motion, round(outcome.clearance_time_s / PERIOD))
        return Verdict(
            clearance_m=float(clearance),
            self_clearance_m=float(own),
            pair=outcome.clearance_pair if clearance <= own else outcome.self_pair,
            contact_s=None if first is None else first * PERIOD,
            contact_speed=None if first is None else float(np.abs(motion.v[first]).max()),
            way_out=None if outcome.way_out is None else outcome.way_out.found,
            beyond=beyond_limits(motion, self.robot.limits, end=first),
            statuses=dict(Counter(course.statuses)),
            before_contact="" if first is None else course.statuses[max(0, first - 50)],
        )

    def _first_contact(self, encounter: Encounter, motion: Motion, deepest: int) -> int:
        """The first sample in contact, to within a stride; the deepest one where contact lies between samples."""
        exact = ExactClearance(self.robot, encounter.objects)
        for k in range(0, deepest, CONTACT_STRIDE):
            if exact.distance(motion.q[k], motion.object_poses[k]).distance <= 0.0:
                return k
        return min(deepest, len(motion.q) - 1)


def beyond_limits(
    motion: Motion, limits: JointLimits, *, end: int | None = None
) -> dict[str, tuple[int, float]]:
    """Steps beyond each broken limit up to `end`, and the worst ratio to it; of positions the way beyond [rad | m].

    Velocity is the arm's; acceleration, jerk, torque and its rate are those commanded.
    """
    q, v, a = motion.q[:end], motion.v[:end], motion.a[:end]
    found: dict[str, tuple[int, float]] = {}

    def put(name: str, values: Array, limit: Array) -> None:
        excess = np.abs(values) > limit * (1.0 + ROUNDING) + ROUNDING
        if excess.any():
            ratio = np.nanmax(np.abs(values) / limit)
            found[name] = (int(excess.any(axis=1).sum()), round(float(ratio), 4))

    outside = np.maximum(q - limits.upper, limits.lower - q)
    if len(q) and (outside > ROUNDING).any():
        found["position"] = (int((outside > ROUNDING).any(axis=1).sum()), round(float(outside.max()), 6))
    put("velocity", v, limits.velocity)
    put("acceleration", a, limits.acceleration)
    put("jerk", np.diff(a, axis=0) / PERIOD, limits.jerk)
    if motion.torque is not None:
        torque = motion.torque[:end]
        put("torque", torque, limits.effort)
        put("torque rate", np.diff(torque, axis=0) / PERIOD, limits.effort_rate)
    return found
