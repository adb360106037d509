"""Two methods side by side: the same scenario by another method, in a process of its own, with the same obstacles."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from sidestep.distance.clearance import Clearance
from sidestep.robot import Robot
from sidestep.studio import messages as m
from sidestep.studio.adapter import NEAR_GOAL
from sidestep.studio.clearance_monitor import ExactClearanceMonitor
from sidestep.studio.scene_obstacle import SceneObstacle, things_of
from sidestep.studio.session_process import Beginning, SessionProcess

MIRRORED = (
    m.SetJointGoal,
    m.SetPoseGoal,
    m.AddObstacle,
    m.ReplaceObstacle,
    m.RemoveObstacle,
    m.DragObstacle,
    m.ThrowObstacle,
    m.SetRunning,
    m.Restart,
)  # what both loops are told


@dataclass
class Tally:
    """What counts of one motion.

    Attributes:
        arrived: simulated time [s] at which the goal was reached first; None: not yet. clearance: the least so far on
        the exact meshes [m]. touched: steps with contact.
    """

    arrived: float | None = None
    clearance: float = np.inf
    touched: int = 0
    time: float = 0.0

    def take(self, snapshot: m.Snapshot) -> None:
        """Takes a state; one before the last begins anew."""
        if snapshot.time < self.time or snapshot.time == 0.0:
            self.arrived, self.clearance = None, np.inf
        self.time, self.touched = snapshot.time, snapshot.touched
        goal = snapshot.goal if snapshot.posture is None else snapshot.posture.q
        if self.arrived is None and goal is not None and np.abs(snapshot.q - goal).max() < NEAR_GOAL:
            self.arrived = snapshot.time


def changes(before: Sequence[SceneObstacle], now: Sequence[SceneObstacle]) -> list[m.Command]:
    """The commands that make obstacles those that there are now."""
    gone: list[m.Command] = [m.RemoveObstacle(thing.name) for thing in before if thing not in now]
    return [*gone, *(m.AddObstacle(thing) for thing in now if thing not in before)]


class Comparison:
    """The loop of the other method, its last state, and what counts of both.

    Args:
        snapshot: of the loop that runs: scenario and goal. method: of the other one.
        report: called with what went wrong in measuring clearances.

    Raises:
        RuntimeError: the process did not start.
    """

    def __init__(
        self, snapshot: m.Snapshot, method: str, robot: Robot, report: Callable[[str, Exception], None]
    ) -> None:
        numbers = {method: snapshot.numbers[method]}
        self.method, self.own, self.other = method, Tally(), Tally()
        self.last: m.Snapshot | None = None
        self.error = ""
        self._robot = robot
        self._lock = threading.Lock()
        self._loop = SessionProcess(Beginning(snapshot.scenario, method, numbers))
        self._truth = ExactClearanceMonitor(self._measured, report)
        for command in changes(things_of(snapshot.scenario), snapshot.things):
            self._loop.send(command)

    def send(self, command: m.Command) -> None:
        """Tells the other loop what the first one is told, where it concerns both."""
        if isinstance(command, MIRRORED):
            self._loop.send(command)

    def look(self, own: m.Snapshot, clearance: float) -> m.Snapshot | None:
        """The other loop's state now; `own`: that of the first one, with its least clearance [m] so far."""
        self.own.take(own)
        self.own.clearance = clearance
        for note in self._loop.take_notes():
            if isinstance(note, m.Failed) and note.refused is None:
                self.error = note.message
        fresh = self._loop.wait(0.0)
        if fresh is not None:
            with self._lock:
                self.other.take(fresh)
            if self.last is None or fresh.edition != self.last.edition:
                self._loop.send(m.Drawn(fresh.edition))
            self.last = fresh
            row = m.Row(fresh.time, fresh.q, fresh.things, fresh.poses, fresh.metric)
            self._truth.look(self._robot, row, 0)
        return self.last

    def stop(self) -> None:
        """Ends the other loop."""
        self._loop.stop()
        self._truth.stop()

    def _measured(self, found: tuple[Clearance, ...], time: float, _: int) -> None:
        with self._lock:
            if found and time <= self.other.time:
                self.other.clearance = min(self.other.clearance, found[0].distance)
