"""What `sidestep simulate` simulates: the robot and the solids of a scenario, or a robot by name among given solids."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sidestep._core import RobotPort
from sidestep.robot import Robot
from sidestep.robot.catalogue import RECIPES
from sidestep.scenario.assembly import stage_of
from sidestep.scenario.scenario import JointState, Obstacle, RobotConfig, Scenario, shipped_scenarios
from sidestep.scenario.shape import document_of, shape_of
from sidestep.scenario.validation import ScenarioError
from sidestep.shapes import KINDS
from sidestep.simulation.joint_drives import FREQUENCY, OUTPUTS, VELOCITY_GAIN
from sidestep.simulation.motion_record import MotionRecord
from sidestep.simulation.simulated_robot import SimulatedRobot

PERIOD = 1e-3  # [s] of a robot by name


def scene_of(source: str, *, objects: Sequence[str] = (), start: Sequence[float] | None = None) -> Scenario:
    """A scenario by file or name, or a robot by name among objects.

    Args:
        source: a scenario file, a name of `shipped_scenarios`, or a name from `sidestep robots`.
        objects: of a robot by name, see `obstacle_of`. start: of it (nv,) [rad | m]; `neutral` by default.

    Raises:
        FileNotFoundError: none of the three. ScenarioError, ValueError: it is malformed.
    """
    names = {recipe.name for recipe in RECIPES}
    if Path(source).is_file() or source in shipped_scenarios():
        if objects or start is not None:
            raise ValueError(f"--object and --start go with a robot by name; scenario {source!r} has its own")
        return Scenario.load(source)
    if source not in names:
        raise FileNotFoundError(
            f"{source!r} is no file, no shipped scenario ({', '.join(shipped_scenarios())}) and no robot "
            f"({', '.join(sorted(names))})"
        )
    robot = Robot.named(source)
    q = (
        robot.neutral
        if start is None
        else robot.check_configuration(np.asarray(start, dtype=float), "--start")
    )
    at = JointState("rad", tuple(float(value) for value in q))
    obstacles = tuple(obstacle_of(text, f"object{index}") for index, text in enumerate(objects))
    scene = Scenario(name=source, robot=RobotConfig(name=source), start=at, goal=at, obstacles=obstacles)
    return dataclasses.replace(scene, method="controller")


def obstacle_of(text: str, name: str) -> Obstacle:
    """An object as the command line writes it: KIND:LENGTH[,LENGTH…]@X,Y,Z in metres, such as sphere:0.05@0.4,0,0.5.

    Raises:
        ValueError: names the text and what is allowed.
    """
    allowed = sorted(kind for kind, shape in KINDS.items() if shape.bounded and shape.length_fields())
    try:
        solid, place = text.split("@")
        kind, lengths = solid.split(":")
        x, y, z = (float(number) for number in place.split(","))
        values = [float(number) for number in lengths.split(",")]
        if kind not in allowed:
            raise ValueError
        shape = shape_of(document_of(KINDS[kind].of_lengths(tuple(values))))
    except (ValueError, TypeError):
        raise ValueError(
            f"--object is {text!r}; allowed: KIND:LENGTH[,LENGTH…]@X,Y,Z in metres, such as sphere:0.05@0.4,0,0.5; "
            f"kinds are {', '.join(allowed)}"
        ) from None
    return Obstacle(shape=shape, position=(x, y, z), name=name)


def simulated_robot(
    scenario: Scenario, *, hold_cycles: int, ramps: bool = True, record: MotionRecord | None = None
) -> SimulatedRobot:
    """The robot of a scenario among its solids, at its start.

    Raises:
        ScenarioError: names the place in the scenario and what is allowed.
    """
    stage = stage_of(scenario)
    try:
        return SimulatedRobot(
            stage.robot,
            stage.objects,
            stage.start,
            velocity=stage.start_velocity,
            period=scenario.simulation.period,
            hold_cycles=hold_cycles,
            ramps=ramps,
            record=record,
        )
    except ValueError as error:
        raise ScenarioError(f"{scenario.name}: {error}") from error


def port_of(robot: SimulatedRobot, address: str, *, speed: float) -> RobotPort:
    """The port at which a simulated robot is driven.

    Raises:
        ValueError: the address is not allowed. OSError: it is taken.
    """
    hold = f"{1e3 * robot.hold_cycles * robot.period:g} ms"
    words = (
        f"its drives hold the last torque, acceleration or velocity, and move positions on, for {hold}; then it brakes "
        f"and rests. Drives of positions: {FREQUENCY:g}/s, critically damped; of velocities: {VELOCITY_GAIN:g}/s; both "
        "within the effort limits"
    )
    return RobotPort(
        address,
        name=robot.robot.name,
        joints=list(robot.robot.coordinate_names),
        limits=robot.robot.limits,
        outputs=list(OUTPUTS),
        period=robot.period,
        real_time=speed == 1.0,
        when_silent=words,
    )
