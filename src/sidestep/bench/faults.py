"""Sensing and state faults: an arm among random solids that gets joint goals, while something is wrong."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import Controller, Obstacles
from sidestep.bench.campaign import Row, run_campaign
from sidestep.bench.encounters import (
    PERIOD,
    Encounter,
    IdealPlant,
    Plant,
    Sense,
    TorquePlant,
    as_it_is,
    run_encounter,
)
from sidestep.bench.limits_broken import Broken
from sidestep.bench.moving import ALL_COLUMNS, TWO_COLUMNS, EncounterMaker, maker_and_judge
from sidestep.bench.parallel import Progress
from sidestep.bench.tracker import SEEN_EVERY
from sidestep.distance import ExactClearance, SceneObject
from sidestep.obstacles import Box, Capsule, Shape, Sphere, obstacles_from_shapes, pose_at
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]
See = Callable[[np.random.Generator, Obstacles, int, Array], Obstacles]

SOLIDS = 25
FREE_AT_START = 0.05  # [m]
STEPS, GOAL_EVERY = 6000, 1500  # periods
BEYOND = ("beyond", "beyond_free", "beyond_near")  # what rows and tables say of broken limits
MOST_BEYOND = 2e-3  # [rad | m] beyond position limits that is promised
MOST_SPEED = 1.05  # velocity in free space that is promised, of the limit
FREEZE = (2, 51)  # periods for which a state stands still, or a step is left out


def _vanish(rng: np.random.Generator, cloud: Obstacles, frame: int, tip: Array) -> Obstacles:
    return Obstacles.none() if 60 < frame < 90 else cloud


def _flicker(rng: np.random.Generator, cloud: Obstacles, frame: int, tip: Array) -> Obstacles:
    kept = rng.uniform(size=len(cloud)) < 0.5
    return Obstacles(cloud.points[kept], cloud.radii[kept]) if frame % 2 else cloud


def _noise(rng: np.random.Generator, cloud: Obstacles, frame: int, tip: Array) -> Obstacles:
    return Obstacles(cloud.points + rng.normal(scale=0.005, size=cloud.points.shape), cloud.radii)


def _shift(rng: np.random.Generator, cloud: Obstacles, frame: int, tip: Array) -> Obstacles:
    return Obstacles(cloud.points + rng.normal(scale=0.015, size=3), cloud.radii)


def _phantom(rng: np.random.Generator, cloud: Obstacles, frame: int, tip: Array) -> Obstacles:
    if frame % 2 == 0:
        return cloud
    ghosts = tip + rng.normal(scale=0.06, size=(5, 3))
    return Obstacles(np.vstack([cloud.points, ghosts]), np.append(cloud.radii, np.full(5, 0.005)))


#: Sensing faults by name: the cloud that the controller gets in frame k.
SENSING: dict[str, See] = {
    "vanish": _vanish,
    "flicker": _flicker,
    "noise5mm": _noise,
    "shift15mm": _shift,
    "phantom": _phantom,
}


def _measurement(case: str, rng: np.random.Generator, num: int) -> Sense:
    """A faulty measurement by its name."""
    last: list[tuple[Array, Array]] = []
    left = [0]
    delayed: deque[tuple[Array, Array]] = deque()

    def noise(step: int, q: Array, v: Array) -> tuple[Array, Array]:
        return q + rng.normal(scale=1e-3, size=num), v + rng.normal(scale=2e-2, size=num)

    def quantised(step: int, q: Array, v: Array) -> tuple[Array, Array]:
        return np.round(q / 1e-3) * 1e-3, np.round(v / 1e-2) * 1e-2

    def frozen(step: int, q: Array, v: Array) -> tuple[Array, Array]:
        if left[0] > 0 and last:
            left[0] -= 1
            return last[0]
        if rng.uniform() < 0.01:
            left[0] = int(rng.integers(*FREEZE))
        last[:] = [(q.copy(), v.copy())]
        return q, v

    def missed(step: int, q: Array, v: Array) -> tuple[Array, Array] | None:
        if left[0] > 0:
            left[0] -= 1
            return None
        if rng.uniform() < 0.005:
            left[0] = int(rng.integers(*FREEZE))
        return q, v

    def spiked(step: int, q: Array, v: Array) -> tuple[Array, Array]:
        q = q.copy()
        if step % 400 == 399:
            q[rng.integers(num)] += 0.3
        return q, v

    def spiked_velocity(step: int, q: Array, v: Array) -> tuple[Array, Array]:
        v = v.copy()
        if step % 400 == 399:
            v[rng.integers(num)] += 3.0
        return q, v

    def not_a_number(step: int, q: Array, v: Array) -> tuple[Array, Array]:
        q = q.copy()
        if step % 500 == 499:
            q[rng.integers(num)] = np.nan
        return q, v

    def late(step: int, q: Array, v: Array) -> tuple[Array, Array]:
        delayed.append((q.copy(), v.copy()))
        return delayed[0] if len(delayed) <= 3 else delayed.popleft()

    def slow(step: int, q: Array, v: Array) -> tuple[Array, Array] | None:
        return (q, v) if step % EVERY[case] == 0 else None

    if case in EVERY:
        return slow
    return {
        "noise": noise,
        "quantised": quantised,
        "frozen": frozen,
        "missed": missed,
        "spike": spiked,
        "spike_v": spiked_velocity,
        "nan": not_a_number,
        "late3ms": late,
    }[case]


#: Periods between two calls, of cases in which the controller is called less often; it is told its period, or not.
EVERY = {
    **{"slow500Hz": 2, "slow250Hz": 4, "slow125Hz": 8},
    **{"told500Hz": 2, "told250Hz": 4, "told125Hz": 8},
}
STATE = ("noise", "quantised", "frozen", "missed", "spike", "spike_v", "nan", "late3ms", *EVERY)
PLANTS = ("payload2kg", "friction", "gravity5deg", "armature")
CASES = ("none", *SENSING, *STATE, *PLANTS)


@dataclass(frozen=True)
class FaultSettings:
    """Which faults.

    Attributes:
        robots: names. cases: see `CASES`. runs: of each case and robot. seed: of all.
        torque: in MuJoCo, else accelerations are carried out exactly, without the faults of plants.

    Raises:
        ValueError: a case that is none, or nothing to run.
    """

    robots: Sequence[str] = ALL_COLUMNS + TWO_COLUMNS
    cases: Sequence[str] = CASES
    runs: int = 2
    torque: bool = True
    seed: int = 0

    def __post_init__(self) -> None:
        for case in self.cases:
            if case not in CASES:
                raise ValueError(f"case is {case!r}, allowed: {', '.join(CASES)}")
        if self.runs < 1 or not self.robots or not self.cases:
            raise ValueError("there is nothing to run: robots, cases and runs must not be empty")


@dataclass(frozen=True)
class _Task:
    robot: str
    case: str
    index: int

    @property
    def name(self) -> str:
        return f"{self.robot} {self.case} {self.index}"


def run_faults(
    settings: FaultSettings,
    *,
    file: Path | None = None,
    shard: tuple[int, int] = (1, 1),
    jobs: int = 1,
    progress: Progress | None = None,
) -> list[Row]:
    """A row for each run; see `run_campaign`."""
    tasks = [
        _Task(robot, case, index)
        for case in settings.cases
        if settings.torque or case not in PLANTS
        for robot in settings.robots
        for index in range(settings.runs)
    ]
    return run_campaign(
        partial(_Worker, settings),
        tasks,
        name=lambda task: task.name,
        settings={"bench": "faults", **asdict(settings)},
        file=file,
        shard=shard,
        jobs=jobs,
        progress=progress,
    )


class _Worker:
    def __init__(self, settings: FaultSettings) -> None:
        self._settings = settings

    def run(self, task: _Task) -> Row:
        maker, judge = maker_and_judge(task.robot)
        encounter = fault_encounter(maker, task.case, task.index, seed=self._settings.seed)
        torque = self._settings.torque
        plant: Plant = (
            _torque_plant(maker.robot, encounter.start, task.case) if torque else IdealPlant(encounter.start)
        )
        output = "torque" if torque else "acceleration"
        course = run_encounter(maker.arm, encounter, output=output, plant=plant)
        return {
            "name": task.name,
            "robot": task.robot,
            "case": task.case,
            **asdict(judge.judge(encounter, course)),
        }


def fault_encounter(maker: EncounterMaker, case: str, index: int, *, seed: int) -> Encounter:
    """Joint goals every 1.5 s among 25 random solids, of which the controller gets a cloud at 30 Hz."""
    robot = maker.robot
    rng = np.random.default_rng((seed, sum(robot.name.encode()), index))
    start = robot.neutral.copy()
    shapes = _clutter(robot, rng, start)
    cloud = obstacles_from_shapes(shapes)
    goals = [maker.configuration(rng) for _ in range(STEPS // GOAL_EVERY + 1)]
    see = SENSING.get(case)
    link = robot.links[-1].name

    def tell(controller: Controller, step: int, q: Array) -> None:
        if step % GOAL_EVERY == 0:
            controller.set_goal(goals[step // GOAL_EVERY])
        if step % SEEN_EVERY == 0:
            tip = robot.pose(q, link)[:3, 3]
            frame = step // SEEN_EVERY
            controller.set_obstacles(cloud if see is None else see(rng, cloud, frame, tip))

    objects = tuple(SceneObject.from_shape(f"solid{k}", shape) for k, shape in enumerate(shapes))
    sense = _measurement(case, rng, robot.num_coordinates) if case in STATE else as_it_is
    period = PERIOD * EVERY[case] if case.startswith("told") else PERIOD
    return Encounter(index, start, STEPS, objects, tell, sense, period=period)


def _torque_plant(robot: Robot, start: Array, case: str) -> TorquePlant:
    def edit(model: Any) -> None:
        if case == "payload2kg":
            model.body_mass[model.nbody - 1] += 2.0
        elif case == "gravity5deg":
            model.opt.gravity[:] = 9.81 * np.array([np.sin(np.radians(5.0)), 0.0, -np.cos(np.radians(5.0))])
        elif case == "armature":
            model.dof_armature[:] = 0.1

    friction = case == "friction"
    return TorquePlant(
        robot,
        start,
        joint_friction=3.0 if friction else 0.0,
        joint_damping=2.0 if friction else 0.0,
        edit=edit,
    )


def _clutter(robot: Robot, rng: np.random.Generator, start: Array) -> list[Shape]:
    """Balls, boxes, plates of 4 mm and capsules around the arm, at least 5 cm from it at the start."""
    alone = ExactClearance(robot, ())
    reach = float(np.linalg.norm(robot.pose(robot.neutral, robot.links[-1].name)[:3, 3])) + 0.4
    found: list[Shape] = []
    while len(found) < SOLIDS:
        centre = rng.normal(size=3)
        centre *= rng.uniform(0.3, 1.0) * reach / np.linalg.norm(centre)
        centre[2] = abs(centre[2])
        pose = pose_at(centre)
        pose[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        pose[:3, 0] *= np.linalg.det(pose[:3, :3])
        kind = rng.integers(4)
        shape: Shape
        if kind == 0:
            shape = Sphere(float(rng.uniform(0.02, 0.1)), pose)
        elif kind == 1:
            shape = Box(rng.uniform(0.03, 0.2, 3).tolist(), pose)
        elif kind == 2:
            shape = Box((*rng.uniform(0.1, 0.4, 2), 0.004), pose)
        else:
            shape = Capsule(float(rng.uniform(0.01, 0.05)), float(rng.uniform(0.1, 0.4)), pose)
        if alone.among([SceneObject.from_shape("solid", shape)]).distance(start).distance >= FREE_AT_START:
            found.append(shape)
    return found


def fault_table(rows: Sequence[Row]) -> dict[str, dict[str, Any]]:
    """By case: runs, contacts, and steps beyond limits before them with the worst ratio (positions: [rad | m]).

    `beyond_free` and `beyond_near`: of them those in free space and near obstacles.
    """
    table: dict[str, dict[str, Any]] = {}
    for row in rows:
        cell = table.setdefault(
            row["case"],
            {"runs": 0, "contacts": 0, "silent": 0, "self_contacts": 0, **{name: {} for name in BEYOND}},
        )
        cell["runs"] += 1
        cell["contacts"] += row["clearance_m"] <= 0.0
        cell["silent"] += row["clearance_m"] <= 0.0 and row["before_contact"] in ("ok", "limited")
        cell["self_contacts"] += row["self_clearance_m"] <= 0.0
        for beyond in BEYOND:
            for name, (steps, worst) in row[beyond].items():
                before = cell[beyond].get(name, (0, 0.0))
                cell[beyond][name] = (before[0] + steps, max(before[1], worst))
    return table


def broken_promises(case: str, cell: dict[str, Any]) -> list[str]:
    """What of a cell of `fault_table` is not as promised: a contact, and of faults of the state also limits."""
    broken = [name for name in ("contacts", "self_contacts") if cell[name]]
    if case not in ("none", *STATE):
        return broken
    beyond, free = cell["beyond"], cell["beyond_free"]
    broken += ["commanded position"] if "commanded position" in beyond else []
    broken += ["position"] if _worst(beyond, "position") > MOST_BEYOND else []
    broken += ["velocity in free space"] if _worst(free, "velocity") > MOST_SPEED else []
    return broken + (["torque rate in free space"] if "torque rate" in free else [])


def _worst(broken: Broken, name: str) -> float:
    return broken[name][1] if name in broken else 0.0
