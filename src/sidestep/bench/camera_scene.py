"""An arm that moves above a table with objects, among depth cameras."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import DepthCamera, DepthNoise
from sidestep.bench.link_surfaces import LinkSurfaces
from sidestep.bench.moving import EncounterMaker
from sidestep.bench.workspace import Workspace
from sidestep.distance import ExactClearance, SceneObject, SelfCollision
from sidestep.math.pose import about_axis, look_at, pose_at
from sidestep.obstacles import Box, Cylinder, Shape, Sphere
from sidestep.robot import Robot
from sidestep.robot.tree import KinematicTree
from sidestep.simulation.depth_noise import noise_model
from sidestep.simulation.triangulation_noise import TriangulationNoise

Array = npt.NDArray[np.float64]

FIXED = ("front", "side", "back")
HAND = "hand"
VIEWS = (*FIXED, HAND)
# Where fixed cameras are, from the shoulder's foot, in reaches of the arm.
PLACES = {"front": (1.6, 0.7, 1.0), "side": (0.5, -1.5, 0.8), "back": (-1.0, 0.9, 1.3)}
FLOOR = -0.75  # [m]
BEHIND = 0.3  # of the reach: how far the table goes on behind the arm
FOCAL = 0.75  # focal length, in widths of the image
OBJECTS = 8
CLEAR = 0.02  # [m] of the arm from all that it moves among
APART = 0.01  # [m] of links from each other at the ends of a way
CLOSE = 0.15  # [m] of the arm from something at the ends of a way, at most
SAMPLES = 12  # of a way that are looked at
TRIES = 2000
LOOKS_AT = 0.5  # [m] of an eye in hand along the axis of the last joint
CAMERA_CLEAR = 0.03  # [m] of an eye in hand from the links, whose middle it is


def table_scene(robot: Robot, rng: np.random.Generator) -> list[SceneObject]:
    """A table on which the arm stands, its top at z = 0, with boxes, cylinders and balls on it."""
    reach = Workspace.of(robot).reach
    depth, width = 1.4 * reach, 1.6 * reach
    middle = 0.5 * depth - BEHIND * reach
    scene = [SceneObject("table", "box", (depth, width, 0.04), pose=pose_at((middle, 0.0, -0.02)))]
    for number in range(OBJECTS):
        height = float(rng.uniform(0.05, 0.45)) if number < 3 else float(rng.uniform(0.04, 0.2))
        x, y = rng.uniform(0.3 * reach, 0.45 * depth + middle), rng.uniform(-0.45, 0.45) * width
        turned = about_axis(np.array([0.0, 0.0, 1.0]), float(rng.uniform(-np.pi, np.pi)))
        kind, size = rng.integers(3), rng.uniform(0.03, 0.2, 2)
        shape: Shape
        if kind == 0:
            shape = Box((size[0], size[1], height), pose_at((x, y, 0.5 * height), turned))
        elif kind == 1:
            shape = Cylinder(0.5 * float(size[0]), height, pose_at((x, y, 0.5 * height)))
        else:
            shape = Sphere(0.5 * float(size[0]), pose_at((x, y, 0.5 * size[0])))
        scene.append(SceneObject.from_shape(f"object{number}", shape))
    return scene


def distance_to_solids(scene: Sequence[SceneObject], points: Array) -> Array:
    """Distance (N,) of points (N, 3) to the nearest solid or the floor [m], 0 inside; of boxes, cylinders and balls."""
    nearest = np.maximum(points[:, 2] - FLOOR, 0.0)
    for item in scene:
        local = (points - item.pose[:3, 3]) @ item.pose[:3, :3]
        if item.kind == "sphere":
            distance = np.linalg.norm(local, axis=1) - item.size[0]
        elif item.kind == "box":
            distance = np.linalg.norm(np.maximum(np.abs(local) - 0.5 * np.array(item.size), 0.0), axis=1)
        else:  # a cylinder: radius, length
            across = np.maximum(np.hypot(local[:, 0], local[:, 1]) - item.size[0], 0.0)
            distance = np.hypot(across, np.maximum(np.abs(local[:, 2]) - 0.5 * item.size[1], 0.0))
        nearest = np.minimum(nearest, np.maximum(distance, 0.0))
    return nearest


@dataclass(frozen=True, eq=False)
class Way:
    """From one configuration to another in `duration` [s]: q = a + (3 s^2 - 2 s^3) (b - a), s = t / duration."""

    a: Array
    b: Array
    duration: float

    def at(self, time: float) -> Array:
        """q (nv,) at a time [s] since its begin."""
        s = min(max(time / self.duration, 0.0), 1.0)
        return np.asarray(self.a + s * s * (3.0 - 2.0 * s) * (self.b - self.a))


class RandomMotion:
    """Ways between random configurations that touch nothing, each as quick as velocity and acceleration allow.

    Args:
        maker: of configurations. scene: what to keep clear of. duration: at least [s].

    Raises:
        ValueError: no free way was found.
    """

    def __init__(
        self,
        maker: EncounterMaker,
        scene: Sequence[SceneObject],
        rng: np.random.Generator,
        *,
        duration: float,
    ) -> None:
        self._maker, self._rng = maker, rng
        self._exact = ExactClearance(maker.robot, ()).among(scene)
        self._self = SelfCollision(maker.robot)
        self.ways: list[Way] = []
        self._begins = [0.0]
        q = self._free_configuration()
        while self._begins[-1] < duration:
            self.ways.append(self._way_from(q))
            self._begins.append(self._begins[-1] + self.ways[-1].duration)
            q = self.ways[-1].b

    def at(self, time: float) -> tuple[Array, Array]:
        """q and v (nv,) at a time [s]; at rest before it begins and after it ends."""
        number = int(np.clip(np.searchsorted(self._begins, time, side="right") - 1, 0, len(self.ways) - 1))
        way, since, step = self.ways[number], time - self._begins[number], 1e-5
        return way.at(since), (way.at(since + step) - way.at(since - step)) / (2.0 * step)

    def _is_free(self, q: Array) -> bool:
        return self._exact.distance(q).distance >= CLEAR

    def _free_configuration(self) -> Array:
        for _ in range(TRIES):
            q = self._maker.configuration(self._rng)
            if self._is_free(q) and self._self.distance(q).distance >= APART:
                return q
        raise ValueError(f"none of {TRIES} configurations of {self._maker.robot.name} is free in this scene")

    def _way_from(self, q: Array) -> Way:
        limits = self._maker.robot.limits
        for _ in range(TRIES):
            goal = self._maker.configuration(self._rng)
            way = np.abs(goal - q)
            duration = float(
                np.maximum(1.5 * way / limits.velocity, np.sqrt(6.0 * way / limits.acceleration)).max()
            )
            found = Way(q, goal, duration)
            if not CLEAR <= self._exact.distance(goal).distance <= CLOSE:
                continue
            samples = [found.at(share * duration) for share in np.linspace(0.0, 1.0, SAMPLES, endpoint=False)]
            if self._self.distance(goal).distance >= APART and all(map(self._is_free, samples)):
                return found
        raise ValueError(f"none of {TRIES} ways of {self._maker.robot.name} is free in this scene")


def as_collision_meshes(robot: Robot) -> Robot:
    """The same robot that looks like its collision meshes, to which covers are proven."""
    links = tuple(replace(link, visuals=link.geometries) for link in robot.links)
    tree = KinematicTree(
        tuple(robot.joints),
        tuple(robot.frames),
        tuple(robot.coordinate_names),
        robot.limits,
        links,
        robot.held,
    )
    return Robot(robot.name, tree)


def true_cameras(
    robot: Robot,
    surfaces: LinkSurfaces,
    rng: np.random.Generator,
    *,
    width: int,
    height: int,
    looks_back: bool = False,
) -> dict[str, DepthCamera]:
    """Three cameras around the arm, and an eye in hand, each by its name.

    looks_back: the eye in hand looks at the arm, not ahead.
    """
    workspace = Workspace.of(robot)
    target = np.array([0.25, 0.0, 0.25]) * workspace.reach
    size: dict[str, Any] = {"width": width, "height": height, "fx": FOCAL * width, "fy": FOCAL * width}
    middle: dict[str, Any] = {"cx": 0.5 * (width - 1), "cy": 0.5 * (height - 1)}
    cameras = {}
    for name in FIXED:
        eye = workspace.reach * (np.array(PLACES[name]) + rng.uniform(-0.15, 0.15, 3))
        cameras[name] = DepthCamera(name, **size, **middle, pose=look_at(eye, target))
    link, X_LC = _in_hand(robot, surfaces, looks_back=looks_back)
    cameras[HAND] = DepthCamera(HAND, **size, **middle, pose=X_LC, link=link)
    return cameras


def _in_hand(robot: Robot, surfaces: LinkSurfaces, *, looks_back: bool) -> tuple[str, Array]:
    """The link of the last joint, and a pose in it beside the links, looking along its axis and a little inwards."""
    last = max(frame.joint for frame in robot.frames)
    link = next(frame.name for frame in robot.frames if frame.joint == last)
    q = robot.neutral
    X_WL, poses = robot.pose(q, link), surfaces.poses(q)
    tool = surfaces.middle(q, [frame.name for frame in robot.frames if frame.joint == last])
    forward = np.asarray(robot.joints[last].axis, dtype=float)
    forward = forward * (1.0 if (tool - X_WL[:3, 3]) @ X_WL[:3, :3] @ forward >= 0.0 else -1.0)
    across = np.roll(np.eye(3)[np.argmax(np.abs(forward))], 1)
    for radius in np.arange(0.06, 0.3, 0.01):
        for angle in np.arange(8) * np.pi / 4.0:
            out = about_axis(forward, float(angle)) @ across
            eye = radius * out + 0.02 * forward
            point = X_WL[:3, :3] @ eye + X_WL[:3, 3]
            if surfaces.nearest(point[None], poses).distance[0] >= CAMERA_CLEAR:
                return link, look_at(eye, (-LOOKS_AT if looks_back else LOOKS_AT) * forward, up=out)
    raise ValueError(f"there is no place for an eye in hand on link {link!r} of {robot.name}")


def told_noise(noise: str, fx: float) -> DepthNoise:
    """What a user would tell of a noise model: sigma = 1 mm + z^2 s / (f b)."""
    model = noise_model(noise)
    if not isinstance(model, TriangulationNoise):
        return DepthNoise(1e-4, 0.0)
    return DepthNoise(1e-3, model.sigma / ((model.focal or fx) * model.baseline))


def told_camera(
    camera: DepthCamera,
    noise: DepthNoise,
    *,
    pose: Array,
    translation: float = 0.0,
    rotation: float = 0.0,
    clock: float = 0.0,
) -> DepthCamera:
    """A camera as it is told: where it is believed to be, and by how much that and its clock may be wrong."""
    return camera.replace(
        pose=pose, noise=noise, translation_error=translation, rotation_error=rotation, clock_error=clock
    )


def wrong(pose: Array, rng: np.random.Generator, *, translation: float, rotation: float) -> Array:
    """A pose that is off by just so much [m], [rad], in random directions."""
    shift, axis = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    return pose_at(pose[:3, 3] + translation * shift, about_axis(axis, rotation) @ pose[:3, :3])
