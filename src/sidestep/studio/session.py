"""The simulation behind the page: the real loop in MuJoCo, one step at a time, driven by commands.

It knows nothing of the page. `loop` runs it in a process of its own, tests call it directly.
"""

from __future__ import annotations

import time as clock
from collections import deque
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import Obstacles, Step, TorqueController, TorqueSolution, real_array
from sidestep.body import Body
from sidestep.robot import Robot
from sidestep.scenario import Scenario
from sidestep.scenario.assembly import (
    POSTURE_STARTS,
    coordinates,
    goal_posture,
    load_robot,
    start_velocity,
)
from sidestep.scenario.parts import torque_program_of
from sidestep.scenario.scenario import JointState
from sidestep.simulation.pose_aim import Posture, posture_at
from sidestep.simulation.run import status_name
from sidestep.studio import messages as m
from sidestep.studio.methods import METHODS, Method, check_numbers, method_named
from sidestep.studio.parameters import Numbers
from sidestep.studio.pursuit import Pursuit
from sidestep.studio.stage import Actor, Stage
from sidestep.studio.systems import Recipe, as_file, build_system, numbers_of, recipe_of
from sidestep.studio.things import check_names, things_of
from sidestep.studio.tip import at_tip, tip_of
from sidestep.studio.words import in_words

Array = npt.NDArray[np.float64]
Prepare = Callable[[Robot, Recipe], Body]

TIMED_STEPS = 2000  # whose times are kept: two seconds at 1 kHz
RECORD_EVERY = 5  # steps: 200 rows per second, between which an arm moves a millimetre in a straight line
REST = 0.5  # [s] for which all joints have been slower than `SLOW`: the arm rests
SLOW = 0.02  # [rad/s | m/s]


