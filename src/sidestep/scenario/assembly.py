"""From a scenario's words to the parts of a run: robot, body, system, solids, and what is seen of them."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np
import numpy.typing as npt
import trimesh

from sidestep import Body, Controller, Robot
from sidestep._core import JointType, Obstacles, real_array
from sidestep.arm import Arm
from sidestep.body.cover_problem import EffortName
from sidestep.distance import SceneObject
from sidestep.distance.scene import check_scene
from sidestep.math.pose import from_roll_pitch_yaw, pose_at
from sidestep.robot.degrees import degrees_hint
from sidestep.scenario.controller_settings import controller_settings_of
from sidestep.scenario.custom_method import RunAdapter, custom_method
from sidestep.scenario.perception import View, cloud_balls, seen_at, view_of
from sidestep.scenario.plausibility import warn_of
from sidestep.scenario.scenario import (
    BasePose,
    JointState,
    Obstacle,
    PoseConfig,
    RobotConfig,
    Scenario,
)
from sidestep.scenario.shape import MeshSource
from sidestep.scenario.torque_program import torque_qp_of
from sidestep.scenario.validation import ScenarioError
from sidestep.shapes import Shape, Sphere
from sidestep.shapes.mesh_reader import read_mesh
from sidestep.simulation import ControllerAdapter
from sidestep.simulation.pose_target import IkSolution, PoseTarget, solve_ik
from sidestep.system import GeometricSystem

Array = npt.NDArray[np.float64]
Progress = Callable[[str, int, int], None]
_T = TypeVar("_T")

POSTURE_STARTS = 20  # from which a posture for a pose is searched: at most a fifth of a second
MAX_CLOUD_POINTS = 2000  # more balls than this make the physics and the exact distances too slow to be of use


@dataclass(frozen=True, eq=False)
class Assembly:
    """The parts of a run.

    Attributes:
        robot, body: as the scenario asks.
        mover: the `Controller`, or for the method "custom" its geometric system. driver: it, in a simulation.
        objects: the solid obstacles, for physics and exact clearance.
        start, start_velocity: (nv,) [rad | m].
        posture: the goal; for a pose the start, or for "custom" the posture that is gone to.
        pose: that is to be reached, in place of a configuration.
        seen: what the mover sees; a function of time [s] where an obstacle starts or stops.
    """

    robot: Robot
    body: Body
    mover: Controller | GeometricSystem
    driver: RunAdapter
    objects: tuple[SceneObject, ...]
    start: Array
    start_velocity: Array
    posture: IkSolution
    seen: Obstacles | Callable[[float], Obstacles]
    pose: PoseTarget | None = None

    @property
    def goal(self) -> Array:
        """(nv,) of the posture."""
        return self.posture.q


@dataclass(frozen=True, eq=False)
class Stage:
    """The robot of a scenario at its start among its solids.

    Attributes:
        robot: as the scenario asks. start, start_velocity: (nv,) [rad | m].
        solids: those of each obstacle, in the order of the file.
    """

    robot: Robot
    start: Array
    start_velocity: Array
    solids: tuple[tuple[SceneObject, ...], ...]

    @property
    def objects(self) -> tuple[SceneObject, ...]:
        """All solids."""
        return tuple(thing for things in self.solids for thing in things)


def stage_of(scenario: Scenario) -> Stage:
    """What physics needs of a scenario.

    Raises:
        ScenarioError: see `assemble`.
    """
    robot = _at("robot", scenario, partial(load_robot, scenario))
    _at("simulation.mode", scenario, partial(check_torque, scenario, robot))
    start = _at("start.position", scenario, partial(coordinates, scenario.start, robot, "start.position"))
    velocity = _at("start.velocity", scenario, partial(start_velocity, scenario.start, robot))
    things = tuple(
        _at(f"obstacles[{k}]", scenario, partial(solids, scenario, item, item.name or f"obstacle{k}"))
        for k, item in enumerate(scenario.obstacles)
    )
    stage = Stage(robot, start, velocity, things)
    _at("obstacles", scenario, partial(check_scene, stage.objects))
    return stage


def assemble(scenario: Scenario, *, progress: Progress | None = None) -> Assembly:
    """Builds the parts of a scenario and checks what its schema cannot.

    Args:
        scenario: what to build.
        progress: told of the fit of the body, see `Body.fit`, and of the pairs of links that are measured.

    Raises:
        ScenarioError: a number of values that does not fit the robot, a start or goal outside the limits, an
            unknown robot or frame, a file that is missing or malformed; names the key and what is allowed.
    """
    _at("simulation", scenario, scenario.check_steps)
    stage = stage_of(scenario)
    robot, start = stage.robot, stage.start
    views: list[View] = []
    for index, (item, things) in enumerate(zip(scenario.obstacles, stage.solids, strict=True)):
        warn_of(item, things[0], f"{scenario.name}: obstacles[{index}]")
        for thing in things:
            look = partial(view_of, item, thing, bare=scenario.method == "custom")
            views.append(_at(f"obstacles[{index}]", scenario, look))
    scripted = any(item.motion is not None for item in scenario.obstacles)
    seen = partial(seen_at, tuple(views)) if scripted else seen_at(tuple(views), 0.0)
    written = scenario.method == "custom"
    if not written:
        settings = _at("method", scenario, partial(controller_settings_of, scenario))
    body = _at("body", scenario, partial(_fit, scenario, robot, progress))
    program = _at("controller", scenario, partial(torque_qp_of, scenario, robot))
    pose = _at("goal", scenario, partial(_target, scenario, robot))
    posture = IkSolution(start)
    if pose is None or written:
        posture = _at("goal", scenario, partial(goal_posture, scenario, robot, start))
    mover: Controller | GeometricSystem
    driver: RunAdapter
    if written:
        method = _at("method", scenario, custom_method)
        system = partial(method.system_of, scenario.embedding, scenario.system, robot, body)
        mover, integrator = _at("system", scenario, system), scenario.simulation.integrator
        driver = method.SystemAdapter(mover, posture.q, seen, program, integrator=integrator)
    else:
        arm = _at("body", scenario, partial(Arm.from_robot, robot, body, progress=_of_pairs(progress)))
        mover = _at("method", scenario, partial(Controller, arm, settings))
        mover.set_goal(posture.q if pose is None else pose.goal)
        driver = ControllerAdapter(mover, seen)
    return Assembly(
        robot=robot,
        body=body,
        mover=mover,
        driver=driver,
        objects=stage.objects,
        start=start,
        start_velocity=stage.start_velocity,
        posture=posture,
        seen=seen,
        pose=pose,
    )


def _target(scenario: Scenario, robot: Robot) -> PoseTarget | None:
    """The pose to be reached, if it is one."""
    choice = scenario.goal
    if isinstance(choice, JointState):
        return None
    _check_frame(choice, robot)
    rest = None if choice.posture is None else coordinates(choice.posture, robot, "goal.posture.position")
    return PoseTarget(robot, choice.frame, pose_of(choice), rest=rest)


def _check_frame(choice: PoseConfig, robot: Robot) -> None:
    links = [frame.name for frame in robot.frames if frame.joint >= 0]
    if choice.frame not in links:
        raise ValueError(f"goal.frame is {choice.frame!r}; allowed: {', '.join(links)}")


def goal_posture(scenario: Scenario, robot: Robot, start: Array) -> IkSolution:
    """The configuration where the goal is reached; of a pose the one that the file names, or found from the start.

    Raises ValueError that says what is wrong.
    """
    choice = scenario.goal
    if isinstance(choice, JointState):
        return IkSolution(coordinates(choice, robot, "goal.position"))
    _check_frame(choice, robot)
    if choice.posture is not None:
        return IkSolution(coordinates(choice.posture, robot, "goal.posture.position"))
    return solve_ik(robot, choice.frame, pose_of(choice), start, starts=POSTURE_STARTS)


def load_robot(scenario: Scenario) -> Robot:
    """The robot that a scenario asks for; raises ValueError or FileNotFoundError that says what is wrong."""
    choice: RobotConfig = scenario.robot
    if choice.name is not None:
        of_file = ("package_dirs", "tip", "base", "effort_limits", "velocity_limits")
        extras = [key for key in of_file if getattr(choice, key)]
        if extras:
            raise ValueError(
                f"{', '.join(extras)} go with 'urdf', not with a named robot, which has its own; write robot.urdf: FILE"
            )
        return Robot.named(choice.name, locked=choice.locked)
    file, options = description_of(scenario)
    return Robot.from_urdf(file, **options)


def description_of(scenario: Scenario) -> tuple[Path, dict[str, Any]]:
    """The description file of a scenario's robot, which goes by no name, and the arguments to read it with."""
    choice = scenario.robot
    assert choice.urdf is not None  # the schema asks for a name or a file
    return scenario.file(choice.urdf), {
        "package_dirs": [scenario.file(folder) for folder in choice.package_dirs],
        "tip": choice.tip,
        "locked": choice.locked,
        "base_pose": None if choice.base is None else pose_of(choice.base),
        "effort_limits": choice.effort_limits,
        "velocity_limits": choice.velocity_limits,
    }


