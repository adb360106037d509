"""What is true about the scene, on the exact meshes: clearances for colours, lines and plots. Not for control."""

from __future__ import annotations

import threading
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from sidestep.distance import ExactClearance
from sidestep.distance.clearance import Clearance
from sidestep.math.pose import pose_vector
from sidestep.robot import Robot
from sidestep.studio.messages import Row
from sidestep.studio.scene_obstacle import SceneObstacle

Array = npt.NDArray[np.float64]


class ExactClearanceMonitor:
    """Measures the clearance of every link, in a thread of its own: the latest state is taken, others are dropped.

    Args:
        tell: called with the clearances of the links, nearest first, the time [s] they belong to, and the epoch.
        report: called with what went wrong, after which the thread goes on with the next state.
    """

    def __init__(
        self,
        tell: Callable[[tuple[Clearance, ...], float, int], None],
        report: Callable[[str, Exception], None],
    ) -> None:
        self._tell, self._report = tell, report
        self._wake = threading.Condition()
        self._next: tuple[Robot, Row, int] | None = None
        self._stopping = False
        self._robot: Robot | None = None
        self._things: tuple[SceneObstacle, ...] | None = None
        self._exact: ExactClearance | None = None
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def look(self, robot: Robot, row: Row, epoch: int) -> None:
        """Asks for the clearances of an arm at a moment; `epoch` is handed on."""
        with self._wake:
            self._next = robot, row, epoch
            self._wake.notify()

    def stop(self) -> None:
        """Ends the thread."""
        with self._wake:
            self._stopping = True
            self._wake.notify()
        self._thread.join(timeout=2.0)

    def _run(self) -> None:
        while True:
            with self._wake:
                while self._next is None and not self._stopping:
                    self._wake.wait()
                if self._stopping:
                    return
                assert self._next is not None
                robot, row, epoch = self._next
                self._next = None
            try:
                found = self._measure(robot, row.things, row.q, row.poses)
                self._tell(tuple(sorted(found, key=lambda item: item.distance)), row.time, epoch)
            except Exception as error:
                self._exact = None  # may be half made
                self._report("measuring clearances failed", error)

    def _measure(
        self, robot: Robot, things: tuple[SceneObstacle, ...], q: Array, poses: Array
    ) -> tuple[Clearance, ...]:
        if not things:
            return ()
        if robot is not self._robot or self._exact is None:
            self._exact, self._robot, self._things = ExactClearance(robot, ()), robot, None
        if things != self._things:
            self._exact = self._exact.among([solid for thing in things for solid in thing.solids])
            self._things = things
        return self._exact.of_links(q, solid_poses(things, poses))


def solid_poses(things: tuple[SceneObstacle, ...], poses: Array) -> Array:
    """Positions and quaternions (num_solids, 7) of what things at poses (N, 4, 4) are made of."""
    vectors = []
    for thing, pose in zip(things, poses, strict=True):
        rows = np.tile(pose_vector(pose), (len(thing.offsets), 1))
        rows[:, :3] += thing.offsets @ pose[:3, :3].T
        vectors.append(rows)
    return np.concatenate(vectors) if vectors else np.zeros((0, 7))
