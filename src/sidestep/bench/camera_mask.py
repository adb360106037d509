"""What the mask of a moving arm leaves of it, and takes of the world: simulated cameras, whose truth is known."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sidestep._core import Controller, ControllerSettings, DepthCamera, Perception
from sidestep.bench.camera_scene import (
    FLOOR,
    HAND,
    VIEWS,
    RandomMotion,
    as_collision_meshes,
    distance_to_solids,
    table_scene,
    told_camera,
    told_noise,
    true_cameras,
    wrong,
)
from sidestep.bench.campaign import Row, run_campaign
from sidestep.bench.link_surfaces import LinkSurfaces, Looks
from sidestep.bench.mask_measures import ArmTruth, MaskedImage, MaskMeasures, quantile
from sidestep.bench.moving import maker_and_judge
from sidestep.bench.parallel import Progress
from sidestep.math.matrices import product
from sidestep.math.pose import moved

if TYPE_CHECKING:
    from sidestep.robot import Robot
    from sidestep.simulation import SimulatedCamera, SimulatedImage
    from sidestep.simulation.depth_renderer import LinkSurface

Array = npt.NDArray[np.float64]

ROBOTS = ("fr3", "ur10", "iiwa", "panda", "xarm7")
NOISES = ("d435", "kinect", "structured_light")
#: How errors are told: all of them; not there at all; and the usual recipe, links grown by 5 and 10 cm.
WAYS = ("told", "exact", "grown 5 cm", "grown 10 cm")
GROWTH = {"grown 5 cm": 0.05, "grown 10 cm": 0.10}
COMPARED_EVERY = 4  # images: those that the other ways get
RATE = 30.0  # [Hz] of images
PERIOD = 0.005  # [s] between steps, which say where the arm is
LATENCY = 0.1  # [s] from capture to use: longer than all errors of clocks together
NEAR_ARM = 0.03  # [m] from the arm, nearer than which an obstacle where nothing is would stop it
SURE = 0.02  # [m] from all solids, beyond noise, farther than which nothing is
GHOST_NOISE = 4.0  # standard deviations of the depth of what is there


@dataclass(frozen=True)
class CameraMaskSettings:
    """Which images.

    Attributes:
        robots: names. noises: see `noise_model`. scenes: of each robot and noise, a table and a motion each.
        images: of each camera and scene. width, height: of an image [pixel].
        translation, rotation, clock: errors of what is told of cameras [m], [rad], [s]; they are just so large.
        looks: of the links, see `LinkSurfaces`. seed: of all.

    Raises:
        ValueError: nothing to run, or an unknown noise.
    """

    robots: Sequence[str] = ROBOTS
    noises: Sequence[str] = NOISES
    scenes: int = 4
    images: int = 42
    width: int = 424
    height: int = 240
    translation: float = 0.01
    rotation: float = float(np.radians(1.0))
    clock: float = 0.03
    looks: Looks = "mesh"
    seed: int = 0

    def __post_init__(self) -> None:
        if self.scenes < 1 or self.images < 1 or not self.robots or not self.noises:
            raise ValueError("there is nothing to run: robots, noises, scenes and images must not be empty")
        for noise in self.noises:
            told_noise(noise, 1.0)


@dataclass(frozen=True)
class _Task:
    robot: str
    noise: str
    scene: int

    @property
    def name(self) -> str:
        return f"{self.robot} {self.noise} {self.scene}"


def run_camera_mask(
    settings: CameraMaskSettings,
    *,
    file: Path | None = None,
    shard: tuple[int, int] = (1, 1),
    jobs: int = 1,
    progress: Progress | None = None,
) -> list[Row]:
    """A row for each robot, noise and scene; see `run_campaign`."""
    tasks = [
        _Task(robot, noise, scene)
        for scene, robot, noise in itertools.product(range(settings.scenes), settings.robots, settings.noises)
    ]
    return run_campaign(
        partial(_Worker, settings),
        tasks,
        name=lambda task: task.name,
        settings={"bench": "camera-mask", **asdict(settings)},
        file=file,
        shard=shard,
        jobs=jobs,
        progress=progress,
    )


class _Worker:
    def __init__(self, settings: CameraMaskSettings) -> None:
        self._settings = settings

    def run(self, task: _Task) -> Row:
        with MaskTrial(self._settings, task.robot, task.noise, task.scene) as trial:
            for number in range(self._settings.images):
                trial.look(number)
            return {"name": task.name, "robot": task.robot, "noise": task.noise, **trial.to_document()}


@cache
def _surfaces(robot: str, looks: Looks) -> LinkSurfaces:
    return LinkSurfaces(maker_and_judge(robot)[0].robot, looks)


@dataclass
class Ghosts:
    """Obstacles that were handed over where nothing is, summed over moments.

    Attributes:
        moments: at which all cameras had taken an image. cells: obstacles where nothing is. near_arm: of them those
            nearer than 3 cm to the arm. with_near_arm: moments at which there was one of these.
    """

    moments: int = 0
    cells: int = 0
    near_arm: int = 0
    with_near_arm: int = 0


@dataclass(eq=False)
class _Way:
    """One way in which errors are told, with all that came of it, by camera."""

    perception: Perception
    told: dict[str, DepthCamera]
    is_wrong: bool
    seconds: list[float] = field(default_factory=list)
    measures: dict[str, MaskMeasures] = field(
        default_factory=lambda: {name: MaskMeasures() for name in VIEWS}
    )
    ghosts: Ghosts = field(default_factory=Ghosts)


class MaskTrial:
    """An arm in motion above a table in view of four cameras, of one robot, noise and scene."""

    def __init__(self, settings: CameraMaskSettings, robot: str, noise: str, scene: int) -> None:
        from sidestep.simulation import SimulatedCamera, build_model

        self._settings, self._noise = settings, noise
        rng = np.random.default_rng((settings.seed, sum(robot.encode()), scene))
        maker, _ = maker_and_judge(robot)
        self.robot: Robot = maker.robot
        self.surfaces = _surfaces(robot, settings.looks)
        self.scene = table_scene(self.robot, rng)
        self.motion = RandomMotion(maker, self.scene, rng, duration=settings.images / RATE + 3.0 * LATENCY)
        self.cameras = true_cameras(
            self.robot,
            self.surfaces,
            rng,
            width=settings.width,
            height=settings.height,
            looks_back=scene % 2 == 1,
        )
        self._off = {
            name: wrong(camera.pose, rng, translation=settings.translation, rotation=settings.rotation)
            for name, camera in self.cameras.items()
        }
        self._late = {name: settings.clock * rng.choice((-1.0, 1.0)) for name in self.cameras}
        self._controller = Controller(
            maker.arm, ControllerSettings(output="acceleration", period=PERIOD, synchronous=True, seed=scene)
        )
        self._steps = 0
        self.ways = {name: self._way(name) for name in WAYS}
        self._first = self.ways[WAYS[0]]
        looks = as_collision_meshes(self.robot) if settings.looks == "mesh" else self.robot
        self._model = build_model(looks, self.scene, floor_height=FLOOR)
        links: LinkSurface = "collision" if settings.looks == "collision" else "visual"
        self._eyes: dict[str, SimulatedCamera] = {
            name: SimulatedCamera(self._model, camera, noise=noise, seed=number + 10 * scene, links=links)
            for number, (name, camera) in enumerate(self.cameras.items())
        }

    def __enter__(self) -> MaskTrial:
        return self

    def __exit__(self, *_: object) -> None:
        for eye in self._eyes.values():
            eye.close()

    def _way(self, name: str) -> _Way:
        s, is_wrong = self._settings, name != "exact"
        bounds = {"translation": GROWTH.get(name, 0.0)}
        if name == "told":
            bounds = {"translation": s.translation, "rotation": s.rotation, "clock": s.clock}
        told = {
            view: told_camera(
                camera,
                told_noise(self._noise, camera.fx),
                pose=self._off[view] if is_wrong else camera.pose,
                **bounds,
            )
            for view, camera in self.cameras.items()
        }
        return _Way(Perception(self._controller, list(told.values())), told, is_wrong)

    def look(self, number: int) -> None:
        """Takes an image by each camera, and measures what becomes of it."""
        import mujoco

        time = LATENCY + number / RATE
        while self._steps * PERIOD <= time + LATENCY:
            self._controller.step(*self.motion.at(self._steps * PERIOD), time=self._steps * PERIOD)
            self._steps += 1
        data = mujoco.MjData(self._model.model)
        self._model.set_state(data, self.motion.at(time)[0], np.zeros(self.robot.num_coordinates))
        asked = [way for way in self.ways.values() if way is self._first or number % COMPARED_EVERY == 0]
        for name, eye in self._eyes.items():
            image = eye.capture(data, time)
            assert image is not None  # none is lost
            for way in asked:
                self._measure(way, name, image)
        poses = self.surfaces.poses(self.motion.at(time)[0])
        for way in asked:
            self._count_ghosts(way, poses)

    def _measure(self, way: _Way, name: str, image: SimulatedImage) -> None:
        camera, told_time = way.told[name], image.time + (self._late[name] if way.is_wrong else 0.0)
        report = way.perception.update(name, image.depth, time=told_time)
        way.seconds.append(report.total_time)
        labels = way.perception.labels(name)
        masked = MaskedImage(image.depth, image.true_depth, image.owner == 1, image.owner == 2)
        measures = way.measures[name]
        clock = camera.clock_error
        true = self._truth(self.cameras[name], image.time, clock)
        measures.add_left_over(
            camera, labels, masked, lambda p_C: distance_to_solids(self.scene, moved(p_C, true.X_WC))
        )
        told = self._truth(camera, told_time, clock)
        measures.add_lost(camera, labels, masked, self.surfaces, true, told)

    def _truth(self, camera: DepthCamera, time: float, clock: float) -> ArmTruth:
        at = [self._places(camera, t) for t in ((time, time - clock, time + clock) if clock else (time,))]
        return ArmTruth(*at[0], tuple(at[1:]))

    def _places(self, camera: DepthCamera, time: float) -> tuple[Array, Array]:
        q = self.motion.at(time)[0]
        pose = camera.pose
        return (
            product(self.robot.pose(q, camera.link), pose) if camera.link else pose,
            self.surfaces.poses(q),
        )

    def _count_ghosts(self, way: _Way, poses: Array) -> None:
        cells = way.perception.cells()
        from_solids = np.empty(len(cells["radii"]))
        for number, (view, camera) in enumerate(way.told.items()):
            its = cells["cameras"] == number
            seen = self._where_it_is(way, view, cells["centres"][its])
            away = np.linalg.norm(seen - way.perception.pose(view)[:3, 3], axis=1)
            sure = SURE + GHOST_NOISE * (camera.noise.constant + camera.noise.quadratic * away**2)
            if view == HAND and way.is_wrong:
                sure += self._settings.translation + self._settings.rotation * away
            from_solids[its] = distance_to_solids(self.scene, seen) - sure
        ghost = from_solids > cells["radii"]
        found = way.ghosts
        found.moments += 1
        found.cells += int(ghost.sum())
        away = self.surfaces.nearest(cells["centres"][ghost], poses, within=0.2).distance
        near = away - cells["radii"][ghost] <= NEAR_ARM
        found.near_arm += int(near.sum())
        found.with_near_arm += bool(near.any())

    def _where_it_is(self, way: _Way, view: str, points: Array) -> Array:
        """Where what a camera shows at points (N, 3) truly is, if it stands in the world: its pose is off."""
        if view == HAND:
            return points
        told = way.told[view].pose
        return moved((points - told[:3, 3]) @ told[:3, :3], self.cameras[view].pose)

    def to_document(self) -> Row:
        """By way: the masks of each camera, and the obstacles."""
        return {
            "ways": {
                name: {
                    "views": {view: measures.to_document() for view, measures in way.measures.items()},
                    "ghosts": asdict(way.ghosts),
                }
                for name, way in self.ways.items()
            }
        }


def mask_table(rows: Sequence[Row], by: str = "all") -> dict[str, dict[str, dict[str, Any]]]:
    """By way, and by what is asked for: "all", "view", "robot" or "noise".

    Pixels and shares of all pixels, and quantiles of what is lost of the world [m].
    """
    cells: dict[str, dict[str, list[Row]]] = {}
    for row in rows:
        for way, found in row["ways"].items():
            for view, measures in found["views"].items():
                key = {"view": view, "all": "all"}.get(by) or row[by]
                cells.setdefault(way, {}).setdefault(key, []).append(measures)
    return {way: {key: _cell(found) for key, found in parts.items()} for way, parts in cells.items()}


def ghost_table(rows: Sequence[Row]) -> dict[str, dict[str, int]]:
    """By way: obstacles where nothing is, see `Ghosts`."""
    table: dict[str, Counter[str]] = {}
    for row in rows:
        for way, found in row["ways"].items():
            table.setdefault(way, Counter()).update(found["ghosts"])
    return {way: dict(counts) for way, counts in table.items()}


def _cell(found: list[Row]) -> dict[str, Any]:
    total = MaskMeasures.sum_of(found)
    nowhere = total.left_over - total.left_over_world
    cell: dict[str, Any] = {
        "images": total.images,
        "arm_pixels": total.arm_pixels,
        "left_over": total.left_over,
        "left_over_share": total.left_over / total.pixels,
        "left_over_true": total.left_over_true,
        "left_over_nowhere": nowhere,
        "left_over_nowhere_share": nowhere / total.pixels,
        "worst_left_over": total.worst_left_over,
        "images_with_left_over": total.images_with_left_over,
        "lost": total.lost,
        "lost_share_of_world": total.lost / max(1, total.world_pixels),
        "lost_wrong_depth": total.lost - total.lost_true,
    }
    for name in ("distance", "beyond", "beyond_told"):
        histogram = getattr(total, name)
        cell[name] = {
            label: quantile(histogram, share) for label, share in (("p50", 0.5), ("p99", 0.99), ("max", 1.0))
        }
    return cell
