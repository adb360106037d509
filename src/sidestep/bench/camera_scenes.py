"""Published problems, seen through simulated depth cameras alone, beside the same with full knowledge."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from sidestep.bench.arm import Arms, load_robot
from sidestep.bench.camera_loss import Loss, LossFinder, told_outcome
from sidestep.bench.camera_runner import OVER_SHOULDER, CameraRunner
from sidestep.bench.campaign import Row, run_campaign
from sidestep.bench.method import Method
from sidestep.bench.methods import build_body
from sidestep.bench.motion import MotionSettings
from sidestep.bench.motion_bench_maker import MotionBenchMakerProblem
from sidestep.bench.parallel import Progress
from sidestep.bench.points import POINT_RADIUS, SPACING


@dataclass(frozen=True)
class CameraSceneSettings:
    """What is run.

    Attributes:
        robot: name for `Robot.named`. cameras: 1 or 2. unseen_is_free: see `PerceptionSettings`. size: of the images.
        noise: name of a noise model. exact_poses: see `RigSettings`. motion: how problems are run. seed: of the noise.

    Raises:
        ValueError: a number of cameras that is not allowed.
    """

    robot: str
    cameras: int = 1
    unseen_is_free: bool = True
    size: str = "848x480"
    noise: str = "d435"
    exact_poses: bool = False
    motion: MotionSettings = field(default_factory=MotionSettings)
    seed: int = 0

    def __post_init__(self) -> None:
        if not 1 <= self.cameras <= len(OVER_SHOULDER):
            raise ValueError(f"cameras is {self.cameras}, allowed: 1 to {len(OVER_SHOULDER)}")


def run_camera_scenes(
    settings: CameraSceneSettings,
    problems: Sequence[MotionBenchMakerProblem],
    *,
    file: Path | None = None,
    shard: tuple[int, int] = (1, 1),
    jobs: int = 1,
    progress: Progress | None = None,
) -> list[Row]:
    """A row for each problem; see `run_campaign`."""
    described = {
        "bench": "camera-scenes",
        "robot": settings.robot,
        "cameras": settings.cameras,
        "unseen_is_free": settings.unseen_is_free,
        "size": settings.size,
        "noise": settings.noise,
        "exact_poses": settings.exact_poses,
        "duration": settings.motion.duration,
        "seed": settings.seed,
    }
    return run_campaign(
        partial(_Worker, settings),
        list(problems),
        name=lambda problem: f"{problem.set} {problem.index}",
        settings=described,
        file=file,
        shard=shard,
        jobs=jobs,
        progress=progress,
    )


class _Worker:
    """What a process needs for any problem."""

    def __init__(self, settings: CameraSceneSettings) -> None:
        self._settings = settings
        robot = load_robot(settings.robot)
        self._arms = Arms(settings.robot, Method.controller, build_body(Method.controller, robot))

    def run(self, task: MotionBenchMakerProblem) -> Row:
        settings, arm = self._settings, self._arms.of(task)
        problem, _ = arm.problem(task, spacing=SPACING, point_radius=POINT_RADIUS)
        told = told_outcome(arm, problem, problem.obstacles, settings.motion)
        runner = CameraRunner(
            arm,
            settings.motion,
            cameras=settings.cameras,
            size=settings.size,
            noise=settings.noise,
            unseen_is_free=settings.unseen_is_free,
            exact_poses=settings.exact_poses,
            seed=settings.seed,
        )
        sighted = runner.move(problem)
        outcome = arm.judge.judge(problem, sighted.motion, settings.motion)
        finder = LossFinder(arm, problem, sighted, settings.motion)
        loss = None if outcome.success else finder.find(outcome)
        return {
            "name": f"{task.set} {task.index}",
            "set": task.set,
            "told_solved": told.success,
            "told_time_s": told.time_s,
            "solved": outcome.success,
            "time_s": outcome.time_s,
            "arrived": outcome.arrived,
            "reasons": outcome.reasons(),
            "ended": sighted.ended,
            "min_clearance_m": outcome.min_clearance_m,
            "loss": loss and loss[0].value,
            "why": loss and loss[1],
            "cells": len(sighted.cells["radii"]),
            "wrong_cells": int(finder.wrong.sum()),
            "overshoot_mm": finder.overshoot_mm(),
            "goal_clearance_m": problem.clearance.distance(problem.goal).distance,
            "seen_share": float(np.isfinite(sighted.log.first_seen).mean()),
            "update_ms": sighted.update_ms,
        }


def camera_scene_table(rows: Sequence[Row]) -> dict[str, dict[str, Any]]:
    """By set and of all: problems, solved with full knowledge and by cameras, and losses by their reason."""
    sets = list(dict.fromkeys(row["set"] for row in rows))
    parts = {name: [row for row in rows if row["set"] == name] for name in sets} | {"all": list(rows)}
    return {
        name: {
            "problems": len(part),
            "told_solved": sum(row["told_solved"] for row in part),
            "solved": sum(row["solved"] for row in part),
            "lost": dict(Counter(row["loss"] for row in part if row["loss"] and row["told_solved"])),
            "touched_what_was_seen": sum(row["loss"] == Loss.touched for row in part),
        }
        for name, part in parts.items()
    }
