"""A depth camera's images of the simulated scene, from a process of its own, beside the loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep.scenario import Scenario
from sidestep.studio.camera_choice import CameraChoice
from sidestep.studio.process_link import start_process
from sidestep.studio.scene_obstacle import SceneObstacle

Array = npt.NDArray[np.float64]
Depth = npt.NDArray[np.float32]

RENDERER = "sidestep.studio.camera_renderer"
ONE_THREAD = {
    "LP_NUM_THREADS": "1"
}  # of Mesa's renderer without a graphics card, which takes all processors else


@dataclass(frozen=True, eq=False)
class Setup:
    """What is rendered: the robot of a scenario among things, from a camera."""

    scenario: Scenario
    things: tuple[SceneObstacle, ...]
    choice: CameraChoice


@dataclass(frozen=True, eq=False)
class Pose:
    """Where everything is: the arm at q (nv,), the things at poses (N, 4, 4)."""

    q: Array
    poses: Array


@dataclass(frozen=True, eq=False)
class Picture:
    """Depth (H, W) [m], 0: nothing measured; pose (4, 4) of the camera in the world; what it took [s]."""

    depth: Depth
    pose: Array
    duration: float


class CameraProcess:
    """The end of who wants images. Raises RuntimeError where the process does not start."""

    def __init__(self) -> None:
        self._process, self._connection = start_process(RENDERER, ONE_THREAD)

    def set_up(self, setup: Setup) -> None:
        """Prepares scene and camera, which takes seconds.

        Raises:
            RuntimeError: it cannot; says why, and of OpenGL what to install.
        """
        self._ask(setup)

    def take(self, pose: Pose) -> Picture:
        """An image; raises RuntimeError where it cannot be rendered."""
        picture = self._ask(pose)
        assert isinstance(picture, Picture)
        return picture

    def stop(self) -> None:
        """Ends the process, at once: who waits for an image gets an error. Again does nothing."""
        self._process.kill()
        self._process.wait()
        assert self._process.stdin is not None
        self._process.stdin.close()

    def _ask(self, what: Setup | Pose) -> Any:
        try:
            self._connection.send(what)
            answer = self._connection.recv()
        except (EOFError, OSError) as error:
            raise RuntimeError("the process that renders the camera's images has ended") from error
        if isinstance(answer, str):
            raise RuntimeError(answer)
        return answer