def check_torque(scenario: Scenario, robot: Robot) -> None:
    """Raises ValueError where the motion is by torque, and the robot lacks effort limits or inertias for it."""
    if scenario.simulation.mode != "torque":
        return
    names = [
        name for name, most in zip(robot.coordinate_names, robot.limits.effort, strict=True) if np.isinf(most)
    ]
    if names:
        raise ValueError(
            f"simulation.mode is 'torque', and joints of robot {robot.name!r} have no effort limit: "
            f"{', '.join(names)}; write robot.effort_limits: {{{names[0]}: 87.0}} [Nm | N], or mode: kinematic"
        )
    if all(inertial.mass == 0.0 for inertial in robot.inertials):
        raise ValueError(
            f"simulation.mode is 'torque', and no moving link of robot {robot.name!r} has an <inertial> with mass; "
            "write them into its description, or mode: kinematic"
        )


def coordinates(state: JointState, robot: Robot, name: str) -> Array:
    """The position (nv,) of a state in radians and metres, inside the limits of the robot."""
    q = robot.check_configuration(_si(state.position, state.unit, robot, name), name)
    turns = _turns(robot)
    hint = degrees_hint(q[turns]) if state.unit == "rad" else ""
    if hint:  # a joint without limits, so that nothing refuses it
        warnings.warn(f"{name}{hint}: write unit: deg", RuntimeWarning, stacklevel=2)
    return q


