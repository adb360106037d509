"""Simulated depth cameras around an arm, and the perception that their images feed."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from sidestep._core import (
    Controller,
    DepthCamera,
    DepthNoise,
    Perception,
    PerceptionReport,
    PerceptionSettings,
)
from sidestep.bench.camera_scene import as_collision_meshes
from sidestep.bench.workspace import Workspace
from sidestep.distance import SceneObject
from sidestep.math.pose import look_at
from sidestep.robot import Robot
from sidestep.shapes import Box

if TYPE_CHECKING:
    from sidestep.simulation.depth_camera import SimulatedImage

Array = npt.NDArray[np.float64]
Watch = Callable[["SimulatedImage"], None]

SIZES = {"848x480": (848, 480), "424x240": (424, 240)}
FIELD_OF_VIEW = math.radians(87.0)  # of a D435, horizontally
BASELINE, DISPARITY_ERROR = 0.05, 0.08  # [m] and [pixel] of a D435
AWAY, ABOVE = 1.2, 0.7  # of a camera from the shoulder, in reaches of the arm
ROOM, FLOOR = 3.0, 1.4  # of walls and floor from the base, in reaches of the arm: seen, and out of its way
WALL = 0.1  # [m] thickness of walls
SENSOR_RANGE = (
    10.0  # [m] up to which images have depths, of which cameras believe those within their own range
)
IMAGES_VALID = 5.0  # periods for which an image may be the last one, beyond its latency


@dataclass(frozen=True)
class RigSettings:
    """How a rig sees.

    Attributes:
        azimuths: of the cameras around the vertical through the shoulder [rad]. size: of the images, of `SIZES`.
        rate: of the images [Hz]. latency: until they come [s]. lost: share of them that never come.
        noise: name of a noise model. unseen_is_free: see `PerceptionSettings`.
        exact_poses: Perception is told that poses have no error, which is so; else the bounds of `DepthCamera`.

    Raises:
        ValueError: an unknown size, no camera, or a number out of range.
    """

    azimuths: tuple[float, ...]
    size: str = "424x240"
    rate: float = 30.0
    latency: float = 0.05
    lost: float = 0.0
    noise: str = "d435"
    unseen_is_free: bool = True
    exact_poses: bool = False

    def __post_init__(self) -> None:
        if self.size not in SIZES:
            raise ValueError(f"size is {self.size!r}, allowed: {', '.join(SIZES)}")
        if not self.azimuths:
            raise ValueError("there is no camera: azimuths must not be empty")
        if not (np.isfinite(self.rate) and 0.0 < self.rate <= 1000.0):
            raise ValueError(f"rate is {self.rate} Hz, allowed: above 0 to 1000")

    @property
    def valid_for(self) -> float:
        """Age up to which an image is believed [s]: a quarter of a second, or a few periods where they are long."""
        return max(0.25, self.latency + IMAGES_VALID / self.rate)


def room(base: Array, reach: float) -> tuple[SceneObject, ...]:
    """Floor and walls around a base (3,) of an arm with a reach [m], which are seen and which it cannot touch."""
    side, far = 2.0 * ROOM * reach, ROOM * reach
    found = [SceneObject.from_shape("floor", Box((side, side, WALL), _at(base, (0.0, 0.0, -FLOOR * reach))))]
    for name, x, y in (("front", 1, 0), ("back", -1, 0), ("left", 0, 1), ("right", 0, -1)):
        lengths = (WALL, side, side) if x else (side, WALL, side)
        found.append(SceneObject.from_shape(f"wall_{name}", Box(lengths, _at(base, (x * far, y * far, 0.0)))))
    return tuple(found)


def _at(base: Array, offset: tuple[float, float, float]) -> Array:
    pose = np.eye(4)
    pose[:3, 3] = base + np.array(offset)
    return pose


def cameras_around(
    robot: Robot, settings: RigSettings, *, target: Array | None = None, far: float | None = None
) -> list[DepthCamera]:
    """The cameras of a rig, which look at a target (3,) [m], by default the shoulder of the arm.

    Their range ends at `far` [m], by default where the arm cannot reach: images show more, see `SENSOR_RANGE`.
    """
    space = Workspace.of(robot)
    width, height = SIZES[settings.size]
    focal = 0.5 * width / math.tan(0.5 * FIELD_OF_VIEW)
    cameras = []
    for number, azimuth in enumerate(settings.azimuths):
        out = np.array([AWAY * math.cos(azimuth), AWAY * math.sin(azimuth), ABOVE])
        eye = space.shoulder + space.reach * out
        cameras.append(
            DepthCamera(
                f"camera_{number}",
                width=width,
                height=height,
                fx=focal,
                fy=focal,
                cx=0.5 * (width - 1),
                cy=0.5 * (height - 1),
                pose=look_at(eye, space.shoulder if target is None else target),
                far=float(np.linalg.norm(eye - space.shoulder)) + space.reach if far is None else far,
                noise=DepthNoise(0.001, DISPARITY_ERROR / (focal * BASELINE)),
            )
        )
    if settings.exact_poses:
        cameras = [camera.replace(translation_error=0.0, rotation_error=0.0) for camera in cameras]
    return cameras


def cameras_like(cameras: Sequence[DepthCamera], *, far: float) -> list[DepthCamera]:
    """Cameras with another range [m]."""
    return [camera.replace(far=far) for camera in cameras]


class CameraRig:
    """Cameras that see an arm among solids at simulated times, and hand what they see to a controller, late.

    The cameras take turns: their images are spread over the period.

    Args:
        robot: the arm. objects: that are seen. cameras: see `cameras_around`. settings: how.
        seed: of noise and lost images. watch: told of every image that is captured and not lost.
        hidden: name of an object that images do not show in `hidden_during` (from, until) [s], as where a sensor sees
            through it.
    """

    def __init__(
        self,
        robot: Robot,
        objects: Sequence[SceneObject],
        cameras: Sequence[DepthCamera],
        settings: RigSettings,
        *,
        seed: int = 0,
        watch: Watch | None = None,
        hidden: str = "",
        hidden_during: tuple[float, float] = (math.inf, math.inf),
    ) -> None:
        import mujoco

        from sidestep.simulation.depth_camera import SimulatedCamera
        from sidestep.simulation.model import build_model

        self.cameras, self.settings, self.objects = list(cameras), settings, tuple(objects)
        self.built = build_model(as_collision_meshes(robot), self.objects)
        self._data = mujoco.MjData(self.built.model)
        ids = self.built.model.body_mocapid[list(self.built.object_bodies)]
        self._moving = [
            (item, mocap) for item, mocap in zip(self.objects, ids, strict=True) if item.motion == "moving"
        ]
        sensors = cameras_like(self.cameras, far=SENSOR_RANGE)
        self._eyes = [
            SimulatedCamera(
                self.built,
                sensor,
                noise=settings.noise,
                latency=settings.latency,
                lost=settings.lost,
                seed=seed * len(self.cameras) + number,
            )
            for number, sensor in enumerate(sensors)
        ]
        self._taken = [0] * len(self._eyes)
        self._watch, self._hidden, self._hidden_during = watch, hidden, hidden_during
        self.perception: Perception | None = None
        self.reports: list[tuple[float, str, PerceptionReport]] = []

    def start(self, controller: Controller) -> None:
        """Hands what is seen from now on to a controller."""
        settings = PerceptionSettings(
            unseen_is_free=self.settings.unseen_is_free, valid_for=self.settings.valid_for
        )
        self.perception = Perception(controller, self.cameras, settings)

    def see(self, now: float, q: Array) -> None:
        """Captures what is due at a time [s] with the arm at q (nv,), and hands over what arrives.

        Raises:
            RuntimeError: `start` was not called.
        """
        if self.perception is None:
            raise RuntimeError("see: the rig has no controller; call start first")
        for number, eye in enumerate(self._eyes):
            due = (self._taken[number] + number / len(self._eyes)) / self.settings.rate
            if now + 1e-9 >= due:
                self._taken[number] += 1
                self._pose(now, q)
                image = eye.capture(self._data, now)
                if image is not None and self._watch is not None:
                    self._watch(image)
            for image in eye.delivered(now):
                report = self.perception.update(image.camera, image.depth, time=image.time)
                self.reports.append((now, image.camera, report))

    def close(self) -> None:
        """Gives back what OpenGL holds."""
        for eye in self._eyes:
            eye.close()

    def __enter__(self) -> CameraRig:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _pose(self, now: float, q: Array) -> None:
        self.built.set_state(self._data, q, np.zeros_like(q))
        for item, mocap in self._moving:
            place = item.pose_at(now)[:3, 3].copy()
            if item.name == self._hidden and self._hidden_during[0] < now < self._hidden_during[1]:
                place[2] -= 100.0  # beyond what is drawn
            self._data.mocap_pos[mocap] = place
