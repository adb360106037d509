"""Random velocity drives among balls, which press every mechanism that holds an arm back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import Controller, Obstacles
from sidestep.arm import Arm
from sidestep.bench.campaign import Row, run_campaign
from sidestep.bench.encounters import Encounter, EncounterJudge, IdealPlant, load_with_meshes, run_encounter
from sidestep.bench.parallel import Progress
from sidestep.distance import ExactClearance, SceneObject
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]

ROBOTS = ("fr3", "panda", "ur10")
BALLS, RADIUS = 25, 0.05  # [m]
SHELL = (0.35, 0.85)  # [m] from the base, where balls are
FREE_AT_START = 0.08  # [m] of the arm from every ball
STEPS, HOLD = 3000, 400  # periods of a drive, and of one velocity


@dataclass(frozen=True)
class DriveSettings:
    """Which drives.

    Attributes:
        robots: names. torque: torque output, carried out exactly; else acceleration.
        moving: [m/s] of half of the balls; 0: all rest. count: drives of each robot. seed: of all.

    Raises:
        ValueError: a value out of range.
    """

    robots: Sequence[str] = ROBOTS
    torque: bool = False
    moving: float = 0.0
    count: int = 12
    seed: int = 0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.moving) and self.moving >= 0.0):
            raise ValueError(f"moving is {self.moving} m/s, must be finite and not negative")
        if self.count < 1:
            raise ValueError(f"count is {self.count}, must be at least 1")


@dataclass(frozen=True)
class _Task:
    robot: str
    index: int

    @property
    def name(self) -> str:
        return f"{self.robot} {self.index}"


def run_drives(
    settings: DriveSettings,
    *,
    file: Path | None = None,
    shard: tuple[int, int] = (1, 1),
    jobs: int = 1,
    progress: Progress | None = None,
) -> list[Row]:
    """A row for each drive; see `run_campaign`."""
    tasks = [_Task(robot, k) for robot in settings.robots for k in range(settings.count)]
    return run_campaign(
        partial(_Worker, settings),
        tasks,
        name=lambda task: task.name,
        settings={"bench": "drives", **asdict(settings)},
        file=file,
        shard=shard,
        jobs=jobs,
        progress=progress,
    )


class _Worker:
    def __init__(self, settings: DriveSettings) -> None:
        self._settings = settings
        self._arms: dict[str, tuple[Arm, Robot, EncounterJudge]] = {}

    def run(self, task: _Task) -> Row:
        if task.robot not in self._arms:
            arm, robot = load_with_meshes(task.robot)
            self._arms[task.robot] = arm, robot, EncounterJudge(robot)
        arm, robot, judge = self._arms[task.robot]
        drive = random_drive(robot, self._settings, task.index)
        course = run_encounter(
            arm,
            drive,
            output="torque" if self._settings.torque else "acceleration",
            plant=IdealPlant(drive.start),
            planner=None,
        )
        path = float(np.abs(np.diff(course.motion.q, axis=0)).sum())
        return {"name": task.name, "robot": task.robot, "path": path, **asdict(judge.judge(drive, course))}


def random_drive(robot: Robot, settings: DriveSettings, index: int) -> Encounter:
    """Drive number `index`: 25 balls of 5 cm, and a random velocity within the limits every 0.4 s, for 3 s."""
    rng = np.random.default_rng((settings.seed, index))
    limits, start = robot.limits, robot.neutral.copy()
    directions = rng.normal(size=(BALLS, 3))
    points = (
        directions / np.linalg.norm(directions, axis=1, keepdims=True) * rng.uniform(*SHELL, size=(BALLS, 1))
    )
    points[:, 2] = np.abs(points[:, 2]) + RADIUS
    velocities = rng.normal(size=(BALLS, 3))
    velocities *= settings.moving / np.linalg.norm(velocities, axis=1, keepdims=True)
    velocities[::2] = 0.0
    alone = ExactClearance(robot, ())
    balls = [
        SceneObject.ball(f"ball{k}", p, radius=RADIUS, motion="moving", velocity=v.tolist())
        for k, (p, v) in enumerate(zip(points, velocities, strict=True))
    ]
    kept = [k for k, ball in enumerate(balls) if alone.among([ball]).distance(start).distance > FREE_AT_START]
    obstacles = Obstacles(points[kept], RADIUS, velocities[kept])
    speeds = rng.uniform(-1.0, 1.0, (STEPS // HOLD + 1, robot.num_coordinates)) * limits.velocity

    def tell(controller: Controller, step: int, q: Array) -> None:
        if step == 0:
            controller.set_obstacles(obstacles, valid_for=np.inf)  # as they move, without a tracker
        controller.set_velocity(speeds[step // HOLD])

    return Encounter(index, start, STEPS, tuple(balls[k] for k in kept), tell)


def drive_table(rows: Sequence[Row]) -> dict[str, dict[str, Any]]:
    """By robot: drives, contacts, speeds at contact, steps beyond each limit before contact, least clearance [mm]."""
    table: dict[str, dict[str, Any]] = {}
    for robot in dict.fromkeys(row["robot"] for row in rows):
        of = [row for row in rows if row["robot"] == robot]
        touched = [row for row in of if row["clearance_m"] <= 0.0]
        names = ("position", "velocity", "acceleration", "jerk", "torque", "torque rate")
        table[robot] = {
            "drives": len(of),
            "contacts": len(touched),
            "with_way_out": sum(row["way_out"] is True for row in touched),
            "contact_speeds": sorted(round(row["contact_speed"], 2) for row in touched),
            "self_contacts": sum(row["self_clearance_m"] <= 0.0 for row in of),
            "beyond": {name: sum(row["beyond"].get(name, (0,))[0] for row in of) for name in names},
            "least_clearance_mm": round(1e3 * min(row["clearance_m"] for row in of), 2),
            "path": round(sum(row["path"] for row in of), 1),
        }
    return table
