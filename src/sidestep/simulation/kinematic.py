"""Motion without physics: the dynamical system's own integration, recorded like a simulated run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt

from sidestep._core import AccelerationFilter, Escape, Evasion, GeometricSystem, PoseGoal, rollout
from sidestep.pose import pose_vector
from sidestep.robot import Robot
from sidestep.simulation.pose_aim import PoseAim
from sidestep.simulation.run import (
    Arrival,
    ArrivalWatch,
    KinematicRun,
    ObstacleSource,
    obstacles_over_time,
    status_name,
)
from sidestep.simulation.scene import SceneObject, check_scene

Array = npt.NDArray[np.float64]

CHUNK = 200  # steps between two looks at arrival and two calls of on_step, where obstacles move by themselves


def run_kinematically(
    robot: Robot,
    system: GeometricSystem,
    start: Array,
    goal: Array | PoseAim,
    duration: float,
    obstacles: ObstacleSource,
    *,
    objects: Sequence[SceneObject] = (),
    timestep: float = 1e-3,
    integrator: Literal["semi_implicit_euler", "second_order", "runge_kutta_4"] = "semi_implicit_euler",
    start_velocity: Array | None = None,
    arrival: Arrival | None = Arrival(),
    on_step: Callable[[float, Array], None] | None = None,
    safe: bool = False,
    escape: Escape | None = None,
    evasion: Evasion | None = None,
) -> KinematicRun:
    """Integrates the wanted acceleration itself, by the core's `rollout`: no masses, torques or contacts.

    Args:
        integrator: of the core; the rest as in `Simulation.run`. Free objects stay where they are.
        on_step: called with time [s] and q every now and then.
        safe: the acceleration keeps the clearances of the system's barriers and the limits (`AccelerationFilter`).

    Raises:
        ValueError: start or goal outside the limits, a duration or timestep that is not positive.
        RuntimeError: the integration diverged.
    """
    if not (np.isfinite(duration) and duration > 0.0 and np.isfinite(timestep) and timestep > 0.0):
        raise ValueError(f"duration and timestep must be finite and positive, got {duration} and {timestep}")
    scene = check_scene(objects)
    start = robot.check_configuration(start, "start")
    if not isinstance(goal, PoseAim):
        goal = robot.check_configuration(goal, "goal")
    see = obstacles_over_time(obstacles)
    watch = None if arrival is None else ArrivalWatch(goal, arrival)
    steps = max(1, round(duration / timestep))
    chunk = 1 if callable(obstacles) else CHUNK
    q, v = start, np.zeros_like(start) if start_velocity is None else np.asarray(start_velocity, dtype=float)
    columns: dict[str, list[Array]] = {
        name: [] for name in ("q", "v", "wanted", "achieved", "switch", "values")
    }
    statuses: list[str] = []
    guard = AccelerationFilter(robot, period=timestep) if safe else None
    if evasion is not None:
        evasion.reset()
    done, arrived = 0, False
    while done < steps and not arrived:
        count = min(chunk, steps - done)
        aim = goal.at(q) if isinstance(goal, PoseAim) else goal
        part = rollout(
            system,
            q,
            v,
            aim,
            see(done * timestep),
            period=timestep,
            steps=count,
            integrator=integrator,
            filter=guard,
            escape=None if isinstance(aim, PoseGoal) else escape,  # as under torque
            evasion=evasion,
        )
        if not (np.all(np.isfinite(part.q)) and np.all(np.isfinite(part.v))):
            raise RuntimeError(f"the integration diverged near {done * timestep:.3f} s; shorten the timestep")
        keep = count
        for k in range(count):
            if watch is not None and watch.update((done + k) * timestep, part.q[k], part.v[k]):
                keep, arrived = k + 1, True
                break
        achieved = np.diff(part.v, axis=0) / timestep
        rows = (part.q, part.v, part.acceleration, achieved, part.switch, part.values)
        for name, column in zip(columns, rows, strict=True):
            columns[name].append(column[:keep])
        statuses += [status_name(status) for status in part.statuses[:keep]]
        q, v = part.q[count], part.v[count]
        if on_step is not None:
            on_step((done + keep - 1) * timestep, part.q[keep - 1])
        done += keep
    time = np.arange(done, dtype=np.float64) * timestep
    poses = np.tile(np.array([pose_vector(item.pose) for item in scene]).reshape(-1, 7), (done, 1, 1))
    for j, item in enumerate(scene):
        if item.motion == "moving":
            poses[:, j, :3] = [item.pose_at(t)[:3, 3] for t in time]
    return KinematicRun(
        robot=robot,
        objects=scene,
        start=start,
        goal=columns["q"][-1][-1] if isinstance(goal, PoseAim) else goal,
        pose=goal if isinstance(goal, PoseAim) else None,
        timestep=timestep,
        time=time,
        arrived=arrived,
        time_to_goal=watch.since if watch is not None and arrived else None,
        system_status=tuple(statuses),
        object_poses=poses,
        **{name: np.concatenate(parts) for name, parts in columns.items()},
    )
