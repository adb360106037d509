"""Moves an arm by what simulated cameras show, and nothing else."""

from __future__ import annotations

import math
from dataclasses import KW_ONLY, dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import Controller, ControllerSettings
from sidestep.arm import Arm as ControllerArm
from sidestep.bench.arm import Arm
from sidestep.bench.camera_rig import CameraRig, RigSettings, cameras_around, room
from sidestep.bench.motion import Columns, Motion, MotionSettings
from sidestep.bench.problem import SceneProblem
from sidestep.bench.sight_log import SurfaceLog
from sidestep.bench.workspace import Workspace
from sidestep.loop import ModelLoop

Array = npt.NDArray[np.float64]

OVER_SHOULDER = (math.radians(125.0), math.radians(-125.0))  # of cameras, from the direction of the scene
LOOK_FIRST = 0.5  # [s] for which the arm rests and looks before it gets its goal
CHUNK = 100  # steps between two looks at arrival


@dataclass(frozen=True, eq=False)
class Sighted:
    """A run through cameras, and what was believed at its end.

    Attributes:
        motion: from when the arm got its goal. log: what of the surfaces was in view; times count from there.
        cells: see `Perception.cells`. unseen: (N, 3) [m] where nobody has looked. ended: activity and status.
        update_ms: for an image: median, 99 %.
    """

    motion: Motion
    log: SurfaceLog
    cells: dict[str, Any]
    unseen: Array
    ended: str
    update_ms: tuple[float, float]


@dataclass(frozen=True, eq=False)
class CameraRunner:
    """Moves an arm by a `Controller` that knows nothing but what cameras over its shoulders show.

    Attributes:
        arm: it. motion: how problems are run, integrated. cameras: 1 or 2. others: see `RigSettings`.
    """

    arm: Arm
    motion: MotionSettings
    _: KW_ONLY
    cameras: int
    size: str
    noise: str
    unseen_is_free: bool
    exact_poses: bool
    seed: int

    def move(self, problem: SceneProblem) -> Sighted:
        """Runs one problem: the arm looks around at rest, then gets its goal."""
        controller = Controller(
            ControllerArm.from_robot(self.arm.robot, self.arm.body),
            ControllerSettings(
                synchronous=True, seed=problem.index, period=self.motion.period, output="acceleration"
            ),
        )
        log = SurfaceLog(np.asarray(problem.obstacles.points, dtype=np.float64))
        with self._rig(problem, log) as rig:
            rig.start(controller)
            loop = _Loop(controller, rig, problem.start, self.motion.period)
            looks = round(LOOK_FIRST / self.motion.period)
            loop.rest(looks)
            controller.set_goal(problem.goal)
            columns = Columns(self.arm.robot, problem, self.motion)
            while count := columns.next_steps(CHUNK * self.motion.period):
                q, v, a = loop.run(count)
                columns.add(q, v, a, np.zeros(count), columns.near(q))
            return self._sighted(replace(columns.motion(problem), safe=True), controller, rig, log, looks)

    def _rig(self, problem: SceneProblem, log: SurfaceLog) -> CameraRig:
        robot = self.arm.robot
        space = Workspace.of(robot)
        middle = log.points.mean(axis=0)
        azimuth = math.atan2(middle[1] - space.shoulder[1], middle[0] - space.shoulder[0])
        settings = RigSettings(
            tuple(azimuth + side for side in OVER_SHOULDER[: self.cameras]),
            self.size,
            noise=self.noise,
            unseen_is_free=self.unseen_is_free,
            exact_poses=self.exact_poses,
        )
        base = robot.pose(robot.neutral, robot.links[0].name)[:3, 3]
        cameras = cameras_around(robot, settings, target=0.5 * (space.shoulder + middle))
        log.look_by(cameras)
        return CameraRig(
            robot,
            (*problem.objects, *room(base, space.reach)),
            cameras,
            settings,
            seed=self.seed + problem.index,
            watch=log.add,
        )

    def _sighted(
        self, motion: Motion, controller: Controller, rig: CameraRig, log: SurfaceLog, looks: int
    ) -> Sighted:
        assert rig.perception is not None
        log.first_seen -= looks * self.motion.period
        times = [1e3 * report.total_time for _, _, report in rig.reports if report.used]
        command = controller.command
        return Sighted(
            motion,
            log,
            {name: np.asarray(value) for name, value in rig.perception.cells().items()},
            np.asarray(rig.perception.unseen(), dtype=np.float64).reshape(-1, 3),
            "arrived" if motion.arrived else f"{command.activity.name}, {command.status.name}",
            (float(np.percentile(times, 50.0)), float(np.percentile(times, 99.0))),
        )


class _Loop:
    """See, step, integrate: v += a T, q += v T."""

    def __init__(self, controller: Controller, rig: CameraRig, start: Array, period: float) -> None:
        self._loop, self._rig, self._period = ModelLoop(controller), rig, period
        self._q, self._v, self._step = start, np.zeros_like(start), 0

    def rest(self, steps: int) -> None:
        """So many steps of an arm that stays where it is."""
        for _ in range(steps):
            self._command()

    def run(self, steps: int) -> tuple[Array, Array, Array]:
        """So many steps: q, v, a (steps, nv)."""
        rows = []
        for _ in range(steps):
            q, v, a = self._q, self._v, self._command()
            rows.append((q, v, a))
            self._v = v + self._period * a
            self._q = q + self._period * self._v
        q, v, a = (np.array(column) for column in zip(*rows, strict=True))
        return q, v, a

    def _command(self) -> Array:
        now = self._step * self._period
        self._step += 1
        self._rig.see(now, self._q)
        return np.array(self._loop.cycle(self._q, self._v, time=now).acceleration)
