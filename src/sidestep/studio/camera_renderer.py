"""Renders the images of a depth camera of the studio.

python -m sidestep.studio.camera_renderer ADDRESS      (started by `CameraProcess`; the key comes on stdin)
"""

from __future__ import annotations

import contextlib
import dataclasses
import os
import pickle
import time as clock
from multiprocessing.connection import Connection
from typing import Any

import mujoco
import numpy as np

from sidestep.math.pose import pose_vector
from sidestep.scenario.assembly import load_robot
from sidestep.simulation.depth_camera import SimulatedCamera
from sidestep.simulation.model import build_model
from sidestep.studio.camera_choice import noise_of
from sidestep.studio.camera_process import Picture, Pose, Setup
from sidestep.studio.process_link import connect_to_parent
from sidestep.studio.scene_obstacle import SceneObstacle

WALLS = 10.0  # [m] away is what is behind all: a room has walls, and rays that see nothing would tell nothing
POLITE = 5  # niceness: rendering without a graphics card leaves the processor to the loop


class Renderer:
    """The scene in MuJoCo, and the camera in it."""

    def __init__(self) -> None:
        self._things: tuple[SceneObstacle, ...] = ()
        self._content = b""
        self._camera: SimulatedCamera | None = None
        self._count = 0

    def set_up(self, setup: Setup) -> None:
        """Another scene or camera; a scene that has not changed is not built again."""
        if self._camera is not None:
            self._camera.close()
        content = pickle.dumps((setup.scenario.robot, setup.scenario.folder, setup.things))
        if content != self._content:
            self._robot = load_robot(setup.scenario)
            solids = [
                dataclasses.replace(solid, motion="moving")
                for thing in setup.things
                for solid in thing.solids
            ]
            self._built = build_model(self._robot, solids)
            self._data = mujoco.MjData(self._built.model)
            self._mocap = self._built.model.body_mocapid[list(self._built.object_bodies)]
            self._things, self._content = setup.things, content
        self._camera = SimulatedCamera(self._built, setup.choice.camera, noise=noise_of(setup.choice.noise))

    def take(self, pose: Pose) -> Picture:
        """An image."""
        begin = clock.perf_counter()
        self._built.set_state(self._data, pose.q, np.zeros(len(pose.q)))
        row = 0
        for thing, at in zip(self._things, pose.poses, strict=True):
            vector = pose_vector(at)
            places = self._mocap[row : row + len(thing.offsets)]
            self._data.mocap_pos[places] = thing.offsets @ at[:3, :3].T + at[:3, 3]
            self._data.mocap_quat[places] = vector[3:]
            row += len(thing.offsets)
        if self._camera is None:
            raise RuntimeError("there is no camera")
        self._count += 1
        image = self._camera.capture(self._data, float(self._count))  # numbers for times: they only grow
        assert image is not None
        self._camera.delivered(np.inf)  # the latency is waited for where the images go to
        image.depth[image.true_depth == 0.0] = WALLS
        return Picture(image.depth, image.pose, clock.perf_counter() - begin)


def serve(connection: Connection[Any, Any]) -> None:
    """Answers until the other end hangs up."""
    renderer = Renderer()
    while True:
        asked = connection.recv()
        try:
            answer = None
            if isinstance(asked, Setup):
                renderer.set_up(asked)
            else:
                answer = renderer.take(asked)
        except Exception as error:  # OpenGL's, MuJoCo's and those of files: the other end says it
            connection.send(str(error) or type(error).__name__)
        else:
            connection.send(answer)


def main() -> None:
    """Entry point of the process."""
    if hasattr(os, "nice"):
        os.nice(POLITE)
    with contextlib.suppress(EOFError, OSError, KeyboardInterrupt):  # who started it has ended
        serve(connect_to_parent())


if __name__ == "__main__":
    main()
