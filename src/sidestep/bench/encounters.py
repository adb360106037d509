"""Closed loops in which things go wrong: what the controller is told differs from what is there."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from sidestep import _core
from sidestep._core import Command, Controller, ControllerSettings, Obstacles
from sidestep.arm import Arm
from sidestep.bench.limits_broken import Broken, count, excesses, in_free_space
from sidestep.bench.motion import Motion, MotionSettings
from sidestep.bench.outcome import Judge
from sidestep.bench.problem import poses_over
from sidestep.bench.sensor_fault import SensorFault, fastest_contact, first_word
from sidestep.distance import ExactClearance, SceneObject
from sidestep.loop import ModelLoop
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]
Tell = Callable[[Controller, int, Array], None]
Sense = Callable[[int, Array, Array], tuple[Array, Array] | None]

PERIOD = 1e-3  # [s]
CONTACT_STRIDE = 5  # samples between two looks for the first contact
EXPLAIN_AFTER = 0.1  # [s] after data became too old the controller is asked what it does
FREE_LIMITS = ("velocity", "torque rate")  # limits that may give way near obstacles alone


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
        fault: of what tells of obstacles.
        period: what the controller takes for the time between two steps [s].
    """

    index: int
    start: Array
    steps: int
    objects: tuple[SceneObject, ...]
    tell: Tell
    sense: Sense = as_it_is
    straight_line_blocked: bool = False
    changes: tuple[float, ...] = ()
    fault: SensorFault | None = None
    period: float = PERIOD

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
    """What happened in an encounter.

    Attributes:
        motion: of the arm. statuses: of every step.
        commanded: (T, nv) positions [rad | m], nan where there was none; None: not recorded.
        explained: what the controller said of itself after a sensor had failed.
    """

    motion: Motion
    statuses: tuple[str, ...]
    commanded: Array | None = None
    explained: str = ""


def run_encounter(
    arm: _core.Arm, encounter: Encounter, *, output: str, plant: Plant, **settings: Any
) -> Course:
    """Runs the loop: sense, step, apply. Period 1 ms, synchronous, so that it repeats.

    Args:
        arm: what the controller knows. encounter: what it meets. output: see `ControllerSettings`.
        plant: what carries out the commands. settings: others of `ControllerSettings`.
    """
    controller = Controller(
        arm,
        ControllerSettings(
            output=output, synchronous=True, seed=encounter.index, period=encounter.period, **settings
        ),
    )
    loop = ModelLoop(controller)
    columns: dict[str, list[Array]] = {"q": [], "v": [], "a": [], "torque": [], "commanded": []}
    statuses: list[str] = []
    fault, explained = encounter.fault, ""
    ask_at = None if fault is None else round((fault.begins + fault.valid_for + EXPLAIN_AFTER) / PERIOD)
    for step in range(encounter.steps):
        q, v = plant.state()
        encounter.tell(controller, step, q)
        sensed = encounter.sense(step, q, v)
        if sensed is not None or not statuses:
            loop.cycle(*(sensed or (q, v)), time=step * PERIOD)
        command = controller.command
        values = q, v, command.acceleration, command.torque, command.position
        for name, value in zip(columns, values, strict=True):
            columns[name].append(np.array(value))
        statuses.append(command.status.name)
        if not (np.isfinite(command.acceleration).all() and np.isfinite(command.torque).all()):
            raise RuntimeError(f"step {step}: a command that is not finite")
        if step == ask_at:
            explained = controller.explain()
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
    return Course(motion, tuple(statuses), rows["commanded"], explained)


