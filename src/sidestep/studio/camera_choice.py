"""A depth camera of the studio's simulation: where it is, how good, how fast, and what else is known."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sidestep.math.pose import look_at
from sidestep.perception import DepthCamera, DepthNoise, PerceptionSettings
from sidestep.robot import Robot, tip_of
from sidestep.simulation.depth_noise import DepthNoiseModel, noise_model
from sidestep.simulation.triangulation_noise import TriangulationNoise

Array = npt.NDArray[np.float64]

NAME = "camera"  # of the source of obstacles
WIDTH, HEIGHT, FOCAL = 320, 240, 215.0  # [pixel] 73 by 58 degrees, as a D435 has about
SENSOR_FOCAL = 424.0  # [pixel] of a D435's sensor at 848 pixels, from whose image the smaller one is made
LEAST_NOISE = 0.001  # [m] standard deviation that a depth is believed to have at least
STEP_NOISE = 0.29  # standard deviation of what a step of one rounds away: 1 / sqrt(12)
NEAREST = 0.1  # [m]
FARTHEST = 4.0  # [m] or twice what the place is away from the middle of the scene
LOST_IMAGES = 3.0  # images in a row that may be lost before the arm stops
BEHIND, BESIDE = 0.20, 0.09  # [m] behind the tip and beside it: where a camera on the hand is
HAND = "on the hand"
LEAST_WAY = 0.05  # [m] between two frames that say where the last link points
# Places by name: from the base, in lengths of the arm, and a point that is looked at.
TARGET = np.array([0.40, 0.0, 0.30])
PLACES: Mapping[str, Array] = {
    "front left": np.array([1.35, 0.85, 1.05]),
    "front right": np.array([1.35, -0.85, 1.05]),
    "front": np.array([1.70, 0.0, 0.85]),
    "above": np.array([0.45, 0.0, 1.90]),
    "over the shoulder": np.array([-0.75, -0.50, 1.30]),
}


@dataclass(frozen=True, eq=False)
class CameraChoice:
    """What is chosen of a depth camera.

    Args:
        pose: (4, 4) of the optical frame: in the world, or in `link`.
        link: frame of the arm that carries it; "": fixed in the world.
        place: in words. noise: of `sidestep.simulation.depth_noise.NOISES`.
        rate: images per second. latency: from capture to delivery [s].
        unseen_is_free: whether space where nobody has looked counts as free.
        only: the controller is not told of the scene: it knows what the camera has seen.

    Raises:
        ValueError: names the value and what is allowed.
    """

    pose: Array
    link: str = ""
    place: str = ""
    noise: str = "d435"
    rate: float = 10.0
    latency: float = 0.05
    unseen_is_free: bool = True
    only: bool = False

    def __post_init__(self) -> None:
        noise_model(self.noise)
        if not 1.0 <= self.rate <= 100.0:
            raise ValueError(f"camera: rate is {self.rate} Hz, allowed: 1 to 100")
        if not 0.0 <= self.latency <= 1.0:
            raise ValueError(f"camera: latency is {self.latency} s, allowed: 0 to 1")

    @property
    def camera(self) -> DepthCamera:
        """The camera as perception knows it: exact pose and clock, noise as that of the images."""
        away = float(np.linalg.norm(self.pose[:3, 3]))
        return DepthCamera(
            NAME,
            width=WIDTH,
            height=HEIGHT,
            fx=FOCAL,
            fy=FOCAL,
            cx=0.5 * (WIDTH - 1),
            cy=0.5 * (HEIGHT - 1),
            pose=self.pose,
            link=self.link,
            noise=believed_noise(self.noise),
            near=NEAREST,
            far=max(FARTHEST, 2.0 * away),
        )

    @property
    def settings(self) -> PerceptionSettings:
        """Of perception: images are believed until several in a row are lost."""
        usual = PerceptionSettings()
        return PerceptionSettings(
            unseen_is_free=self.unseen_is_free,
            valid_for=max(usual.valid_for, LOST_IMAGES / self.rate + self.latency),
        )


def noise_of(name: str) -> DepthNoiseModel:
    """A noise model by name, whose noise is that of the sensor and not that of fewer pixels."""
    model = noise_model(name)
    if isinstance(model, TriangulationNoise):
        smaller = FOCAL / SENSOR_FOCAL if model.focal is None else 1.0
        return dataclasses.replace(model, sigma=smaller * model.sigma, step=smaller * model.step)
    return model


def believed_noise(name: str) -> DepthNoise:
    """The standard deviation of depths of a noise model: sigma(z) = constant + quadratic z^2."""
    model = noise_of(name)
    if not isinstance(model, TriangulationNoise):
        return DepthNoise(LEAST_NOISE, 0.0)
    spread = float(np.hypot(model.sigma, STEP_NOISE * model.step))  # [pixel] of disparities
    return DepthNoise(LEAST_NOISE, spread / ((model.focal or FOCAL) * model.baseline))


def camera_at(place: str, robot: Robot) -> tuple[Array, str]:
    """Pose (4, 4) and link, "" for the world, of a place by name.

    Raises:
        ValueError: an unknown place; lists those that there are.
    """
    if place == HAND:
        return on_hand(robot), tip_of(robot)
    if place not in PLACES:
        raise ValueError(f"camera: place is {place!r}, allowed: {', '.join((*PLACES, HAND))}")
    q = robot.neutral
    length = max(float(np.linalg.norm(robot.pose(q, frame.name)[:3, 3])) for frame in robot.frames)
    return look_at(length * PLACES[place], length * TARGET), ""


def on_hand(robot: Robot) -> Array:
    """Pose (4, 4), in the frame of the tip, of a camera beside it that looks where the last link points."""
    tip, q = robot.pose(robot.neutral, tip_of(robot)), robot.neutral
    ways = [tip[:3, 3] - robot.pose(q, frame.name)[:3, 3] for frame in reversed(robot.frames)]
    way = next((way for way in ways if np.linalg.norm(way) > LEAST_WAY), tip[:3, 2])
    forward = way / np.linalg.norm(way)
    axes = sorted(tip[:3, :3].T, key=lambda axis: abs(float(axis @ forward)))
    side = axes[0] - (axes[0] @ forward) * forward
    side /= np.linalg.norm(side)
    eye = tip[:3, 3] - BEHIND * forward + BESIDE * side
    seen = look_at(eye, eye + forward, up=side)
    pose: Array = np.linalg.inv(tip) @ seen
    return pose
