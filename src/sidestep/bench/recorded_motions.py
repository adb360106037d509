"""Motions of one arm that are recorded: inputs, outputs, disturbances, held objects."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import (
    Controller,
    ControllerSettings,
    JointGoal,
    Obstacles,
    PoseGoal,
    SpeedLimitSettings,
    TrackingSettings,
)
from sidestep.arm import Arm
from sidestep.obstacles import Box, Cylinder, obstacles_from_shapes

Array = npt.NDArray[np.float64]

RUN_SECONDS = 1.5  # [s]
SEEN_EVERY = 33  # [steps] between two sets of moving obstacles, as from a camera at 30 Hz
NOISE = 1e-4  # [rad] standard deviation of measured positions, where a run has any


def steps_in(seconds: float, period: float = 0.001) -> int:
    return round(seconds / period)


def controller_of(arm: Arm, **settings: Any) -> Controller:
    return Controller(arm, ControllerSettings(synchronous=True, **settings))


def ideal_step(controller: Controller, q: Array, v: Array) -> tuple[Array, Array]:
    """State after a step of an ideal robot, which tracks the command exactly."""
    command = controller.step(q, v)
    if controller.settings.output.name in ("position", "velocity"):
        return command.position, command.velocity
    v = v + controller.settings.period * command.acceleration
    return q + controller.settings.period * v, v


def ready_arm() -> tuple[Arm, Array, Array]:
    return Arm.load("fr3"), np.array([0.0, -0.4, 0.0, -2.2, 0.0, 1.9, 0.785]), np.zeros(7)


def table() -> Obstacles:
    return obstacles_from_shapes([Box((0.6, 0.8, 0.04), pose=pose_at_point(0.55, 0.0, 0.1), name="table")])


def pose_at_point(x: float, y: float, z: float) -> Array:
    X = np.eye(4)
    X[:3, 3] = x, y, z
    return X


def drive(name: str, output: str) -> None:
    """Random velocities among 25 balls, of which half move; the state is that of an ideal robot."""
    arm, rng = Arm.load(name), np.random.default_rng(7)
    controller = controller_of(arm, output=output)
    nv, q, v = arm.num_coordinates, arm.neutral, np.zeros(arm.num_coordinates)
    velocities = np.where(np.arange(25)[:, None] % 2 == 0, rng.normal(0.0, 0.2, (25, 3)), 0.0)
    points = rng.uniform(-0.9, 0.9, (25, 3)) + np.array([0.0, 0.0, 0.4])
    points = points[np.linalg.norm(points[:, :2], axis=1) > 0.35]
    velocities = velocities[: len(points)]
    limits = np.minimum(arm.robot.limits.velocity, 2.0)
    for k in range(steps_in(RUN_SECONDS)):
        if k % 250 == 0:
            controller.set_velocity(rng.uniform(-1.0, 1.0, nv) * limits)
        if k % SEEN_EVERY == 0:
            controller.set_obstacles(
                Obstacles(points + 0.001 * k * velocities, radii=0.06, velocities=velocities)
            )
        q, v = ideal_step(controller, q, v)


def twist() -> None:
    arm, q, v = ready_arm()
    controller = controller_of(arm)
    controller.set_obstacles(table())
    for k in range(steps_in(RUN_SECONDS)):
        if k % 100 == 0:
            angle = 0.01 * k
            controller.set_twist(
                "fr3_hand",
                [0.15 * np.cos(angle), 0.15 * np.sin(angle), -0.1, 0.0, 0.3, 0.0],
                local=k % 200 == 0,
            )
        q, v = ideal_step(controller, q, v)


def trajectory() -> None:
    arm, q, v = ready_arm()
    times = np.linspace(0.2, 1.2, 11)
    rows = q + 0.5 * np.sin(2.0 * times)[:, None] * np.array([1.0, 0.3, 0.0, 0.2, 0.0, 0.0, 1.0])
    for behaviour in ("keep_path", "steer"):
        controller = controller_of(arm)
        controller.set_obstacles(table())
        controller.set_trajectory(rows, times, behaviour)
        at, moving = q, v
        for _ in range(steps_in(RUN_SECONDS)):
            at, moving = ideal_step(controller, at, moving)


def moving_goal() -> None:
    arm, q, v = ready_arm()
    controller = controller_of(arm)
    controller.set_obstacles(table())
    hand = arm.robot.pose(q, "fr3_hand")
    for k in range(steps_in(RUN_SECONDS)):
        if k == 0:
            controller.set_goal(JointGoal(q, velocity=np.full(7, 0.1)))
        if k == 500:
            controller.set_goal(PoseGoal(arm.robot, "fr3_hand", hand, twist=[0.1, 0.05, 0.0, 0.0, 0.0, 0.2]))
        if k == 1000:
            controller.clear_goal()
        q, v = ideal_step(controller, q, v)


def disturbed(output: str) -> None:
    """A goal, measured states with noise and one push; with torque the arm's own mass matrix and bias."""
    arm, q, v = ready_arm()
    controller, rng = controller_of(arm, output=output), np.random.default_rng(3)
    controller.set_obstacles(table())
    controller.set_goal(q + np.array([0.6, 0.2, 0.0, 0.3, 0.0, 0.2, 0.0]))
    for k in range(steps_in(RUN_SECONDS)):
        push = 0.02 if 700 <= k < 720 else 0.0
        seen = q + rng.normal(0.0, NOISE, 7) + push
        if output == "torque" and k % 2 == 0:
            command = controller.step(seen, v, arm.mass_matrix(q), arm.bias(q, v))
        else:
            command = controller.step(seen, v)
        if output == "torque":
            v = v + 0.001 * command.acceleration
            q = q + 0.001 * v
        else:
            q, v = command.position, command.velocity


