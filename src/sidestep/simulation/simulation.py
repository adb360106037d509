"""Torque control of the arm in MuJoCo's rigid-body physics."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import real_array
from sidestep.distance.scene import Scene, check_scene
from sidestep.robot import Robot
from sidestep.simulation.adapter import Adapter
from sidestep.simulation.model import build_model
from sidestep.simulation.physics import Physics
from sidestep.simulation.pose_target import PoseTarget
from sidestep.simulation.run import Arrival, ArrivalWatch, Contact, SimulationRun

Array = npt.NDArray[np.float64]


class Simulation:
    """One robot among objects in MuJoCo, driven by torque at a fixed rate.

    Args:
        robot: with inertias and collision meshes.
        objects: the scene: fixed, free and moving solids. See `build_model` for what touches what.
        timestep: control period [s].
        substeps: physics steps per control period; the torque is held over them.
        floor_height, joint_damping, joint_friction, visuals: see `build_model`.

    Raises:
        ValueError: see `build_model`; or substeps < 1.
    """

    def __init__(
        self,
        robot: Robot,
        objects: Scene = (),
        *,
        timestep: float = 1e-3,
        substeps: int = 1,
        floor_height: float | None = None,
        joint_damping: float = 0.0,
        joint_friction: float = 0.0,
        visuals: bool = True,
    ) -> None:
        if substeps < 1:
            raise ValueError(f"substeps must be at least 1, got {substeps}")
        self.robot = robot
        self.objects = check_scene(objects)
        self.timestep = timestep
        self.substeps = substeps
        self.built = build_model(
            robot,
            self.objects,
            timestep=timestep / substeps,
            floor_height=floor_height,
            joint_damping=joint_damping,
            joint_friction=joint_friction,
            visuals=visuals,
        )

    def run(
        self,
        driver: Adapter,
        start: Array,
        goal: Array | PoseTarget,
        duration: float,
        *,
        start_velocity: Array | None = None,
        arrival: Arrival | None = Arrival(),
        on_step: Callable[[float, Array], None] | None = None,
    ) -> SimulationRun:
        """Runs the loop: state, torque, physics, record.

        Args:
            driver: what turns states into torque: `ControllerAdapter`, or the thesis's `SystemAdapter`. It never sees
                `objects`.
            start, goal: (nv,) configurations inside the limits; the goal, perhaps a pose, is what arrival is
                measured by: the driver has its own.
            duration: at most this long [s].
            start_velocity: (nv,), at rest by default.
            arrival: when to stop early; None: run the whole duration.
            on_step: called with time [s] and q after every step.

        Raises:
            ValueError: start or goal outside the limits, a duration that is not positive.
            RuntimeError: the physics diverged (MuJoCo's own check).
        """
        if not (np.isfinite(duration) and duration > 0.0):
            raise ValueError(f"duration must be positive, got {duration}")
        start = self.robot.check_configuration(start, "start")
        if not isinstance(goal, PoseTarget):
            goal = self.robot.check_configuration(goal, "goal")
        built = self.built
        physics = Physics(built, self.objects, period=self.timestep, substeps=self.substeps)
        physics.begin(
            start,
            np.zeros_like(start) if start_velocity is None else real_array(start_velocity, "start_velocity"),
        )
        watch = None if arrival is None else ArrivalWatch(goal, arrival, self.robot)
        steps = max(1, round(duration / self.timestep))
        rows: dict[str, list[Any]] = {name: [] for name in _COLUMNS}
        contacts: list[Contact] = []
        arrived = False
        for k in range(steps):
            time = k * self.timestep
            q, v = physics.measure(time)
            step = driver.drive(time, q, v, built.mass_matrix(physics.data), built.bias(physics.data))
            poses = physics.object_poses()
            v_next, touched = physics.advance(step.torque, time)
            contacts.extend(touched)
            row = (
                time,
                q,
                v,
                step.wanted,
                (v_next - v) / self.timestep,
                step.switch,
                step.values,
                step.system_status,
                poses,
                step.acceleration,
                step.torque,
                step.controller_status,
            )
            for name, value in zip(_COLUMNS, row, strict=True):
                rows[name].append(value)
            if on_step is not None:
                on_step(time, q)
            if watch is not None and watch.update(time, q, v):
                arrived = True
                break
        return SimulationRun(
            robot=self.robot,
            objects=self.objects,
            start=start,
            goal=rows["q"][-1] if isinstance(goal, PoseTarget) else goal,
            pose=goal if isinstance(goal, PoseTarget) else None,
            timestep=self.timestep,
            arrived=arrived,
            time_to_goal=watch.since if watch is not None and arrived else None,
            contacts=tuple(contacts),
            system_status=tuple(rows.pop("system_status")),
            controller_status=tuple(rows.pop("controller_status")),
            **{name: np.array(column, dtype=float) for name, column in rows.items()},
        )


_COLUMNS = (
    "time",
    "q",
    "v",
    "wanted",
    "achieved",
    "switch",
    "values",
    "system_status",
    "object_poses",
    "solved",
    "torque",
    "controller_status",
)
