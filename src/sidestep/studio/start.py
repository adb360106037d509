"""What is on the stage when the studio opens."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sidestep.robot import Robot, tip_of
from sidestep.scenario import Scenario
from sidestep.scenario.assembly import load_robot
from sidestep.scenario.scenario import JointState, Obstacle, RobotConfig
from sidestep.shapes import Sphere

Array = npt.NDArray[np.float64]

DEFAULT_ROBOT = "fr3"
TURN = 1.6  # [rad] of the first joint between start and goal
BEND = 0.6  # [rad] of the second joint: a stretched arm cannot tell which way to fold
BALL = 0.06  # [m] radius of the ball beside the way
BESIDE = 0.10  # [m] between the ball and the way of the tip: the arm goes by without a stop, but yields


def starting_scenario(
    scenario: str | None = None,
    *,
    robot: str | None = None,
    urdf: Path | None = None,
    package_dirs: Sequence[Path] = (),
    effort_limits: Mapping[str, float] | None = None,
    velocity_limits: Mapping[str, float] | None = None,
) -> Scenario:
    """A scenario by file or name, or one ball beside the way of a robot that turns its first joint; the first scene of
    the gallery where nothing is given.

    Raises:
        ValueError: more than one of scenario, robot and urdf. FileNotFoundError: see `Scenario.load`.
    """
    if sum(choice is not None for choice in (scenario, robot, urdf)) > 1:
        raise ValueError("give one of a scenario, --robot and --urdf")
    if urdf is None and (effort_limits or velocity_limits):
        raise ValueError("limits of joints go with --urdf; a scenario file has robot.effort_limits")
    if scenario is not None:
        return Scenario.load(scenario)
    if robot is None and urdf is None:
        from sidestep.studio.gallery import GALLERY, OPENING

        return GALLERY[OPENING].load()
    choice = (
        RobotConfig(name=robot or DEFAULT_ROBOT)
        if urdf is None
        else RobotConfig(
            urdf=str(urdf),
            package_dirs=tuple(str(folder) for folder in package_dirs),
            effort_limits=dict(effort_limits or {}) or None,
            velocity_limits=dict(velocity_limits or {}) or None,
        )
    )
    return scenario_of(choice)


def scenario_of(choice: RobotConfig) -> Scenario:
    """A robot that turns its first joint past a ball."""
    empty = JointState("rad", ())
    arm = load_robot(Scenario("studio", choice, empty, empty))
    start, goal = ends(arm)
    position = beside_the_way(arm, start, goal)
    return Scenario(
        name="studio",
        robot=choice,
        method="controller",
        start=_state(start),
        goal=_state(goal),
        obstacles=(Obstacle(Sphere(BALL), position, name="ball", points="ball"),),
    )


def ends(robot: Robot) -> tuple[Array, Array]:
    """Start and goal (nv,): the middle of the joints, the second one bent, the first one turned to either side.

    It is bent to where no link is below the base, if it can be.
    """
    limits, middle = robot.limits, np.array(robot.neutral)
    if len(middle) > 1:
        bent = [
            np.clip(middle + turn * np.eye(len(middle))[1], limits.lower, limits.upper)
            for turn in (BEND, -BEND)
        ]
        middle = max(
            bent, key=lambda q: min(0.0, *(robot.pose(q, frame.name)[2, 3] for frame in robot.frames))
        )
    start, goal = middle.copy(), middle.copy()
    start[0] = max(start[0] - 0.5 * TURN, limits.lower[0])
    goal[0] = min(goal[0] + 0.5 * TURN, limits.upper[0])
    return start, goal


def beside_the_way(robot: Robot, start: Array, goal: Array) -> tuple[float, float, float]:
    """A place for the ball: just outside of where the tip passes half way."""
    middle = robot.pose(0.5 * (start + goal), tip_of(robot))[:3, 3]
    outward = middle / max(float(np.linalg.norm(middle)), 1e-9)
    x, y, z = (float(value) for value in (middle + (BALL + BESIDE) * outward).round(3))
    return x, y, z


def _state(q: Array) -> JointState:
    return JointState("rad", tuple(float(value) for value in q.round(6)))