def impedance() -> None:
    arm, q, v = ready_arm()
    controller = controller_of(arm, output="torque", tracking=TrackingSettings(stiffness=0.5))
    controller.set_obstacles(Obstacles.none())
    controller.set_goal(q + 0.2)
    for _ in range(steps_in(RUN_SECONDS)):
        q, v = ideal_step(controller, q, v)


def speed_limits() -> None:
    arm, q, v = ready_arm()
    controller = controller_of(arm, speed_limits=SpeedLimitSettings())
    controller.set_obstacles(table())
    controller.set_goal(q + np.array([1.0, 0.3, 0.0, 0.2, 0.0, 0.0, 0.0]))
    for _ in range(steps_in(RUN_SECONDS)):
        q, v = ideal_step(controller, q, v)


def bad_states() -> None:
    """Values that are not finite, a leap, and a stale scene."""
    arm, q, v = ready_arm()
    controller = controller_of(arm, obstacle_timeout=0.5)
    controller.set_obstacles(table())
    controller.set_goal(q + 0.3)
    for k in range(steps_in(RUN_SECONDS)):
        if k in (200, 201):
            controller.step(np.full(7, np.nan), v)
        elif k == 300:
            controller.step(q + 0.5, v)
        else:
            q, v = ideal_step(controller, q, v)
        if k == 900:
            controller.set_obstacles(table())


def attach() -> None:
    """A cup that stands on a table is taken, lifted and let go; then another body."""
    arm, q, v = ready_arm()
    controller = controller_of(arm)
    hand = arm.robot.pose(q, "fr3_hand")
    cup = hand[:3, 3] + 0.12 * hand[:3, 2]
    top = cup[2] - 0.05
    table = Box((0.3, 0.3, 0.04), pose=pose_at_point(cup[0], cup[1], top - 0.021), name="table")
    controller.set_obstacles(obstacles_from_shapes([table]))
    lifted = q + np.array([0.0, -0.15, 0.0, 0.25, 0.0, 0.1, 0.0])
    for k in range(steps_in(RUN_SECONDS)):
        if k == 100:
            pose = np.linalg.inv(hand) @ pose_at_point(*cup)
            controller.attach(
                "cup",
                Cylinder(0.03, 0.1),
                link="fr3_hand",
                pose=pose,
                mass=0.3,
                may_touch=["fr3_leftfinger", "fr3_rightfinger"],
                rests_on=["table"],
            )
        if k == 200:
            controller.set_goal(lifted)
        if k == 1200:
            controller.detach("cup")
        if k == 1300:
            controller.set_arm(arm)
        q, v = ideal_step(controller, q, v)