class Session:
    """One arm, its obstacles, a goal and a method.

    Args:
        scenario: robot, start, goal, obstacles and control period.
        method: one of `METHODS`. numbers: of methods, by name; defaults for the rest.
        ellipsoids: of a covering body per link, where the scenario does not say; None: as many as it takes.
        prepare: gives the body of a robot by a recipe; may take long.

    Raises:
        ValueError: that names what is wrong in the scenario, the method or its numbers.

    Attributes:
        robot, tip: the arm and the link whose pose is a goal. stage: the physics.
        period: of control [s]. time: simulated [s]. running: or paused.
        edition: grows when obstacles come or go, or a scenario is loaded.
    """

    robot: Robot
    tip: str
    stage: Stage
    period: float
    time: float
    running: bool
    edition: int
    _bodies: dict[str, Body]
    _pursuit: Pursuit
    _controller: TorqueController
    _posture: Posture
    _step: Step | None
    _solution: TorqueSolution | None
    _contacts: tuple[str, ...]
    _times: deque[float]
    _rows: list[m.Row]

    def __init__(
        self,
        scenario: Scenario,
        *,
        method: str = "barrier",
        numbers: Mapping[str, Mapping[str, Any]] | None = None,
        ellipsoids: int | None = None,
        prepare: Prepare,
    ) -> None:
        self._prepare, self._usual_ellipsoids = prepare, ellipsoids
        self._numbers = {name: method.defaults for name, method in METHODS.items()}
        self._method = method_named(method)
        self.edition = 0
        self._rows = []
        self._load(scenario, self._method, numbers or {})

    # --- what happens ---

    def handle(self, command: m.Command) -> None:
        """Does what a command says; raises ValueError or OSError, and stays as it was, where it cannot."""
        match command:
            case m.SetJointGoal(position):
                self._set_goal(None, Posture(self.robot.check_configuration(position, "goal")))
            case m.SetPoseGoal(pose, thorough):
                target = finite(pose, "the pose of the goal")
                near = self.stage.state()[0] if self._pose is None else self._posture.q
                starts = POSTURE_STARTS if thorough else 1
                free = partial(self._pursuit.is_free, obstacles=self._obstacles())
                self._set_goal(
                    target, posture_at(self.robot, self.tip, target, near, starts=starts, free=free)
                )
            case m.AddThing(thing):
                check_names([*(actor.thing for actor in self.stage.actors), thing])
                self._set_actors([*self.stage.actors, Actor(thing)])
            case m.RemoveThing(name):
                gone = self.actor(name)
                self._set_actors([actor for actor in self.stage.actors if actor is not gone])
            case m.DragThing(name, place):
                if place is None:
                    self.stage.throw(self.actor(name), np.zeros(3))
                elif self.running:
                    self.stage.draw(self.actor(name), finite(place, f"the place of {name}"))
                else:
                    self.stage.put(self.actor(name), finite(place, f"the place of {name}"))
                    self._pursuit.obstacles_changed()
            case m.ThrowThing(name, velocity):
                self.stage.throw(self.actor(name), finite(velocity, f"the velocity of {name}"))
            case m.SetMethod(name):
                self._use(method_named(name), self._numbers[name])
            case m.SetNumbers(name, numbers):
                method = method_named(name)
                checked = check_numbers(method, numbers, self._numbers[name])
                if method is self._method:
                    self._use(method, checked)
                self._numbers[name] = checked
            case m.SetRunning(running, until):
                self.running, self._until = running, until
            case m.SetRecording(recording):
                self._recording = recording
                self._rows.clear()
            case m.Restart(until):
                self._begin()
                self.running, self._until = until > 0.0, until
            case m.Load(scenario, asked):
                self._load(scenario, self._method if asked is None else method_named(asked), {})
            case m.Seen() | m.Drawn():
                return
        if not self.running and self._step is not None:
            self._look_again()

    def step(self) -> None:
        """One control period: obstacles, state, wanted acceleration, torque, physics.

        Raises:
            RuntimeError: the physics diverged.
        """
        stage, begin = self.stage, clock.perf_counter()
        q, v = stage.begin(self.time)
        if np.abs(v).max() > SLOW:
            self._moved = self.time
        obstacles = self._obstacles()
        step, wanted = self._pursuit.step(q, v, obstacles)
        mass, bias = stage.dynamics()
        solution = self._controller.solve(
            q, v, wanted, mass, bias, clearances=step if self._method.safe else None
        )
        finite = stage.end(solution.torque)
        self._times.append(clock.perf_counter() - begin)
        if not finite:
            raise RuntimeError(f"the physics diverged at {self.time:.3f} s; restart")
        self.time += self.period
        self._count += 1
        if self.time >= self._until - 0.5 * self.period:
            self.running = False
        self._step, self._solution = step, solution
        if stage.data.ncon:
            self._contacts = stage.contacts()
            self._touched += bool(self._contacts)
        else:
            self._contacts = ()
        if self._recording and self._count % RECORD_EVERY == 0:
            self._rows.append(m.Row(self.time, q, self._things, self._poses(), np.array(step.metric)))

    def snapshot(self, *, real_time: float = 0.0) -> m.Snapshot:
        """The state now, and the rows recorded since the last snapshot."""
        q, v = self.stage.state()
        limits = self.robot.limits
        rows, self._rows = tuple(self._rows), []
        obstacles = self._obstacles()
        words, status = "at the start", ("", "")
        nearest, values, metric, torque = ("", np.inf), np.zeros(0), np.eye(len(q)), 0.0
        if self._step is not None and self._solution is not None:
            step = self._step
            diagnosis = step.diagnosis
            there = None if self.time - self._moved < REST else self._pursuit.at_goal(obstacles)
            words = in_words(diagnosis, there, owners=self._owners, things=self._things)
            words = self._pursuit.in_words(words)
            status = status_name(step.status), status_name(self._solution.status)
            values, metric = np.array(step.values), np.array(step.metric)
            clearances = np.asarray(step.clearances.values)
            if len(clearances) and np.isfinite(clearances).any():
                nearest = (diagnosis.name, float(clearances.min()))
            torque = float((np.abs(self._solution.torque) / limits.effort).max())
        return m.Snapshot(
            scenario=self.scenario,
            edition=self.edition,
            time=self.time,
            running=self.running,
            q=q.copy(),
            v=v.copy(),
            goal=self._posture.q if self._pose is None else None,
            goal_pose=self._pose,
            posture=self._posture,
            goal_written=self._goal_written,
            relaxed=self._pursuit.places(obstacles),
            tip=self.tip,
            things=self._things,
            poses=self._poses(),
            velocities=np.array([actor.velocity for actor in self.stage.actors]).reshape(-1, 3),
            courses=tuple(actor.course for actor in self.stage.actors),
            method=self._method.name,
            numbers={name: dict(numbers) for name, numbers in self._numbers.items()},
            words=words,
            status=status,
            nearest=nearest,
            values=values,
            metric=metric,
            torque_share=torque,
            speed_share=float((np.abs(v) / limits.velocity).max()),
            contacts=self._contacts,
            touched=self._touched,
            timing=m.Timing.of(self._times, real_time),
            recording=self._recording,
            rows=rows,
        )

    def actor(self, name: str) -> Actor:
        """The obstacle called `name`; raises ValueError that lists them."""
        for actor in self.stage.actors:
            if actor.thing.name == name:
                return actor
        known = ", ".join(actor.thing.name for actor in self.stage.actors) or "none"
        raise ValueError(f"there is no obstacle {name!r}; there are: {known}")

    # --- parts ---

    def _look_again(self) -> None:
        """The system and the contacts as they are now, while time stands still."""
        q, v = self.stage.state()
        self._step = self._pursuit.look(q, v, self._obstacles())
        self._contacts = self.stage.contacts()

    def _load(self, scenario: Scenario, method: Method, given: Mapping[str, Mapping[str, Any]]) -> None:
        robot = load_robot(scenario)
        bodies: dict[str, Body] = {}
        if self.edition and robot.fingerprint == self.robot.fingerprint:
            robot, bodies = self.robot, dict(self._bodies)
        start = coordinates(scenario.start, robot, "start.position")
        velocity = start_velocity(scenario.start, robot)
        posture = goal_posture(scenario, robot, start)
        pose = None if isinstance(scenario.goal, JointState) else at_tip(scenario.goal, robot)
        stage = Stage(robot, things_of(scenario), period=scenario.simulation.period)
        numbers = self._numbers_for(scenario, given)
        parts = self._parts_of(method, numbers[method.name], scenario, robot, bodies)
        self._pursuit, self._controller = parts
        self.scenario, self.robot, self.tip, self.stage = scenario, robot, tip_of(robot), stage
        self._method, self._numbers, self._bodies = method, numbers, bodies
        self.period = scenario.simulation.period
        self._start = start, velocity
        self._set_goal(pose, posture, written=True)
        self._begin()

    def _numbers_for(self, scenario: Scenario, given: Mapping[str, Mapping[str, Any]]) -> dict[str, Numbers]:
        """The numbers of all methods: as they are, those of the scenario for its method, and those given."""
        asked, values = numbers_of(scenario)
        numbers = {**self._numbers, asked: METHODS[asked].defaults | values}
        ellipsoids = {"ellipsoids": scenario.barriers.ellipsoids or self._usual_ellipsoids}
        for name, method in METHODS.items():
            if method.covering:
                numbers[name] = numbers[name] | ellipsoids
        for name, own in given.items():
            numbers[name] = check_numbers(method_named(name), own, numbers[name])
        return numbers

    def _begin(self) -> None:
        self.time, self._count, self._touched = 0.0, 0, 0
        self._moved = 0.0
        self.running, self._until = True, float("inf")
        self._step = self._solution = None
        self._contacts = ()
        self._times = deque(maxlen=TIMED_STEPS)
        self._recording = False  # time goes back: a recording is of one motion
        self._set_actors([Actor(actor.thing) for actor in self.stage.actors])
        self.stage.set_state(*self._start)
        self._pursuit.forget()
        self._pursuit.begin(self._pose, self._posture)

    def _set_goal(self, pose: Array | None, posture: Posture, *, written: bool = False) -> None:
        self._pose, self._posture, self._goal_written = pose, posture, written
        self._pursuit.begin(pose, posture)

    def _set_actors(self, actors: list[Actor]) -> None:
        self.stage.set_things(actors)
        self.edition += 1
        self._look()

    def _use(self, method: Method, numbers: Numbers) -> None:
        self._pursuit, self._controller = self._parts_of(
            method, numbers, self.scenario, self.robot, self._bodies
        )
        self._method, self._numbers[method.name] = method, dict(numbers)
        self._pursuit.begin(self._pose, self._posture)
        self._look()

    def _parts_of(
        self, method: Method, numbers: Numbers, scenario: Scenario, robot: Robot, bodies: dict[str, Body]
    ) -> tuple[Pursuit, TorqueController]:
        recipe, written = recipe_of(method, numbers, scenario), as_file(method, numbers, scenario)
        controller = torque_program_of(written.torque, robot, scenario.simulation.period)
        if str(recipe) not in bodies:
            bodies[str(recipe)] = self._prepare(robot, recipe)
        body = bodies[str(recipe)]
        system = build_system(method, robot, body, numbers, scenario)
        return Pursuit(robot, tip_of(robot), method, body, system, written), controller

    def _look(self) -> None:
        """Lays out what is seen: points of each obstacle in its frame, and whose each point is."""
        self._pursuit.obstacles_changed()
        views = [actor.thing.seen(bare=not self._method.safe) for actor in self.stage.actors]
        self._views = [points for points, _ in views]
        self._radii = np.concatenate([np.zeros(0), *(radii for _, radii in views)])
        counts = [len(points) for points in self._views]
        self._owners = np.repeat(np.arange(len(counts)), counts)
        self._things = tuple(actor.thing for actor in self.stage.actors)

    def _obstacles(self) -> Obstacles:
        actors = self.stage.actors
        if not actors:
            return Obstacles.none()
        points = [
            view @ actor.pose[:3, :3].T + actor.pose[:3, 3]
            for view, actor in zip(self._views, actors, strict=True)
        ]
        velocities = np.array([actor.velocity for actor in actors])
        return Obstacles(np.concatenate(points), self._radii, velocities[self._owners])

    def _poses(self) -> Array:
        return np.array([actor.pose for actor in self.stage.actors]).reshape(-1, 4, 4)


def finite(values: npt.ArrayLike, what: str) -> Array:
    """The values as an array; raises ValueError where one of them is not finite."""
    array = real_array(values, what).copy()
    if not np.isfinite(array).all():
        raise ValueError(f"{what} is {array.tolist()}; allowed: finite numbers")
    return array
