"""How soon something that is gone is cleared, by images that see that it is free."""

from __future__ import annotations

import math

import numpy as np

from sidestep._core import Controller, ControllerSettings
from sidestep.arm import Arm
from sidestep.bench.camera_rig import CameraRig, RigSettings, cameras_around, room
from sidestep.bench.encounters import load_with_meshes
from sidestep.bench.workspace import Workspace
from sidestep.distance import SceneObject

RADIUS = 0.06  # [m] of the ball that comes and goes
GONE_AFTER = 10  # images
MOST_IMAGES = 30  # that are waited for
FREE_BEYOND = 0.02  # [m] around the ball in which an obstacle counts as its own


def clearing_images(robot: str, *, noise: str = "d435", size: str = "848x480", seed: int = 0) -> list[int]:
    """Numbers of obstacles within a ball in free space, by image, from the first image without the ball on.

    An arm at rest and a camera; the ball is beside the arm in full view, and gone from one image to the next.
    """
    arm, meshes = load_with_meshes(robot)
    settings = RigSettings((math.radians(40.0),), size, latency=0.0, noise=noise)
    space = Workspace.of(meshes)
    place = space.shoulder + space.reach * np.array([0.55, 0.55, 0.1])
    period = 1.0 / settings.rate
    ball = SceneObject.ball(
        "ball", place, radius=RADIUS, motion="moving", present=(0.0, (GONE_AFTER - 0.5) * period)
    )
    base = meshes.pose(meshes.neutral, meshes.links[0].name)[:3, 3]
    counts: list[int] = []
    with CameraRig(
        meshes,
        (ball, *room(base, space.reach)),
        cameras_around(meshes, settings),
        settings,
        seed=seed,
    ) as rig:
        controller = _resting(arm, meshes.neutral)
        rig.start(controller)
        for image in range(GONE_AFTER + MOST_IMAGES):
            now = image * period
            controller.step(meshes.neutral, np.zeros_like(meshes.neutral), time=now)
            rig.see(now, meshes.neutral)
            assert rig.perception is not None
            centres = np.asarray(rig.perception.cells()["centres"]).reshape(-1, 3)
            near = int((np.linalg.norm(centres - place, axis=1) < RADIUS + FREE_BEYOND).sum())
            if image >= GONE_AFTER - 1:
                counts.append(near)
            if image >= GONE_AFTER and near == 0:
                break
    return counts


def _resting(arm: Arm, q: np.ndarray) -> Controller:
    controller = Controller(arm, ControllerSettings(synchronous=True, output="acceleration"))
    controller.set_goal(q)
    return controller
