"""The depth camera of a session: on or off, and what its controller knows then."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from sidestep.studio.adapter import Adapter, ControllerAdapter
from sidestep.studio.camera_choice import CameraChoice
from sidestep.studio.camera_process import Pose, Setup
from sidestep.studio.camera_watch import CameraWatch, Shot
from sidestep.studio.sight import CameraState

Array = npt.NDArray[np.float64]

MOVES = 0.05  # [m/s] from which on an obstacle that was seen counts as moving


class SessionCamera:
    """Off at first.

    Args:
        setup: of what there is now, for a choice. synchronous: see `CameraWatch`.
    """

    def __init__(self, setup: Callable[[CameraChoice], Setup], *, synchronous: bool) -> None:
        self._setup, self._synchronous = setup, synchronous
        self.choice: CameraChoice | None = None
        self.error = ""
        self._watch: CameraWatch | None = None

    def set(self, choice: CameraChoice | None, adapter: Adapter) -> None:
        """Switches it on or off, or changes it.

        The session needs a new adapter then: to one that knew obstacles, what it no longer hears of would be free.

        Raises:
            ValueError: this method has no obstacles of a camera.
        """
        if choice is not None and not isinstance(adapter, ControllerAdapter):
            raise ValueError("a depth camera needs the controller; choose it under Advanced, Method")
        self.error = ""
        if choice is None:
            self.stop()
        elif self._watch is None:
            self._watch = CameraWatch(self._setup(choice), synchronous=self._synchronous)
        else:
            self._watch.set_up(self._setup(choice))
        self.choice = choice

    def tell(self, adapter: Adapter) -> None:
        """Tells a new adapter whether the scene is known to it."""
        if isinstance(adapter, ControllerAdapter):
            adapter.set_known(
                scene=self.choice is None or not self.choice.only, camera=self.choice is not None
            )
        elif self.choice is not None:
            self.stop()
            self.error = "this method has no camera"

    def renew(self) -> None:
        """The scene is another one."""
        if self._watch is not None and self.choice is not None:
            self._watch.set_up(self._setup(self.choice))

    def step(self, adapter: Adapter, q: Array, poses: Callable[[], Array]) -> bool:
        """After a step at q (nv,): takes an image if one is due, things at poses (N, 4, 4).

        Returns False where the camera has failed and is off now: the session needs a new adapter.
        """
        if self._watch is None or not isinstance(adapter, ControllerAdapter):
            return True
        if self._watch.error:
            error = self._watch.error
            self.stop()
            self.error = error
            return False
        if self._watch.is_due(adapter.controller, adapter.time):
            self._watch.shoot(Shot(adapter.controller, adapter.time, Pose(q.copy(), poses())))
        return True

    def state(self, adapter: Adapter) -> CameraState:
        """For the page."""
        watch = self._watch
        if watch is None or self.choice is None or not isinstance(adapter, ControllerAdapter):
            return CameraState(error=self.error)
        sight, seen = watch.sight, adapter.controller.obstacles
        speeds = np.linalg.norm(seen.velocities, axis=1)
        moves = speeds > MOVES
        return CameraState(
            self.choice,
            sight=sight,
            age=0.0 if sight is None else max(0.0, adapter.time - sight.time),
            lost=watch.lost,
            moving=np.column_stack([seen.points[moves], seen.radii[moves]]),
            speeds=speeds[moves],
        )

    def stop(self) -> None:
        """Switches it off, and ends what runs beside the loop."""
        self.choice = None
        if self._watch is not None:
            self._watch.stop()
            self._watch = None
