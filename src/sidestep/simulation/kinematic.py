"""Motion without physics: accelerations integrated, recorded like a simulated run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from sidestep._core import GeometricSystem, JointGoal, Obstacles, PoseGoal, real_array, rollout
from sidestep.distance.scene import Scene, check_scene
from sidestep.robot import Robot
from sidestep.robot.pose import pose_vector
from sidestep.simulation.driver import ControllerDriver
from sidestep.simulation.pose_aim import PoseAim, PoseTarget
from sidestep.simulation.run import (
    Arrival,
    ArrivalWatch,
    KinematicRun,
    ObstacleSource,
    obstacles_over_time,
    status_name,
)

Array = npt.NDArray[np.float64]

CHUNK = 200  # steps between two calls of on_step, and of one rollout where obstacles move by themselves


def run_kinematically(
    robot: Robot,
    mover: GeometricSystem | ControllerDriver,
    start: Array,
    goal: Array | PoseTarget,
    duration: float,
    obstacles: ObstacleSource | None = None,
    *,
    objects: Scene = (),
    timestep: float = 1e-3,
    integrator: Literal["semi_implicit_euler", "second_order", "runge_kutta_4"] = "semi_implicit_euler",
    start_velocity: Array | None = None,
    arrival: Arrival | None = Arrival(),
    on_step: Callable[[float, Array], None] | None = None,
) -> KinematicRun:
    """Integrates accelerations themselves: no masses, torques or contacts.

    Args:
        mover: a `ControllerDriver`, whose goal and obstacles it has, by semi-implicit Euler; or a geometric system,
            by the core's `rollout`.
        start, goal, duration, start_velocity, arrival: as in `Simulation.run`. Free objects stay where they are.
        obstacles: what a geometric system sees.
        integrator: of the core, for a geometric system.
        on_step: called with time [s] and q every now and then.

    Raises:
        ValueError: start or goal outside the limits, a duration or timestep that is not positive.
        RuntimeError: the integration diverged.
    """
    if not (np.isfinite(duration) and duration > 0.0 and np.isfinite(timestep) and timestep > 0.0):
        raise ValueError(f"duration and timestep must be finite and positive, got {duration} and {timestep}")
    scene = check_scene(objects)
    start = robot.check_configuration(start, "start")
    if not isinstance(goal, PoseTarget):
        goal = robot.check_configuration(goal, "goal")
    v = np.zeros_like(start) if start_velocity is None else real_array(start_velocity, "start_velocity")
    watch = None if arrival is None else ArrivalWatch(goal, arrival)
    steps = max(1, round(duration / timestep))
    if isinstance(mover, GeometricSystem):
        if obstacles is None:
            raise ValueError(
                "obstacles: a geometric system is told what it sees, Obstacles.none() in free space"
            )
        rows = _rolled_out(mover, start, v, goal, obstacles_over_time(obstacles), steps, timestep, integrator,
                           1 if callable(obstacles) else CHUNK)  # fmt: skip
    else:
        rows = _driven(mover, start, v, steps, timestep)
    columns: dict[str, list[Any]] = {name: [] for name in _COLUMNS}
    arrived, done = False, 0
    for row in rows:
        if not (np.isfinite(row[0]).all() and np.isfinite(row[1]).all()):
            raise RuntimeError(f"the integration diverged near {done * timestep:.3f} s; shorten the timestep")
        for name, value in zip(_COLUMNS, row, strict=True):
            columns[name].append(value)
        if on_step is not None and done % CHUNK == 0:
            on_step(done * timestep, row[0])
        done += 1
        if watch is not None and watch.update((done - 1) * timestep, row[0], row[1]):
            arrived = True
            break
    time = np.arange(done, dtype=np.float64) * timestep
    poses = np.tile(np.array([pose_vector(item.pose) for item in scene]).reshape(-1, 7), (done, 1, 1))
    for j, item in enumerate(scene):
        if item.motion == "moving":
            poses[:, j, :3] = [item.pose_at(t)[:3, 3] for t in time]
    return KinematicRun(
        robot=robot,
        objects=scene,
        start=start,
        goal=columns["q"][-1] if isinstance(goal, PoseTarget) else goal,
        pose=goal if isinstance(goal, PoseTarget) else None,
        timestep=timestep,
        time=time,
        arrived=arrived,
        time_to_goal=watch.since if watch is not None and arrived else None,
        system_status=tuple(columns.pop("system_status")),
        object_poses=poses,
        **{name: np.array(column, dtype=float) for name, column in columns.items()},
    )


_COLUMNS = ("q", "v", "wanted", "achieved", "switch", "values", "system_status")


def _driven(
    driver: ControllerDriver, q: Array, v: Array, steps: int, period: float
) -> Iterator[tuple[Any, ...]]:
    for k in range(steps):
        step = driver.drive(k * period, q, v)
        yield q, v, step.wanted, step.acceleration, step.switch, step.values, step.system_status
        v = v + period * step.acceleration
        q = q + period * v


def _rolled_out(
    system: GeometricSystem,
    q: Array,
    v: Array,
    goal: Array | PoseTarget,
    see: Callable[[float], Obstacles],
    steps: int,
    period: float,
    integrator: str,
    chunk: int,
) -> Iterator[tuple[Any, ...]]:
    for done in range(0, steps, chunk):
        count = min(chunk, steps - done)
        part = rollout(
            system,
            q,
            v,
            _attractor(goal, q),
            see(done * period),
            period=period,
            steps=count,
            integrator=integrator,
        )
        achieved = np.diff(part.v, axis=0) / period
        for k in range(count):
            status = status_name(part.statuses[k])
            yield (
                part.q[k],
                part.v[k],
                part.acceleration[k],
                achieved[k],
                part.switch[k],
                part.values[k],
                status,
            )
        q, v = part.q[count], part.v[count]


def _attractor(goal: Array | PoseTarget, q: Array) -> Array | JointGoal | PoseGoal:
    if isinstance(goal, PoseAim):
        return goal.at(q)
    return goal.goal if isinstance(goal, PoseTarget) else goal
