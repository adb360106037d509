"""A ball or a capsule that comes at an arm, and what the controller is told of it."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
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
    Tell,
    TorquePlant,
    load_with_meshes,
    run_encounter,
)
from sidestep.bench.parallel import Progress
from sidestep.bench.sensor_fault import SensorFault
from sidestep.bench.tracker import LATE, LOST, OFF, SEEN_EVERY, After, Told, Tracker
from sidestep.bench.workspace import Workspace
from sidestep.distance import ExactClearance, SceneObject, SelfCollision
from sidestep.obstacles import Capsule, Shape, Sphere, pose_at
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]
Teller = Callable[[SceneObject, SensorFault | None], Tell]

SPEEDS = (0.2, 0.5, 1.0)  # [m/s]
ALL_COLUMNS = ("fr3", "ur10")  # robots with every cell
TWO_COLUMNS = ("iiwa", "panda", "xarm7")  # robots with `Told.exact` and `Told.untold` alone, unless named
RADII, LENGTHS = (0.04, 0.10), (0.2, 0.5)  # [m] of balls and capsules, and of capsules
FROM_SHOULDER = 0.35  # [m] at least between the surface and the shoulder: nearer, an arm cannot yield
FROM_ARM = 0.25  # [m] at least from the arm when it begins
FROM_FLOOR = 0.1  # [m] its centre never is lower
AFTER = 0.8  # [m] its way beyond the arm
GOAL_EVERY = 1500  # periods between two goals of an arm that moves
BEFORE = (0.1, 0.6)  # [m] left of its way to the link when a tracker fails
STANDS = 3.0  # [s] at least for which it stands there after that
TRIES, STARTS = 500, 100  # solids drawn for a start, and starts
APART = 0.012  # [m] of links from each other at the start


@dataclass(frozen=True)
class MovingSettings:
    """Which encounters.

    Attributes:
        robots: names. None: all, those of `TWO_COLUMNS` with only exact and untold columns. told, speeds: columns.
        runs: in a cell. torque: in MuJoCo, else accelerations are carried out exactly. seed: of all.

    Raises:
        ValueError: nothing to run, or a speed that is not positive.
    """

    robots: Sequence[str] | None = None
    told: Sequence[Told] = tuple(Told)
    speeds: Sequence[float] = SPEEDS
    runs: int = 4
    torque: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        named = self.robots is None or len(self.robots) > 0
        if self.runs < 1 or not named or not self.told or not self.speeds:
            raise ValueError("there is nothing to run: robots, told, speeds and runs must not be empty")
        for speed in self.speeds:
            if not (np.isfinite(speed) and speed > 0.0):
                raise ValueError(f"speed is {speed} m/s, must be positive and finite")

    def tasks(self) -> list[MovingTask]:
        """All encounters, those of a tracker that fails once for each `After`."""
        return [
            MovingTask(robot, told, speed, holds, run, after)
            for robot, told, speed, holds, run in itertools.product(
                ALL_COLUMNS + TWO_COLUMNS if self.robots is None else self.robots,
                self.told,
                self.speeds,
                (True, False),
                range(self.runs),
            )
            if self.robots is not None or robot not in TWO_COLUMNS or told in (Told.exact, Told.untold)
            for after in (After if told.fails else (None,))
        ]


@dataclass(frozen=True)
class MovingTask:
    """One encounter; holds: the arm is to stay where it is, else it gets a new goal every 1.5 s.

    after: what the obstacle does when its tracker fails; None: the tracker does not fail.
    """

    robot: str
    told: Told
    speed: float
    holds: bool
    run: int
    after: After | None = None

    def __post_init__(self) -> None:
        if (self.after is not None) != self.told.fails:
            raise ValueError(
                f"after is {self.after} and told {self.told}, allowed: None unless a tracker fails"
            )

    @property
    def name(self) -> str:
        """Unique in a campaign."""
        name = f"{self.robot} {self.told} {self.speed:g} {'holds' if self.holds else 'moves'} {self.run}"
        return f"{name} {self.after}" if self.after else name


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
            "after": task.after and task.after.value,
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

    def make(self, task: MovingTask, *, seed: int, teller: Teller | None = None) -> Encounter:
        """The encounter of a task.

        Args:
            task, seed: of which it is made.
            teller: makes what tells of the solid, of the solid and the fault; None: a `Tracker`.

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
        told_velocity = off * velocity if rng.uniform() < 0.5 else velocity + tilt
        if task.told is not Told.wrong:
            told_velocity = velocity if task.told.has_velocity else np.zeros(3)
        steps = round((distance + AFTER) / task.speed / PERIOD)
        lost = rng.uniform(size=steps // SEEN_EVERY + 1) < LOST
        lost[0] = False
        left = float(rng.uniform(*BEFORE))
        fault = None
        if task.after is not None:  # right after a set, the last that is true
            step = SEEN_EVERY * round((distance - left) / task.speed / PERIOD / SEEN_EVERY)
            fault = task.told.fault_at(step * PERIOD)
            if task.after is After.stands:
                solid = replace(solid, moves_during=(0.0, fault.begins))
                steps = max(steps, step + round(STANDS / PERIOD))
        tracker = Tracker(solid, task.told, told_velocity, lag, lost, fault)
        tells = (
            teller(solid, fault)
            if teller is not None
            else lambda controller, step, q: tracker.tell(controller, step)
        )

        def tell(controller: Controller, step: int, q: Array) -> None:
            if step == 0 and task.holds:
                controller.set_goal(start)
            if not task.holds and step % GOAL_EVERY == 0:
                controller.set_goal(goals[step // GOAL_EVERY])
            tells(controller, step, q)

        return Encounter(task.run, start, steps, (solid,), tell, fault=fault)

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


def _random_rotation(rng: np.random.Generator) -> Array:
    """Uniform: the orthogonal factor of a random matrix, with a positive determinant."""
    rotation, upper = np.linalg.qr(rng.normal(size=(3, 3)))
    rotation = rotation * np.sign(np.diag(upper))
    if np.linalg.det(rotation) < 0.0:
        rotation[:, 0] *= -1.0
    return np.asarray(rotation)


def moving_table(rows: Sequence[Row]) -> dict[str, dict[str, dict[str, Any]]]:
    """By robot and "told speed", of a tracker that fails "told after speed".

    Runs, contacts, those with a way out, and speeds of the arm at contact [rad/s]. Of a tracker that fails also times
    of contact after it failed [s], contacts later than the arm has to stand, and runs in which the status said so.
    """
    table: dict[str, dict[str, dict[str, Any]]] = {}
    for row in rows:
        column = " ".join(word for word in (row["told"], row["after"], f"{row['speed']:g}") if word)
        cell = table.setdefault(row["robot"], {}).setdefault(
            column, {"runs": 0, "contacts": 0, "with_way_out": 0, "self_contacts": 0, "contact_speeds": []}
        )
        cell["runs"] += 1
        cell["self_contacts"] += row["self_clearance_m"] <= 0.0
        touched = row["clearance_m"] <= 0.0
        if touched:
            cell["contacts"] += 1
            cell["with_way_out"] += row["way_out"] is True
            cell["contact_speeds"].append(round(row["contact_speed"], 2))
        if row["after"]:
            for name in ("late_contacts", "said"):
                cell.setdefault(name, 0)
            cell.setdefault("contacts_after_fault_s", [])
            cell["late_contacts"] += row["late_contact_speed"] is not None
            cell["said"] += row["said"] is not None
            if touched:
                cell["contacts_after_fault_s"].append(round(row["contact_after_fault_s"], 2))
    return table


def is_kept(column: str, cell: dict[str, Any]) -> bool:
    """Whether a cell of `moving_table` is as promised.

    No contact with a way out; none at all where the obstacle stands when its tracker fails; where it goes on, none with
    an arm that moves later than it has to stand.
    """
    if cell["self_contacts"]:
        return False
    if "late_contacts" not in cell:
        return bool(cell["with_way_out"] == 0)
    return bool(cell["contacts" if f" {After.stands} " in column else "late_contacts"] == 0)
