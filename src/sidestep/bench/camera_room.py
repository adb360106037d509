"""A room that three depth cameras look at while an arm moves in it: images that are rendered once and replayed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from sidestep.arm import Arm
from sidestep.math.pose import look_at
from sidestep.obstacles import Box, Cylinder, Shape, Sphere
from sidestep.perception import DepthCamera, Frame

Array = npt.NDArray[np.float64]

WIDTH, HEIGHT = 848, 480  # [pixel]
FOCAL = 425.0  # [pixel] of a D435 at this width
IMAGE_PERIOD = 1.0 / 30.0  # [s]
SWING = 0.25  # [rad or m] of each joint to both sides of where it stands
WAYS = (1, 1, 2, 1, 2, 1, 2)  # swings of each joint while the images are gone through once
LOOKS = {  # [m] where each camera is, and what it looks at
    "front": ((1.5, 0.25, 1.15), (0.35, 0.0, 0.25)),
    "left": ((0.3, 1.55, 1.05), (0.4, 0.0, 0.25)),
    "right": ((0.35, -1.5, 1.2), (0.4, 0.1, 0.2)),
}


@dataclass(frozen=True, eq=False)
class CameraImages:
    """What a camera saw in one swing of the arm.

    Attributes:
        camera: its geometry. frames: in order, each with the arm's q; the first follows the last one period later.
    """

    camera: DepthCamera
    frames: tuple[Frame, ...]

    def __post_init__(self) -> None:
        if not self.frames:
            raise ValueError(f"camera {self.camera.name!r}: there are no frames, allowed: one or more")

    def at(self, number: int) -> Frame:
        """Image `number` of the endless replay, with the time number / 30 Hz [s]."""
        return replace(self.frames[number % len(self.frames)], time=number * IMAGE_PERIOD)


def room() -> list[Shape]:
    """Floor and two walls, a table with boxes, a bottle, a bowl and a shelf."""
    boxes = {  # size and centre [m], the base of the arm at 0
        "floor": ((6.0, 6.0, 0.1), (0.0, 0.0, -0.75)),
        "back": ((0.1, 6.0, 3.2), (-1.6, 0.0, 0.8)),
        "side": ((6.0, 0.1, 3.2), (0.0, -2.2, 0.8)),
        "table": ((1.5, 1.6, 0.05), (0.3, 0.0, -0.025)),
        "crate": ((0.3, 0.2, 0.18), (0.55, -0.4, 0.09)),
        "carton": ((0.15, 0.25, 0.30), (0.75, 0.35, 0.15)),
        "book": ((0.22, 0.16, 0.04), (0.5, 0.45, 0.02)),
        "shelf": ((0.3, 1.0, 0.03), (-0.5, 0.1, 0.75)),
    }
    shapes: list[Shape] = [Box(size, pose=_at(place), name=name) for name, (size, place) in boxes.items()]
    shapes.append(Cylinder(0.04, 0.25, pose=_at((0.65, 0.1, 0.125)), name="bottle"))
    shapes.append(Sphere(0.09, pose=_at((0.8, -0.1, 0.09)), name="bowl"))
    return shapes


def cameras(*, width: int = WIDTH, height: int = HEIGHT) -> list[DepthCamera]:
    """The three cameras, with the field of view of a D435."""
    scale = width / WIDTH
    return [
        DepthCamera(
            name,
            width=width,
            height=height,
            fx=FOCAL * scale,
            fy=FOCAL * scale,
            cx=0.5 * (width - 1),
            cy=0.5 * (height - 1),
            pose=look_at(place, target),
        )
        for name, (place, target) in LOOKS.items()
    ]


def swing(arm: Arm, number: int, images: int) -> Array:
    """q (nv,) at image `number` of a periodic motion around the neutral pose, within the limits."""
    ways = np.resize(WAYS, arm.num_coordinates)
    phase = np.arange(arm.num_coordinates)
    q = arm.neutral + SWING * np.sin(2.0 * np.pi * ways * number / images + phase)
    limits = arm.robot.limits
    return np.clip(q, limits.lower, limits.upper)


def render_images(
    arm: Arm, *, images: int, width: int = WIDTH, height: int = HEIGHT, seed: int = 0
) -> list[CameraImages]:
    """What the three cameras see in one swing, with the noise of a D435, as whole millimetres.

    Raises:
        RuntimeError: OpenGL cannot start; says what to install.
    """
    import mujoco

    from sidestep.robot import Robot
    from sidestep.simulation import SimulatedCamera, build_model

    robot = arm.robot
    if not isinstance(robot, Robot):
        raise TypeError(
            f"robot {robot.name!r} has no meshes that a camera could see; allowed: an arm of a description"
        )
    model = build_model(robot, room())
    data = mujoco.MjData(model.model)
    seen = []
    for camera in cameras(width=width, height=height):
        frames = []
        with SimulatedCamera(model, camera, noise="d435", seed=seed) as simulated:
            for number in range(images):
                q = swing(arm, number, images)
                model.set_state(data, q, np.zeros_like(q))
                image = simulated.capture(data, number * IMAGE_PERIOD)
                assert image is not None  # none is lost
                depth = np.round(1000.0 * image.depth).astype(np.uint16)
                frames.append(Frame(camera.name, number * IMAGE_PERIOD, depth, 0.001, q))
        seen.append(CameraImages(camera, tuple(frames)))
    return seen


def _at(place: tuple[float, float, float]) -> Array:
    X = np.eye(4)
    X[:3, 3] = place
    return X
