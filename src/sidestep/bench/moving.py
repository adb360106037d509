"""A ball or a capsule that comes at an arm, and what the controller is told of it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import Controller
from sidestep.arm import Arm
from sidestep.bench.campaign import Row, run_campaign
from sidestep.bench.encounters import (
    PERIOD,
    Encounter,
    EncounterJudge,
    IdealPlant,
    TorquePlant,
    load_with_meshes,
    run_encounter,
)
from sidestep.bench.parallel import Progress
from sidestep.bench.workspace import Workspace
from sidestep.distance import ExactClearance, SceneObject, SelfCollision
from sidestep.obstacles import Capsule, Shape, Sphere, pose_at
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]

SPEEDS = (0.2, 0.5, 1.0)  # [m/s]
ALL_COLUMNS = ("fr3", "ur10")  # robots with every cell
TWO_COLUMNS = ("iiwa", "panda", "xarm7")  # robots with `Told.exact` and `Told.untold` alone
RADII, LENGTHS = (0.04, 0.10), (0.2, 0.5)  # [m] of balls and capsules, and of capsules
FROM_SHOULDER = 0.35  # [m] at least between the surface and the shoulder: nearer, an arm cannot yield
FROM_ARM = 0.25  # [m] at least from the arm when it begins
FROM_FLOOR = 0.1  # [m] its centre never is lower
AFTER = 0.8  # [m] its way beyond the arm
SEEN_EVERY = 33  # periods between two sets of obstacles: 30 Hz
GOAL_EVERY = 1500  # periods between two goals of an arm that moves
OFF = 0.3  # share by which a wrong velocity is wrong
LATE = (0.05, 0.10)  # [s] by which positions are old
TRIES, STARTS = 500, 100  # solids drawn for a start, and starts
APART = 0.012  # [m] of links from each other at the start


class Told(StrEnum):
    """What the controller is told of the velocity and of the time."""

    exact = "exact"  #: position and velocity as they are
    wrong = "wrong"  #: the velocity is 30 % off, in size or direction
    untold = "untold"  #: no velocity
    late = "late"  #: the position is 50 to 100 ms old, the velocity is right


@dataclass(frozen=True)
class MovingSettings:
    """Which encounters.

    Attributes:
        robots: names. told, speeds: columns; robots of `TWO_COLUMNS` have only exact and untold ones.
        runs: in a cell. torque: in MuJoCo, else accelerations are carried out exactly. seed: of all.

    Raises:
        ValueError: nothing to run, or a speed that is not positive.
    """

    robots: Sequence[str] = ALL_COLUMNS + TWO_COLUMNS
    told: Sequence[Told] = tuple(Told)
    speeds: Sequence[float] = SPEEDS
    runs: int = 4
    torque: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        if self.runs < 1 or not self.robots or not self.told or not self.speeds:
            raise ValueError("there is nothing to run: robots, told, speeds and runs must not be empty")
        for speed in self.speeds:
            if not (np.isfinite(speed) and speed > 0.0):
                raise ValueError(f"speed is {speed} m/s, must be positive and finite")

    def tasks(self) -> list[MovingTask]:
        """All encounters."""
        return [
            MovingTask(robot, told, speed, holds, run)
            for robot, told, speed, holds, run in itertools.product(
                self.robots, self.told, self.speeds, (True, False), range(self.runs)
            )
            if robot not in TWO_COLUMNS or told in (Told.exact, Told.untold)
        ]


@dataclass(frozen=True)
class MovingTask:
    """One encounter; holds: the arm is to stay where it is, else it gets a new goal every 1.5 s."""

    robot: str
    told: Told
    speed: float
    holds: bool
    run: int

    @property
    def name(self) -> str:
        """Unique in a campaign."""
        return f"{self.robot} {self.told} {self.speed:g} {'holds' if self.holds else 'moves'} {self.run}"


def run_moving(
    settings: MovingSettings,
    *,
    file: Path | None = None,
    shard: tuple[int, int] = (1, 1),
    jobs: int = 1,
    progress: Progress | None = None,
) -> list[Row]:
    """A row for each encounter; see `run_campaign`."""
    return run_campaign(
        partial(_Worker, settings),
        settings.tasks(),
        name=lambda task: task.name,
        settings={"bench": "moving", **asdict(settings)},
        file=file,
        shard=shard,
        jobs=jobs,
        progress=progress,
    )


class _Worker:
    def __init__(self, settings: MovingSettings) -> None:
        self._settings = settings

    def run(self, task: MovingTask) -> Row:
        maker, judge = maker_and_judge(task.robot)
        encounter = maker.make(task, seed=self._settings.seed)
        torque = self._settings.torque
        plant = TorquePlant(maker.robot, encounter.start) if torque else IdealPlant(encounter.start)
        output = "torque" if torque else "acceleration"
        course = run_encounter(maker.arm, encounter, output=output, plant=plant)
        told = {key: getattr(task, key) for key in ("robot", "speed", "holds")}
        return {
            "name": task.name,
            "told": task.told.value,
            **told,
            **asdict(judge.judge(encounter, course)),
        }


class EncounterMaker:
    """Makes encounters of one arm, each from (seed, robot, speed, holds, run) alone: the same for everything told."""

    def __init__(self, arm: Arm, robot: Robot) -> None:
        self.arm, self.robot = arm, robot
        self._exact = ExactClearance(robot, ())
        self._self = SelfCollision(robot)
        self._shoulder = Workspace.of(robot).shoulder
        self._links = [link.name for link in robot.links if robot.collision_mesh(link.name) is not None]

    def make(self, task: MovingTask, *, seed: int) -> Encounter:
        """The encounter of a task.

        Raises:
            ValueError: none was found among the tries.
        """
        rng = np.random.default_rng(
            (seed, sum(task.robot.encode()), round(1e3 * task.speed), task.holds, task.run)
        )
        distance = float(np.clip(1.5 * task.speed, 0.7, 1.5))
        start, solid = self._start_and_solid(rng, task.speed, distance)
        velocity = solid.velocity
        goals = [self.configuration(rng) for _ in range(20)]
        off = 1.0 + OFF * rng.choice((-1.0, 1.0))
        tilt = rng.normal(size=3)
        tilt *= OFF * task.speed / np.linalg.norm(tilt)
        lag = float(rng.uniform(*LATE))
        told_velocity = {
            Told.wrong: off * velocity if rng.uniform() < 0.5 else velocity + tilt,
            Told.untold: np.zeros(3),
        }.get(task.told, velocity)

        def tell(controller: Controller, step: int, q: Array) -> None:
            if step == 0 and task.holds:
                controller.set_goal(start)
            if not task.holds and step % GOAL_EVERY == 0:
                controller.set_goal(goals[step // GOAL_EVERY])
            if step % SEEN_EVERY == 0:
                time = step * PERIOD
                time = max(0.0, time - lag) if task.told is Told.late else time
                controller.set_obstacles(_shape(solid, time, told_velocity))

        steps = round((distance + AFTER) / task.speed / PERIOD)
        return Encounter(task.run, start, steps, (solid,), tell)

    def _start(self, rng: np.random.Generator) -> Array:
        q = self.robot.neutral.copy() if rng.uniform() < 0.4 else self.configuration(rng)
        while self._self.distance(q).distance < APART or self._lowest(q) < 0.0:
            q = self.configuration(rng)
        return q

    def configuration(self, rng: np.random.Generator) -> Array:
        """Within seven tenths of the position limits around their middle."""
        lower, upper = (np.clip(x, -3.1, 3.1) for x in (self.robot.limits.lower, self.robot.limits.upper))
        middle = 0.5 * (lower + upper)
        return np.asarray(middle + 0.7 * (rng.uniform(lower, upper) - middle))

    def _lowest(self, q: Array) -> float:
        return min(float(self.robot.pose(q, link)[2, 3]) for link in self._links)

    def _start_and_solid(
        self, rng: np.random.Generator, speed: float, distance: float
    ) -> tuple[Array, SceneObject]:
        for _ in range(STARTS):
            start = self._start(rng)
            solid = self._solid(rng, start, speed, distance)
            if solid is not None:
                return start, solid
        raise ValueError(
            f"none of {STARTS} configurations has something come at it from a place that is free"
        )

    def _solid(
        self, rng: np.random.Generator, start: Array, speed: float, distance: float
    ) -> SceneObject | None:
        """What comes: straight at a link, not at the shoulder, from a place that is free; None: not found."""
        capsule, radius = rng.uniform() < 0.5, float(rng.uniform(*RADII))
        length = float(rng.uniform(*LENGTHS)) if capsule else 0.0
        for _ in range(TRIES):
            link = self._links[rng.integers(3, len(self._links))]
            through = self.robot.pose(start, link)[:3, 3] + rng.normal(size=3) * 0.03
            direction = rng.normal(size=3) * (1.0, 1.0, 0.5)
            direction /= np.linalg.norm(direction)
            begin = through - distance * direction
            along = np.clip((self._shoulder - begin) @ direction, 0.0, distance + AFTER)
            away = float(np.linalg.norm(begin + along * direction - self._shoulder))
            lowest = min(begin[2], begin[2] + (distance + AFTER) * direction[2])
            if away < FROM_SHOULDER + radius + 0.5 * length or lowest < FROM_FLOOR:
                continue
            pose = pose_at(begin)
            pose[:3, :3] = _random_rotation(rng)
            shape: Shape = Capsule(radius, length, pose) if capsule else Sphere(radius, pose)
            solid = SceneObject.from_shape("solid", shape, motion="moving", velocity=speed * direction)
            if self._exact.among([solid]).distance(start).distance > FROM_ARM:
                return solid
        return None


@cache
def maker_and_judge(robot: str) -> tuple[EncounterMaker, EncounterJudge]:
    """Of a robot by its name, once in a process."""
    arm, meshes = load_with_meshes(robot)
    return EncounterMaker(arm, meshes), EncounterJudge(meshes)


def _shape(solid: SceneObject, time: float, velocity: Array) -> Shape:
    """As the controller is told of it."""
    pose = solid.pose_at(time)
    return replace(solid.shape, pose=pose, velocity=velocity, name=solid.name)  # type: ignore[type-var]


def _random_rotation(rng: np.random.Generator) -> Array:
    """Uniform: the orthogonal factor of a random matrix, with a positive determinant."""
    rotation, upper = np.linalg.qr(rng.normal(size=(3, 3)))
    rotation = rotation * np.sign(np.diag(upper))
    if np.linalg.det(rotation) < 0.0:
        rotation[:, 0] *= -1.0
    return np.asarray(rotation)


def moving_table(rows: Sequence[Row]) -> dict[str, dict[str, dict[str, Any]]]:
    """By robot and "told speed": runs, contacts, those with a way out, and speeds of the arm at contact [rad/s]."""
    table: dict[str, dict[str, dict[str, Any]]] = {}
    for row in rows:
        cell = table.setdefault(row["robot"], {}).setdefault(
            f"{row['told']} {row['speed']:g}",
            {"runs": 0, "contacts": 0, "with_way_out": 0, "self_contacts": 0, "contact_speeds": []},
        )
        cell["runs"] += 1
        cell["self_contacts"] += row["self_clearance_m"] <= 0.0
        if row["clearance_m"] <= 0.0:
            cell["contacts"] += 1
            cell["with_way_out"] += row["way_out"] is True
            cell["contact_speeds"].append(round(row["contact_speed"], 2))
    return table