def start_velocity(state: JointState, robot: Robot) -> Array:
    """The velocity (nv,) of a state, zero where none is given, within the limits of the robot."""
    if state.velocity is None:
        return np.zeros(robot.num_coordinates)
    velocity = _si(state.velocity, state.unit, robot, "start.velocity")
    limit = robot.limits.velocity
    for joint, value, most in zip(robot.coordinate_names, velocity, limit, strict=True):
        if abs(value) > most:
            hint = degrees_hint(velocity[_turns(robot)]) if state.unit == "rad" else ""
            raise ValueError(f"start.velocity: joint {joint!r} is {value}, allowed: [{-most}, {most}]{hint}")
    return velocity


def solids(scenario: Scenario, item: Obstacle, name: str) -> tuple[SceneObject, ...]:
    """The solid of an obstacle; a point cloud gives one ball per point, called NAME.0, NAME.1, …"""
    shape, pose = item.shape, pose_of(item)
    velocity, interval = np.array(item.velocity), (0.0, float("inf"))
    if item.motion is not None:
        interval = (item.motion.begin, item.motion.end)
        velocity = (np.array(item.motion.to) - np.array(item.position)) / (interval[1] - interval[0])
    driven: Literal["moving", "fixed"] = "moving" if np.any(velocity != 0.0) else "fixed"
    motion: Literal["free", "moving", "fixed"] = "free" if item.free else driven

    solid = partial(SceneObject, name, pose=pose, motion=motion, velocity=velocity, moves_during=interval)
    if isinstance(shape, Shape):
        return (solid(shape.kind, shape.lengths),)
    if isinstance(shape, MeshSource):
        return (solid(shape.kind, mesh=_mesh(scenario.file(shape.file), shape.scale)),)
    cloud, radius = cloud_balls(shape, scenario.file(shape.file))
    if len(cloud) > MAX_CLOUD_POINTS:
        raise ValueError(
            f"shape.file: {shape.file} gives {len(cloud)} points; at most {MAX_CLOUD_POINTS} are simulated. A voxel, "
            f"here {shape.voxel or 'none'}, merges those in a cell of that edge [m]"
        )
    ball = solid(Sphere.kind, (radius,))
    return tuple(
        replace(ball, name=f"{name}.{index}", pose=pose @ pose_at(point)) for index, point in enumerate(cloud)
    )


def _mesh(path: Path, scale: float) -> trimesh.Trimesh:
    if not path.is_file():
        raise FileNotFoundError(f"shape.file: there is no file {path}")
    mesh = read_mesh(path)
    mesh.vertices *= scale
    return mesh


def _fit(scenario: Scenario, robot: Robot, progress: Progress | None) -> Body:
    choice = scenario.body
    if scenario.method != "custom":
        effort: EffortName = "draft" if choice.draft else "fine"
        return Body.cover(robot, components=choice.ellipsoids, effort=effort, progress=progress)
    return Body.fit(
        robot,
        components=choice.components,
        covariance=choice.covariance,
        seed=choice.seed,
        progress=progress,
    )


def _of_pairs(progress: Progress | None) -> Callable[[str, str, int, int], None] | None:
    if progress is None:
        return None
    return lambda stage, pair, done, in_all: progress(f"{stage}: {pair}", done, in_all)


def _si(values: tuple[float, ...], unit: str, robot: Robot, name: str) -> Array:
    """Values (nv,) of a file in radians and metres; only revolute coordinates are ever in degrees."""
    if len(values) != robot.num_coordinates:
        raise ValueError(
            f"{name} has {len(values)} values; robot {robot.name!r} has {robot.num_coordinates} coordinates "
            f"({', '.join(robot.coordinate_names)})"
        )
    array = real_array(values, name).copy()
    if unit == "deg":
        turns = _turns(robot)
        array[turns] = np.deg2rad(array[turns])
    return array


def _turns(robot: Robot) -> list[int]:
    """The coordinates that are angles."""
    return sorted({joint.coordinate for joint in robot.joints if joint.type == JointType.revolute})


def pose_of(thing: BasePose | Obstacle | PoseConfig) -> Array:
    """The pose (4, 4) in the world of what a file places."""
    roll, pitch, yaw = np.deg2rad(thing.rotation_deg)
    return pose_at(thing.position, from_roll_pitch_yaw((roll, pitch, yaw)))


def _at(place: str, scenario: Scenario, make: Callable[[], _T]) -> _T:
    """The value that `make` gives; an error of it names the scenario and the place in it."""
    try:
        return make()
    except ScenarioError:
        raise
    except (ValueError, OSError, ArithmeticError, MemoryError) as error:
        text = str(error)
        text = text if text.startswith(place) else f"{place}: {text}"
        raise ScenarioError(f"{scenario.name}: {text}") from error
