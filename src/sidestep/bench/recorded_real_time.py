"""Motions that are recorded by the machine's clock, with planner, look-ahead and posture search in their threads."""

from __future__ import annotations

from collections.abc import Callable
from time import sleep

import numpy as np

from sidestep._core import Controller, ControllerSettings, Loop, Obstacles, PoseGoal
from sidestep.bench.recorded_motions import Array, pose_at_point, ready_arm, table
from sidestep.drivers import Ideal
from sidestep.obstacles import Cylinder

DURATION = 2.0  # [s]


def _run(controller: Controller, q: Array, v: Array, act: Callable[[float], None]) -> None:
    """Steps by the machine's clock, with planner, look-ahead and posture search in their threads."""
    run = Loop(controller, Ideal(controller.arm, q, v=v), duration=DURATION)
    act(0.0)
    run.start()
    seen = 1
    while not run.is_stopping:
        act(0.033 * seen)
        seen += 1
        sleep(0.033)
    run.finish()


def among_balls() -> None:
    arm, q, v = ready_arm()
    controller = Controller(arm, ControllerSettings())
    controller.set_goal(q + np.array([1.2, 0.2, 0.0, 0.3, 0.0, 0.0, 0.0]))
    start, way = np.array([0.5, 0.5, 0.4]), np.array([0.0, -0.3, 0.0])
    rest = np.array([[0.5, 0.35, 0.3], [0.45, 0.45, 0.55]])

    def act(time: float) -> None:
        points = np.vstack([rest, start + time * way])
        controller.set_obstacles(Obstacles(points, radii=0.06, velocities=np.vstack([np.zeros((2, 3)), way])))

    _run(controller, q, v, act)


def to_a_pose() -> None:
    arm, q, v = ready_arm()
    controller = Controller(arm, ControllerSettings())
    controller.set_obstacles(table())
    pose = arm.robot.pose(q + np.array([0.8, 0.3, 0.0, 0.4, 0.0, 0.1, 0.0]), "fr3_hand")
    controller.set_goal(PoseGoal(arm.robot, "fr3_hand", pose))
    _run(controller, q, v, lambda _: None)


def with_a_held_object() -> None:
    arm, q, v = ready_arm()
    controller = Controller(arm, ControllerSettings())
    controller.set_obstacles(table())
    controller.set_goal(q + np.array([0.8, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0]))
    held = [False]

    def act(time: float) -> None:
        if time > 0.5 and not held[0]:
            held[0] = True
            controller.attach(
                "rod",
                Cylinder(0.02, 0.2),
                link="fr3_hand",
                pose=pose_at_point(0.0, 0.0, 0.2),
                mass=0.2,
                may_touch=["fr3_leftfinger", "fr3_rightfinger"],
            )
            controller.set_goal(q + np.array([0.3, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0]))

    _run(controller, q, v, act)
