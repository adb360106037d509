"""A session of an arm that another program serves: the page shows it, and sends goals and obstacles."""

from __future__ import annotations

import contextlib
import math
import time as clock
from collections import deque
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import PoseGoal
from sidestep.link import connect
from sidestep.robot import Robot, tip_of
from sidestep.scenario import Scenario
from sidestep.scenario.assembly import load_robot
from sidestep.simulation.pose_target import IkSolution
from sidestep.simulation.run import status_name
from sidestep.studio import messages as m
from sidestep.studio.methods import METHODS
from sidestep.studio.reason import EVENTS, Reason
from sidestep.studio.seen_things import SeenThings
from sidestep.studio.sight import CameraState
from sidestep.studio.simulated_scene import MovableObstacle

Array = npt.NDArray[np.float64]

FIRST_STATE = 5.0  # [s] to wait for it
PERIOD = 1.0 / 60.0  # [s] between two looks at the arm
SOURCE = "studio"  # of the obstacles that the page adds
MOVING_VALID = (
    1.0  # [s] for which an obstacle that moves is believed: told anew each step, unless the page is gone
)
EXPLAIN_PERIOD = 0.25  # [s] between two explanations
CONTROLLER = "controller"


class ServedSession:
    """What the page shows of a served arm, in place of a `Session`.

    The arm is moved by the program that serves it. Goals need the command, which is taken with the first one; obstacles
    of the page are the source "studio". Methods, numbers and scenarios belong to the other program.

    Args:
        scenario: with the robot that is served; its obstacles are shown and not sent.
        address, token: see `sidestep.connect`.

    Raises:
        ConnectionError: nobody serves there. ValueError: the served arm has other joints.
    """

    def __init__(self, scenario: Scenario, address: str | None, token: str | None) -> None:
        self.scenario = scenario
        self.robot: Robot = load_robot(scenario)
        self.period, self.running, self.edition, self.time = PERIOD, True, 0, 0.0
        self._begin = clock.monotonic()
        self._words, self._explained = "", -EXPLAIN_PERIOD
        self._events: deque[tuple[float, str]] = deque(maxlen=EVENTS)
        self._rows: list[m.Row] = []
        self._recording = False
        self._client: Any = connect(address, token, name="studio", rate=1.0 / PERIOD)
        try:
            self._cycle = self._first_cycle()
            self._goal: tuple[Array | None, Array] = (
                None,
                self._q,
            )  # nothing is sent before somebody sets one
            self._actors: list[MovableObstacle] = []
            self._set_actors([])
        except BaseException:
            self._client.close()
            raise

    def _first_cycle(self) -> Any:
        if list(self._client.joints) != list(self.robot.coordinate_names):
            raise ValueError(
                f"the served arm '{self._client.arm}' has the joints {', '.join(self._client.joints)}; the robot shown "
                f"has {', '.join(self.robot.coordinate_names)}: name the served one by --robot"
            )
        first = self._client.next_cycle(timeout=FIRST_STATE)
        if first is None:
            raise ConnectionError(
                f"the server of '{self._client.arm}' sent no state for {FIRST_STATE:g} s: does a run go on?"
            )
        return first

    def handle(self, command: m.Command) -> None:
        """Does what a command says.

        Raises:
            ValueError: the server refuses it, or it is not for an attached page.
        """
        match command:
            case m.SetJointGoal(position):
                self._send_goal(None, self.robot.check_configuration(position, "goal"))
            case m.SetPoseGoal(pose):
                self._send_goal(np.array(pose), self._goal[1])
            case m.AddObstacle(thing):
                self._set_actors([*self._actors, MovableObstacle(thing)])
            case m.ReplaceObstacle(thing):
                old = self._actor(thing.name)
                new = MovableObstacle(thing.at(old.pose))
                self._set_actors([new if actor is old else actor for actor in self._actors])
            case m.RemoveObstacle(name):
                gone = self._actor(name)
                self._set_actors([actor for actor in self._actors if actor is not gone])
            case m.DragObstacle(name, pose):
                actor = self._actor(name)
                actor.target, actor.touched = (None if pose is None else np.array(pose)), True
                actor.velocity = np.zeros(3) if pose is None else actor.velocity
                self._tell()
            case m.ThrowObstacle(name, velocity):
                actor = self._actor(name)
                actor.target, actor.touched, actor.velocity = None, True, np.array(velocity, dtype=float)
                self._tell()
            case m.SetRunning(running):
                if running:
                    self.running = True  # also after a failure, which stopped the page
                    self._take_command()
                    self._client.resume()
                else:
                    self._client.pause()
            case m.Restart():
                self.running = True
                self._take_command()
                self._client.restart()
            case m.SetRecording(recording):
                self._recording = recording
                self._rows.clear()
            case m.Seen() | m.Drawn():
                return
            case _:
                raise ValueError(
                    f"{type(command).__name__} is not for this page: it shows an arm that another program moves"
                )

    def step(self) -> None:
        """Takes the newest state, and tells where obstacles are that move."""
        self._cycle = self._client.cycle()
        self.time = clock.monotonic() - self._begin
        moves = any(moving(actor) for actor in self._actors)
        for actor in self._actors:
            actor.advance(PERIOD)
        if moves:  # and once more where it has come to rest
            self._tell()
        for notice in self._client.notices():
            self._events.append((self.time, str(notice)))
        if self.time - self._explained > EXPLAIN_PERIOD:
            self._explained = self.time
            try:
                self._words = self._client.explain()
            except ConnectionError as error:  # a busy server; where it is gone, the next cycle says so
                self._words = str(error)
        if self._recording:
            self._rows.append(m.Row(self.time, self._q, self._seen.things, self._poses(), self._metric))

    def snapshot(self, *, real_time: float = 0.0) -> m.Snapshot:
        """The state now, and the rows recorded since the last snapshot."""
        command, limits = self._cycle.command, self.robot.limits
        v = np.array(self._cycle.state.v)
        rows, self._rows = tuple(self._rows), []
        pose, near = self._goal
        return m.Snapshot(
            scenario=self.scenario,
            edition=self.edition,
            time=self.time,
            running=self.running,
            q=self._q,
            v=v,
            goal=near if pose is None else None,
            goal_pose=pose,
            posture=IkSolution(near) if pose is None else None,
            goal_written=False,
            draft=False,
            refining="",
            visited=(),
            tip=tip_of(self.robot),
            things=self._seen.things,
            poses=self._poses(),
            velocities=np.array([actor.velocity for actor in self._actors]).reshape(-1, 3),
            courses=tuple(actor.course for actor in self._actors),
            method=CONTROLLER,
            numbers={name: dict(method.defaults) for name, method in METHODS.items()},
            words=self._words,
            status=f"{status_name(command.status)}, {status_name(command.activity)}",
            activity=status_name(command.activity),
            nearest=("", command.clearance),
            values=np.zeros(0),
            metric=self._metric,
            activations=np.zeros(0),
            reason=Reason(),
            events=tuple(self._events),
            torque_share=float((np.abs(command.torque) / limits.effort).max()),
            speed_share=float((np.abs(v) / limits.velocity).max()),
            contacts=(),
            touched=0,
            timing=m.Timing(real_time=real_time),
            recording=self._recording,
            camera=CameraState(),
            rows=rows,
            attached=True,
        )

    def stop(self) -> None:
        """Leaves the arm to others: its goal is cleared if this page was in command, and the page's obstacles go."""
        if self._actors:
            with contextlib.suppress(OSError, ValueError):  # the server is gone, or refuses
                self._client.remove_obstacles(SOURCE)
        self._client.close()

    @property
    def _q(self) -> Array:
        return np.array(self._cycle.state.q)

    @property
    def _metric(self) -> Array:
        return np.eye(self.robot.num_coordinates)

    def _actor(self, name: str) -> MovableObstacle:
        for actor in self._actors:
            if actor.thing.name == name:
                return actor
        known = ", ".join(actor.thing.name for actor in self._actors) or "none"
        raise ValueError(f"there is no obstacle {name!r} of this page; there are: {known}")

    def _take_command(self) -> None:
        if not self._client.in_command:
            self._client.take_command()

    def _send_goal(self, pose: Array | None, near: Array) -> None:
        self._take_command()
        tip = tip_of(self.robot)
        self._client.set_goal(near if pose is None else PoseGoal(self.robot, tip, pose))
        self._goal = pose, near
        self._events.append((self.time, "new goal"))

    def _set_actors(self, actors: list[MovableObstacle]) -> None:
        names = [actor.thing.name for actor in actors]
        if len(set(names)) < len(names):
            raise ValueError(f"two obstacles have one name: {', '.join(names)}")
        before, self._actors = self._actors, actors
        self._seen = SeenThings([actor.thing for actor in actors], bare=False)
        self.edition += 1
        if actors:
            self._tell()
        elif before:
            self._client.remove_obstacles(SOURCE)

    def _tell(self) -> None:
        moves = any(moving(actor) for actor in self._actors)
        self._client.set_obstacles(
            self._seen.obstacles(self._actors), source=SOURCE, valid_for=MOVING_VALID if moves else math.inf
        )

    def _poses(self) -> Array:
        return np.array([actor.pose for actor in self._actors]).reshape(-1, 4, 4)


def moving(actor: MovableObstacle) -> bool:
    """Whether an obstacle moves, or is about to."""
    return actor.target is not None or bool(np.any(actor.velocity))
