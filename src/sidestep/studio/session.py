"""The simulation behind the page: the real loop in MuJoCo, one step at a time, driven by commands.

It knows nothing of the page. `loop` runs it in a process of its own, tests call it directly.
"""

from __future__ import annotations

import re
import time as clock
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import Obstacles, real_array
from sidestep.robot import Robot, tip_of
from sidestep.scenario import Scenario
from sidestep.scenario.assembly import coordinates, load_robot, start_velocity
from sidestep.scenario.scenario import JointState
from sidestep.studio import messages as m
from sidestep.studio.adapter import Adapter, ControllerAdapter, StepRecord
from sidestep.studio.aim import Aim
from sidestep.studio.camera_choice import CameraChoice
from sidestep.studio.camera_process import Setup
from sidestep.studio.goals_in_turn import GoalsInTurn
from sidestep.studio.methods import METHODS, check_numbers, method_named
from sidestep.studio.parameters import Method, Numbers
from sidestep.studio.prepared_bodies import USUAL, Draft, Prepare, PreparedBodies
from sidestep.studio.reason import Events
from sidestep.studio.scene_obstacle import check_names, things_of
from sidestep.studio.seen_things import SeenThings
from sidestep.studio.session_camera import SessionCamera
from sidestep.studio.simulated_scene import MovableObstacle, SimulatedScene
from sidestep.studio.steps import Steps
from sidestep.studio.systems import build_adapter, numbers_of, recipe_of
from sidestep.studio.tip import at_tip

Array = npt.NDArray[np.float64]

LOOK_EVERY = 10  # steps between two looks for events
RECORD_EVERY = 5  # steps: 200 rows per second, between which an arm moves a millimetre in a straight line


