"""An ideal arm that is served, for the tests of links."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import sidestep as ss
from sidestep.drivers import Ideal
from sidestep.link import Server
from sidestep.loop import Loop, LoopSettings
from sidestep.perception import DepthCamera, Perception


@dataclass
class Served:
    """A controller whose loop runs, and its server."""

    controller: ss.Controller
    server: Server
    loop: Loop

    @property
    def address(self) -> str:
        return self.server.address


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    arm = ss.Arm.load("planar3")
    controller = ss.Controller(arm, ss.ControllerSettings(output="position"))
    controller.set_obstacles(ss.Obstacles.none())
    camera = DepthCamera("front", width=4, height=3, fx=4.0, fy=4.0, cx=1.5, cy=1.0, pose=np.eye(4))
    perception = Perception(controller, [camera])
    controller.remove_obstacles("front")  # the arm does not wait for it: few tests send images
    server = Server(controller, str(tmp_path / "arm.sock"), perception=perception)
    settings = LoopSettings(priority=0, lock_memory=False, longest_gap=10.0, state_timeout=10.0)
    loop = Loop(controller, Ideal(arm), settings, observers=[server])
    loop.start()
    server.run_began()
    yield Served(controller, server, loop)
    loop.stop()
    loop.finish()
