"""A ball or a capsule that comes at an arm, seen through simulated depth cameras alone."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import Controller
from sidestep.bench.camera_rig import CameraRig, RigSettings, cameras_around, room
from sidestep.bench.campaign import Row, run_campaign
from sidestep.bench.encounters import PERIOD, IdealPlant, Tell, TorquePlant, run_encounter
from sidestep.bench.moving import SPEEDS, MovingTask, maker_and_judge
from sidestep.bench.parallel import Progress
from sidestep.bench.sensor_fault import SensorFault
from sidestep.bench.sight_log import SightLog
from sidestep.bench.tracker import LOST, After, Told
from sidestep.bench.workspace import Workspace
from sidestep.distance import SceneObject
from sidestep.robot import Robot

AZIMUTHS = (math.radians(40.0), math.radians(220.0))  # of two cameras that face each other across the arm
TIMINGS = {"30Hz": (30.0, 0.05), "10Hz": (10.0, 0.15)}  # images per second and latency [s]
IN_VIEW = 0.3  # [s] for which something must have been in view before a contact counts


class Seen(StrEnum):
    """What goes wrong with the images."""

    noise = "noise"  #: noise of a D435 alone
    lost30 = "lost30"  #: 30 % of the images never arrive
    gone = "gone"  #: for 1 s the images show nothing where the obstacle is


@dataclass(frozen=True)
class CameraMovingSettings:
    """Which encounters.

    Attributes:
        robots, seen, timings, speeds: columns; timings are of `TIMINGS`. runs: in a cell, every second one with an arm
            that holds still. cameras: 1 or 2. size: of the images. torque, seed: see `MovingSettings`.

    Raises:
        ValueError: nothing to run, or a value that is not allowed.
    """

    robots: Sequence[str] = ("fr3", "ur10")
    seen: Sequence[Seen] = tuple(Seen)
    timings: Sequence[str] = tuple(TIMINGS)
    speeds: Sequence[float] = SPEEDS
    runs: int = 6
    cameras: int = 2
    size: str = "424x240"
    torque: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        if self.runs < 1 or not (self.robots and self.seen and self.timings and self.speeds):
            raise ValueError(
                "there is nothing to run: robots, seen, timings, speeds and runs must not be empty"
            )
        for timing in self.timings:
            if timing not in TIMINGS:
                raise ValueError(f"timing is {timing!r}, allowed: {', '.join(TIMINGS)}")
        for speed in self.speeds:
            if not (np.isfinite(speed) and speed > 0.0):
                raise ValueError(f"speed is {speed} m/s, must be positive and finite")
        if not 1 <= self.cameras <= len(AZIMUTHS):
            raise ValueError(f"cameras is {self.cameras}, allowed: 1 to {len(AZIMUTHS)}")

    def tasks(self) -> list[CameraMovingTask]:
        """All encounters."""
        return [
            CameraMovingTask(robot, seen, timing, speed, run)
            for robot, timing, seen, speed, run in itertools.product(
                self.robots, self.timings, self.seen, self.speeds, range(self.runs)
            )
        ]

    def rig(self, task: CameraMovingTask) -> RigSettings:
        """How a task is seen."""
        rate, latency = TIMINGS[task.timing]
        lost = LOST if task.seen is Seen.lost30 else 0.0
        return RigSettings(AZIMUTHS[: self.cameras], self.size, rate, latency, lost)


@dataclass(frozen=True)
class CameraMovingTask:
    """One encounter; with an even run the arm is to stay where it is, else it gets a new goal every 1.5 s."""

    robot: str
    seen: Seen
    timing: str
    speed: float
    run: int

    @property
    def name(self) -> str:
        """Unique in a campaign."""
        return f"{self.robot} {self.timing} {self.seen} {self.speed:g} {self.run}"

    @property
    def holds(self) -> bool:
        """The arm is to stay where it is."""
        return self.run % 2 == 0

    @property
    def moving(self) -> MovingTask:
        """The same encounter of `sidestep bench moving`."""
        is_gone = self.seen is Seen.gone
        told, after = (Told.vanished_untold, After.goes_on) if is_gone else (Told.untold, None)
        return MovingTask(self.robot, told, self.speed, self.holds, self.run // 2, after)


def run_camera_moving(
    settings: CameraMovingSettings,
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
        settings={"bench": "camera-moving", **asdict(settings)},
        file=file,
        shard=shard,
        jobs=jobs,
        progress=progress,
    )


class EncounterView:
    """What tells a controller of an encounter by images alone.

    Args:
        robot: the arm. settings: of the cameras. seed: of their noise.
    """

    def __init__(self, robot: Robot, settings: RigSettings, *, seed: int) -> None:
        self._robot, self._settings, self._seed = robot, settings, seed
        self._rig: CameraRig | None = None

    def tell(self, solid: SceneObject, fault: SensorFault | None) -> Tell:
        """Makes what looks at a solid; it vanishes from the images while the fault lasts."""
        base = self._robot.pose(self._robot.neutral, self._robot.links[0].name)[:3, 3]
        rig = CameraRig(
            self._robot,
            (solid, *room(base, Workspace.of(self._robot).reach)),
            cameras_around(self._robot, self._settings),
            self._settings,
            seed=self._seed,
            watch=lambda image: self.log.add(image),
            hidden=solid.name,
            hidden_during=(math.inf, math.inf) if fault is None else (fault.begins, fault.ends),
        )
        owners = {name: geom for geom, (role, name) in rig.built.geom_owner.items() if role == "object"}
        self.log = SightLog(owners[solid.name], {camera.name: camera.far for camera in rig.cameras})
        self._rig = rig

        def tell(controller: Controller, step: int, q: npt.NDArray[np.float64]) -> None:
            if step == 0:
                rig.start(controller)
            rig.see(step * PERIOD, q)

        return tell

    @property
    def rig(self) -> CameraRig:
        """The cameras; after `tell`."""
        assert self._rig is not None
        return self._rig

    def __enter__(self) -> EncounterView:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.rig.close()


class _Worker:
    def __init__(self, settings: CameraMovingSettings) -> None:
        self._settings = settings

    def run(self, task: CameraMovingTask) -> Row:
        maker, judge = maker_and_judge(task.robot)
        settings, rigged = self._settings, self._settings.rig(task)
        view = EncounterView(maker.robot, rigged, seed=task.run)
        encounter = maker.make(task.moving, seed=settings.seed, teller=view.tell)
        with view:
            plant = (
                TorquePlant(maker.robot, encounter.start) if settings.torque else IdealPlant(encounter.start)
            )
            output = "torque" if settings.torque else "acceleration"
            course = run_encounter(maker.arm, encounter, output=output, plant=plant)
        verdict = judge.judge(encounter, course)
        contact = verdict.contact_s
        gap = 2.0 / rigged.rate + 1e-6 if task.seen is not Seen.lost30 else 4.0 / rigged.rate + 1e-6
        in_view = None if contact is None else view.log.in_view_before(contact, gap=gap)
        told = {key: getattr(task, key) for key in ("robot", "timing", "speed", "run", "holds")}
        return {
            "name": task.name,
            "seen": task.seen.value,
            **told,
            "in_view_s": in_view,
            "first_seen_s": view.log.first_seen,
            "counts": in_view is not None and in_view >= IN_VIEW,
            **asdict(verdict),
        }


def camera_moving_table(rows: Sequence[Row]) -> dict[str, dict[str, dict[str, Any]]]:
    """By robot and "timing seen speed".

    Runs; contacts; those with a way out; of them those of what was in view for 0.3 s before (`kept` is without); speeds
    of the arm at contact [rad/s], and a sentence for each contact with a way out.
    """
    table: dict[str, dict[str, dict[str, Any]]] = {}
    for row in rows:
        column = f"{row['timing']} {row['seen']} {row['speed']:g}"
        cell = table.setdefault(row["robot"], {}).setdefault(
            column,
            {
                "runs": 0,
                "contacts": 0,
                "with_way_out": 0,
                "in_view": 0,
                "self_contacts": 0,
                "contact_speeds": [],
                "cases": [],
            },
        )
        cell["runs"] += 1
        cell["self_contacts"] += row["self_clearance_m"] <= 0.0
        if row["clearance_m"] <= 0.0:
            cell["contacts"] += 1
            cell["contact_speeds"].append(round(row["contact_speed"], 2))
            if row["way_out"]:
                cell["with_way_out"] += 1
                cell["in_view"] += row["counts"]
                cell["cases"].append(
                    f"run {row['run']}: {row['pair']} at {row['contact_s']:.2f} s, in view for "
                    f"{row['in_view_s']:.2f} s before, the status was {row['before_contact']}"
                )
    return table