class Session:
    """One arm, its obstacles, a goal and a method.

    Args:
        scenario: robot, start, goal, obstacles and control period.
        method: one of `METHODS`. numbers: of methods, by name; defaults for the rest.
        goals: configurations (nv,) that are visited in turn from the start, see `VisitGoals`.
        ellipsoids: of a covering body per link, where the scenario does not say; None: as many as it takes.
        prepare: gives the body of a robot by a recipe; may take long.
        draft: gives the arm of a description file in seconds; a finer one is made beside the loop then, which goes on.
            None: such arms are prepared as others are.
        synchronous: motions are the same every time; the planner, say, holds the loop up.

    Raises:
        ValueError: that names what is wrong in the scenario, the method or its numbers.

    Attributes:
        robot: the arm. stage: the physics.
        period: of control [s]. time: simulated [s]. running: or paused.
        edition: grows when obstacles come or go, or a scenario is loaded.
    """

    robot: Robot
    stage: SimulatedScene
    period: float
    time: float
    running: bool
    edition: int
    _prepared: PreparedBodies
    _adapter: Adapter
    _goal: Aim
    _loaded_goal: Aim
    _steps: Steps
    _rows: list[m.Row]

    def __init__(
        self,
        scenario: Scenario,
        *,
        method: str = "controller",
        numbers: Mapping[str, Mapping[str, Any]] | None = None,
        goals: Sequence[Array] = (),
        ellipsoids: int | None = None,
        prepare: Prepare,
        draft: Draft | None = None,
        synchronous: bool = False,
    ) -> None:
        self._new_bodies = partial(PreparedBodies, prepare, draft)
        self._usual_ellipsoids, self._synchronous = ellipsoids, synchronous
        self._turns = GoalsInTurn()
        self._numbers = {name: method.defaults for name, method in METHODS.items()}
        self._method = method_named(method)
        self._camera = SessionCamera(self._camera_setup, synchronous=synchronous)
        self.edition = 0
        self._rows = []
        self._load(scenario, self._method, numbers or {}, goals)

    # --- what happens ---

    def handle(self, command: m.Command) -> None:
        """Does what a command says; raises ValueError or OSError, and stays as it was, where it cannot."""
        match command:
            case m.SetJointGoal(position):
                self._turns.goals = ()
                self._set_goal(None, self.robot.check_configuration(position, "goal"))
            case m.SetPoseGoal(pose, thorough):
                last = None if self._goal.pose is None else self._adapter.posture
                near = self.stage.state()[0] if last is None else last.q
                self._turns.goals = ()
                self._set_goal(finite(pose, "the pose of the goal"), near, thorough=thorough)
            case m.AddObstacle(thing):
                check_names([*(actor.thing for actor in self.stage.actors), thing])
                self._set_actors([*self.stage.actors, MovableObstacle(thing)])
            case m.ReplaceObstacle(thing):
                old = self.actor(thing.name)
                new = MovableObstacle(thing.at(old.pose))
                self._set_actors([new if actor is old else actor for actor in self.stage.actors])
            case m.RemoveObstacle(name):
                gone = self.actor(name)
                self._set_actors([actor for actor in self.stage.actors if actor is not gone])
            case m.DragObstacle(name, place):
                if place is None:
                    self.stage.throw(self.actor(name), np.zeros(3))
                elif self.running:
                    self.stage.draw(self.actor(name), finite(place, f"the place of {name}"))
                else:
                    self.stage.put(self.actor(name), finite(place, f"the place of {name}"))
            case m.ThrowObstacle(name, velocity):
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
                return
            case m.SetRecording(recording):
                self._recording = recording
                self._rows.clear()
            case m.Restart(until):
                if self._turns.goals:
                    first = self._turns.goals[0]
                    loaded = self._loaded_goal
                    self._goal = Aim(
                        None, first, written=loaded.pose is None and np.array_equal(loaded.near, first)
                    )
                self._use(self._method, self._numbers[self._method.name])  # remembers nothing
                self._begin()
                self.running, self._until = until > 0.0, until
            case m.Load(scenario, asked, goals):
                self._load(scenario, self._method if asked is None else method_named(asked), {}, goals)
            case m.VisitGoals(goals):
                self._visit(goals)
            case m.SetCamera(choice):
                self._camera.set(choice, self._adapter)
                self._use(self._method, self._numbers[self._method.name])
            case m.Seen() | m.Drawn():
                return
        if not self.running:
            self._adapter.look(*self.stage.state(), self._obstacles())
            self._steps.contacts = self.stage.contacts()

    def step(self) -> None:
        """One control period: obstacles, state, torque, physics.

        Raises:
            RuntimeError: the physics diverged.
        """
        stage, begin = self.stage, clock.perf_counter()
        q, v = stage.begin(self.time)
        self._steps.torque = self._adapter.step(q, v, *stage.dynamics(), self._obstacles())
        if not self._camera.step(self._adapter, q, self._poses):
            self._use(self._method, self._numbers[self._method.name])
        finite = stage.end(self._steps.torque)
        self._steps.times.append(clock.perf_counter() - begin)
        if not finite:
            raise RuntimeError(f"the physics diverged at {self.time:.3f} s; restart")
        self.time += self.period
        self._steps.count += 1
        if self._steps.count % LOOK_EVERY == 0:
            self._look_back(q)
        if self.time >= self._until - 0.5 * self.period:
            self.running = False
        if stage.data.ncon:
            self._steps.contacts = stage.contacts()
            self._steps.touched += bool(self._steps.contacts)
        else:
            self._steps.contacts = ()
        if self._recording and self._steps.count % RECORD_EVERY == 0:
            self._rows.append(m.Row(self.time, q, self._seen.things, self._poses(), self._adapter.metric))

    def snapshot(self, *, real_time: float = 0.0) -> m.Snapshot:
        """The state now, and the rows recorded since the last snapshot."""
        q, v = self.stage.state()
        limits = self.robot.limits
        rows, self._rows = tuple(self._rows), []
        record = self._adapter.record() or StepRecord("at the start", metric=np.eye(len(q)))
        words = re.sub(r"\blink (?=\S*link)", "", record.words)  # such names say it themselves
        goal = self._goal
        return m.Snapshot(
            scenario=self.scenario,
            edition=self.edition,
            time=self.time,
            running=self.running,
            q=q.copy(),
            v=v.copy(),
            goal=goal.near if goal.pose is None else None,
            goal_pose=goal.pose,
            posture=self._adapter.posture,
            goal_written=goal.written,
            draft=self._prepared.is_draft,
            refining=self._prepared.refining,
            visited=self._turns.goals,
            tip=self.tip,
            things=self._seen.things,
            poses=self._poses(),
            velocities=np.array([actor.velocity for actor in self.stage.actors]).reshape(-1, 3),
            courses=tuple(actor.course for actor in self.stage.actors),
            method=self._method.name,
            numbers={name: dict(numbers) for name, numbers in self._numbers.items()},
            **vars(record) | {"words": words},
            events=self._events.told,
            torque_share=float((np.abs(self._steps.torque) / limits.effort).max()),
            speed_share=float((np.abs(v) / limits.velocity).max()),
            contacts=self._steps.contacts,
            touched=self._steps.touched,
            timing=m.Timing.of(self._steps.times, real_time),
            recording=self._recording,
            camera=self._camera.state(self._adapter),
            rows=rows,
        )

    @property
    def tip(self) -> str:
        """The link whose pose is a goal."""
        return tip_of(self.robot)

    def actor(self, name: str) -> MovableObstacle:
        """The obstacle called `name`; raises ValueError that lists them."""
        for actor in self.stage.actors:
            if actor.thing.name == name:
                return actor
        known = ", ".join(actor.thing.name for actor in self.stage.actors) or "none"
        raise ValueError(f"there is no obstacle {name!r}; there are: {known}")

    # --- parts ---

    def _load(
        self,
        scenario: Scenario,
        method: Method,
        given: Mapping[str, Mapping[str, Any]],
        goals: Sequence[Array],
    ) -> None:
        robot = load_robot(scenario)
        prepared = self._new_bodies()
        if self.edition and robot.fingerprint == self.robot.fingerprint:
            robot, prepared = self.robot, self._prepared
        start = coordinates(scenario.start, robot, "start.position")
        velocity = start_velocity(scenario.start, robot)
        goal = scenario.goal
        pose = None if isinstance(goal, JointState) else at_tip(goal, robot)
        end = goal if isinstance(goal, JointState) else goal.posture
        place = "goal.position" if pose is None else "goal.posture.position"
        near = start if end is None else coordinates(end, robot, place)
        visited = tuple(robot.check_configuration(q, "goals") for q in goals)
        stage = SimulatedScene(robot, things_of(scenario), period=scenario.simulation.period)
        numbers = self._numbers_for(scenario, given)
        adapter = self._adapter_of(method, numbers[method.name], scenario, robot, prepared)
        adapter.set_goal(pose, near, thorough=True)
        self._adapter, self._turns.goals = adapter, visited
        self._goal = self._loaded_goal = Aim(pose, near, written=True)
        if self.edition and robot is not self.robot:
            self.stop()
        self._camera.tell(adapter)
        self.scenario, self.robot, self.stage = scenario, robot, stage
        self._method, self._numbers, self._prepared = method, numbers, prepared
        self.period = scenario.simulation.period
        self._start = start, velocity
        self._begin()

    def _numbers_for(self, scenario: Scenario, given: Mapping[str, Mapping[str, Any]]) -> dict[str, Numbers]:
        """The numbers of all methods: as they are, those of the scenario for its method, and those given."""
        asked, values = numbers_of(scenario)
        numbers = {**self._numbers, asked: METHODS[asked].defaults | values}
        ellipsoids = {"ellipsoids": scenario.body.ellipsoids or self._usual_ellipsoids}
        for name, method in METHODS.items():
            if method.controlled:
                numbers[name] = numbers[name] | ellipsoids
        for name, own in given.items():
            numbers[name] = check_numbers(method_named(name), own, numbers[name])
        return numbers

    def _begin(self) -> None:
        self.time, self._steps = 0.0, Steps(np.zeros(self.robot.num_coordinates))
        self.running, self._until = True, float("inf")
        self._events = Events()
        self._turns.begin(0.0)
        self._recording = False  # time goes back: a recording is of one motion
        self._set_actors([MovableObstacle(actor.thing) for actor in self.stage.actors])
        self.stage.set_state(*self._start)

    def _visit(self, goals: Sequence[Array]) -> None:
        """Several goals in turn, beginning with the one that comes after the present one, if it is among them."""
        self._turns.set(tuple(self.robot.check_configuration(q, "goals") for q in goals), self.time)
        if self._turns.goals:
            self._set_goal(None, self._turns.after(self._goal.near))

    def _look_back(self, q: Array) -> None:
        """Events of the last step, a finer body, and the next goal where the arm has been at this one for a while."""
        if self._prepared.is_draft:
            self._take_finer()
        moment = self._adapter.event_record()
        if moment is not None:
            self._events.take(self.time, moment)
        following = self._turns.due(self.time, q, self._goal.near)
        if following is not None:
            self._set_goal(None, following)

    def _set_goal(self, pose: Array | None, q: Array, *, thorough: bool = True) -> None:
        self._adapter.set_goal(pose, q, thorough=thorough)
        self._goal = Aim(pose, q, written=False)
        self._events.tell(self.time, "new goal")

    def _set_actors(self, actors: list[MovableObstacle]) -> None:
        self.stage.set_things(actors)
        self.edition += 1
        self._camera.renew()
        self._look()

    def _use(self, method: Method, numbers: Numbers) -> None:
        adapter = self._adapter_of(method, numbers, self.scenario, self.robot, self._prepared)
        goal, found = self._goal, self._adapter.posture
        if goal.pose is not None and found is not None and found.found:
            goal = goal._replace(near=found.q)
        adapter.set_goal(goal.pose, goal.near, thorough=True)
        self._camera.tell(adapter)
        self._adapter, self._method, self._numbers[method.name] = adapter, method, dict(numbers)
        self._goal = goal
        self._look()

    def _adapter_of(
        self,
        method: Method,
        numbers: Numbers,
        scenario: Scenario,
        robot: Robot,
        prepared: PreparedBodies,
    ) -> Adapter:
        body, arm = prepared.get(recipe_of(method, numbers, scenario), scenario, robot)
        return build_adapter(method, robot, body, numbers, scenario, arm=arm, synchronous=self._synchronous)

    def _camera_setup(self, choice: CameraChoice) -> Setup:
        return Setup(self.scenario, tuple(actor.thing for actor in self.stage.actors), choice)

    def _take_finer(self) -> None:
        """Lets a finer body be made, and takes it over when it is there."""
        try:
            fine = self._prepared.finer()
        except RuntimeError as error:
            self._events.tell(self.time, str(error))
            return
        if fine is None:
            return
        self._events.tell(self.time, "finer body taken over")
        recipe = recipe_of(self._method, self._numbers[self._method.name], self.scenario)
        if str(recipe) == USUAL and isinstance(self._adapter, ControllerAdapter):
            self._adapter.set_arm(fine)

    def stop(self) -> None:
        """Ends what runs beside the loop."""
        self._prepared.stop()
        self._camera.stop()

    def _look(self) -> None:
        things = [actor.thing for actor in self.stage.actors]
        self._seen = SeenThings(things, bare=not self._method.controlled)

    def _obstacles(self) -> Obstacles:
        return self._seen.obstacles(self.stage.actors)

    def _poses(self) -> Array:
        return np.array([actor.pose for actor in self.stage.actors]).reshape(-1, 4, 4)


def finite(values: npt.ArrayLike, what: str) -> Array:
    """The values as an array; raises ValueError where one of them is not finite."""
    array = real_array(values, what).copy()
    if not np.isfinite(array).all():
        raise ValueError(f"{what} is {array.tolist()}; allowed: finite numbers")
    return array