@dataclass(frozen=True)
class Verdict:
    """What the exact meshes say of a course.

    Attributes:
        clearance_m: least distance to any solid, between samples too; inf without any.
        self_clearance_m: between links that may not touch; inf without such.
        pair: what came nearest. contact_s: time of the first contact; None without.
        contact_speed: fastest joint then [rad/s | m/s].
        way_out: a motion within the limits would have touched nothing, see `find_way_out`; None: not looked for.
        beyond: by limit: steps beyond it before the first contact, and the worst ratio (positions: [rad | m] beyond).
        beyond_free, beyond_near: of them velocity and torque rate in free space, and nearer to something, see `FREE`.
        statuses: how often each status was told. before_contact: the status 50 ms before the first contact.
        contact_after_fault_s: the first contact after a sensor failed; negative: before.
        late_contact_speed: fastest joint in any contact after the arm has to stand and before data comes again, see
            `SensorFault.stopped_by`; None: none above 0.05.
        said, said_after_fault_s: the first status after the fault that is neither ok nor limited, and when.
        explained: see `Course`.
    """

    clearance_m: float
    self_clearance_m: float
    pair: str
    contact_s: float | None
    contact_speed: float | None
    way_out: bool | None
    beyond: Broken
    beyond_free: Broken = field(default_factory=dict)
    beyond_near: Broken = field(default_factory=dict)
    statuses: dict[str, int] = field(default_factory=dict)
    before_contact: str = ""
    contact_after_fault_s: float | None = None
    late_contact_speed: float | None = None
    said: str | None = None
    said_after_fault_s: float | None = None
    explained: str = ""

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
        beyond, beyond_free, beyond_near = self._broken_limits(encounter, course, first)
        verdict = Verdict(
            clearance_m=float(clearance),
            self_clearance_m=float(own),
            pair=outcome.clearance_pair if clearance <= own else outcome.self_pair,
            contact_s=None if first is None else first * PERIOD,
            contact_speed=None if first is None else float(np.abs(motion.v[first]).max()),
            way_out=None if outcome.way_out is None else outcome.way_out.found,
            beyond=beyond,
            beyond_free=beyond_free,
            beyond_near=beyond_near,
            statuses=dict(Counter(course.statuses)),
            before_contact="" if first is None else course.statuses[max(0, first - 50)],
            explained=course.explained,
        )
        fault = encounter.fault
        return verdict if fault is None else self._after(fault, encounter, course, verdict)

    def _broken_limits(
        self, encounter: Encounter, course: Course, end: int | None
    ) -> tuple[Broken, Broken, Broken]:
        """All limits broken before a step; velocity and torque rate of them in free space, and elsewhere."""
        motion = course.motion
        found = excesses(motion, self.robot.limits, period=encounter.period, commanded=course.commanded)
        before = np.arange(len(motion.q)) < (len(motion.q) if end is None else end)
        some = {name: excess for name, excess in found.items() if name in FREE_LIMITS}
        broken = before & np.any([excess > 0.0 for excess in some.values()], axis=0)
        free = broken.copy()
        if encounter.objects and broken.any():
            free = in_free_space(ExactClearance(self.robot, encounter.objects), motion, broken)
        return count(found, where=before), count(some, where=free), count(some, where=broken & ~free)

    def _after(self, fault: SensorFault, encounter: Encounter, course: Course, verdict: Verdict) -> Verdict:
        """A verdict with what came after a sensor failed."""
        motion, late = course.motion, None
        if verdict.contact_s is not None:
            exact = ExactClearance(self.robot, encounter.objects)
            stands = fault.stopped_by(motion, self.robot.limits, PERIOD)
            late = fastest_contact(exact, motion, stands, fault.ends, period=PERIOD, stride=CONTACT_STRIDE)
        word = first_word(course.statuses, round(fault.begins / PERIOD) + 1)
        return replace(
            verdict,
            contact_after_fault_s=None if verdict.contact_s is None else verdict.contact_s - fault.begins,
            late_contact_speed=late,
            said=word and word[1],
            said_after_fault_s=word and word[0] * PERIOD - fault.begins,
        )

    def _first_contact(self, encounter: Encounter, motion: Motion, deepest: int) -> int:
        """The first sample in contact, to within a stride; the deepest one where contact lies between samples."""
        exact = ExactClearance(self.robot, encounter.objects)
        for k in range(0, deepest, CONTACT_STRIDE):
            if exact.distance(motion.q[k], motion.object_poses[k]).distance <= 0.0:
                return k
        return min(deepest, len(motion.q) - 1)
