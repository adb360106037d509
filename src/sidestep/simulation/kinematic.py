"""Motion without physics: accelerations integrated, recorded like a simulated run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import real_array
from sidestep.distance.scene import Scene, check_scene
from sidestep.math.pose import pose_vector
from sidestep.robot import Robot
from sidestep.simulation.adapter import KinematicAdapter
from sidestep.simulation.pose_target import PoseTarget
from sidestep.simulation.run import Arrival, ArrivalWatch, KinematicRun

Array = npt.NDArray[np.float64]

CHUNK = 200  # steps between two calls of on_step
_COLUMNS = ("q", "v", "wanted", "achieved", "switch", "values", "system_status")


def run_kinematically(
    robot: Robot,
    driver: KinematicAdapter,
    start: Array,
    goal: Array | PoseTarget,
    duration: float,
    *,
    objects: Scene = (),
    timestep: float = 1e-3,
    start_velocity: Array | None = None,
    arrival: Arrival | None = Arrival(),
    on_step: Callable[[float, Array], None] | None = None,
) -> KinematicRun:
    """Integrates accelerations themselves: no masses, torques or contacts.

    Args:
        driver: what moves the arm: `ControllerAdapter`, or the thesis's `SystemAdapter`.
        start, goal, duration, start_velocity, arrival: as in `Simulation.run`. Free objects stay where they are.
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
    watch = None if arrival is None else ArrivalWatch(goal, arrival, robot)
    steps = max(1, round(duration / timestep))
    columns: dict[str, list[Any]] = {name: [] for name in _COLUMNS}
    arrived, done = False, 0
    for q, velocity, achieved, step in driver.integrate(start, v, steps, timestep):
        if not (np.isfinite(q).all() and np.isfinite(velocity).all()):
            raise RuntimeError(f"the integration diverged near {done * timestep:.3f} s; shorten the timestep")
        row = q, velocity, step.wanted, achieved, step.switch, step.values, step.system_status
        for name, value in zip(_COLUMNS, row, strict=True):
            columns[name].append(value)
        if on_step is not None and done % CHUNK == 0:
            on_step(done * timestep, q)
        done += 1
        if watch is not None and watch.update((done - 1) * timestep, q, velocity):
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
