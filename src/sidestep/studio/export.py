"""What is taken away from the studio: the scenario as it stands, and a system as Python."""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import cast

import numpy as np
import numpy.typing as npt

from sidestep.barriers import Barriers
from sidestep.scenario import Scenario
from sidestep.scenario.assembly import pose_of
from sidestep.scenario.scenario import (
    BarrierChoice,
    BodyChoice,
    EmbeddingChoice,
    JointLimitChoice,
    JointState,
    MethodChoice,
    PoseChoice,
    RobotChoice,
    SwitchChoice,
)
from sidestep.simulation.pose_aim import ENTER, POSITION_SHARE, TURN_SHARE
from sidestep.studio.messages import Snapshot
from sidestep.studio.methods import METHODS, THESIS_COMPONENTS
from sidestep.studio.things import written_pose

Array = npt.NDArray[np.float64]


def scenario_now(snapshot: Snapshot, *, name: str) -> Scenario:
    """The scenario as it stands: arm, goal and obstacles where they are now, the method and its numbers."""
    scenario, numbers = snapshot.scenario, snapshot.numbers[snapshot.method]
    system, body, embedding = scenario.system, scenario.body, scenario.embedding
    method: MethodChoice = "written"
    barriers = scenario.barriers
    if METHODS[snapshot.method].covering:
        method = cast("MethodChoice", snapshot.method)
        barriers = BarrierChoice(**numbers, ellipsoids=snapshot.ellipsoids)
    else:
        system = dataclasses.replace(
            system,
            stiffness=numbers["stiffness"],
            damping=numbers["damping"],
            switch=switch_of(snapshot.method, numbers, len(snapshot.q)),
        )
        body = BodyChoice(components=THESIS_COMPONENTS)
        embedding = EmbeddingChoice(joint_limits=JointLimitChoice())
    return dataclasses.replace(
        scenario,
        name=name,
        method=method,
        start=_state(snapshot.q),
        goal=_goal(snapshot),
        obstacles=tuple(
            dataclasses.replace(thing.at(pose).obstacle, name=thing.name)
            for thing, pose in zip(snapshot.things, snapshot.poses, strict=True)
        ),
        body=body,
        embedding=embedding,
        system=system,
        barriers=barriers,
    )


def _state(q: Array) -> JointState:
    return JointState("rad", tuple(float(value) for value in q))


def _goal(snapshot: Snapshot) -> JointState | PoseChoice:
    if snapshot.goal_pose is None:
        return _state(snapshot.posture.q)
    posture = _state(snapshot.posture.q) if snapshot.posture.found else None
    return PoseChoice(snapshot.tip, *written_pose(snapshot.goal_pose), posture)


def switch_of(method: str, numbers: Mapping[str, float], num_coordinates: int) -> SwitchChoice:
    """The switch of one of the thesis's methods as a scenario file has it."""
    match method:
        case "thesis":
            ends = {0, 1, num_coordinates - 1}
            thresholds = tuple(numbers["outer" if k in ends else "inner"] for k in range(num_coordinates))
            return SwitchChoice("distance", thresholds=thresholds, slope=numbers["slope"])
        case "sigmoid":
            return SwitchChoice("sigmoid", threshold=numbers["threshold"], slope=numbers["slope"])
        case "binary":
            return SwitchChoice("binary", threshold=numbers["threshold"])
        case "harmonic_only":
            return SwitchChoice("harmonic_only")
    return SwitchChoice("none")


def numbers_of(scenario: Scenario) -> tuple[str, dict[str, float]]:
    """The method that a scenario file asks for, and the numbers it has for it, moved into their ranges."""
    if scenario.method != "written":
        numbers = {
            entry.name: getattr(scenario.barriers, entry.name) for entry in dataclasses.fields(Barriers)
        }
        return scenario.method, _in_range(scenario.method, numbers)
    system, switch = scenario.system, scenario.system.switch
    numbers = {"stiffness": float(np.mean(system.stiffness)), "damping": float(np.mean(system.damping))}
    method = {"none": "unswitched", "distance": "thesis"}.get(switch.type, switch.type)
    if method not in METHODS:
        return "unswitched", {}
    if switch.thresholds is not None:
        numbers["outer"] = switch.thresholds[0]
        if len(switch.thresholds) > 3:  # with fewer joints there is none between the first two and the last
            numbers["inner"] = switch.thresholds[2]
    for name in ("threshold", "slope"):
        value = getattr(switch, name)
        if value is not None:
            numbers[name] = float(value)
    return method, _in_range(method, numbers)


def _in_range(method: str, numbers: Mapping[str, float]) -> dict[str, float]:
    ranges = {parameter.name: parameter for parameter in METHODS[method].parameters}
    return {
        name: float(np.clip(value, ranges[name].lower, ranges[name].upper)) for name, value in numbers.items()
    }


def save_scenario(scenario: Scenario, folder: Path) -> Path:
    """Writes a scenario as NAME.yaml, with copies of the point clouds it names beside it.

    Raises:
        OSError: the folder cannot be written to.
    """
    obstacles = []
    for item in scenario.obstacles:
        shape = item.shape
        if shape.file is not None:
            source = scenario.file(shape.file)
            target = (folder / f"{scenario.name}-{source.name}").resolve()
            if source != target:
                shutil.copyfile(source, target)
            item = dataclasses.replace(item, shape=dataclasses.replace(shape, file=str(target)))
        obstacles.append(item)
    path = folder / f"{scenario.name}.yaml"
    dataclasses.replace(scenario, obstacles=tuple(obstacles)).save(path)
    return path


def python_snippet(snapshot: Snapshot) -> str:
    """Python that makes the system that moves the arm, as `system`, and its `goal`."""
    robot, method = snapshot.scenario.robot, snapshot.method
    numbers = snapshot.numbers[method]
    lines = ["import sidestep as ss", "", f"robot = {_robot_code(robot, snapshot.scenario)}"]
    if METHODS[method].covering:
        lines[1:1] = ["from sidestep.presets import Barriers, barrier_system"]
        count = "" if snapshot.ellipsoids is None else f", components={snapshot.ellipsoids}"
        values = ", ".join(f"{name}={value!r}" for name, value in numbers.items())
        lines += [f"body = ss.Body.cover(robot{count})", f"numbers = Barriers({values})"]
        lines += ["system = barrier_system(robot, body, numbers=numbers)"]
    else:
        spring = f"stiffness={numbers['stiffness']!r}, damping={numbers['damping']!r}"
        lines += [
            f"body = ss.Body.fit(robot, components={THESIS_COMPONENTS})",
            "psi = ss.Sum([ss.CollisionDensity(robot, body), ss.JointLimitPotential(robot)])",
            f"system = ss.GeometricSystem([psi], {spring}, switch={_switch_code(method, numbers)})",
        ]
    lines += _goal_code(snapshot)
    if METHODS[method].covering:
        place = "goal" if snapshot.goal_pose is None else "posture"
        lines += [f"# among obstacles at rest: system.relaxed_at({place}, obstacles) leaves the goal free"]
    return "\n".join(lines) + "\n"


def _robot_code(robot: RobotChoice, scenario: Scenario) -> str:
    if robot.name is not None:
        return f"ss.Robot.named({robot.name!r})"
    assert robot.urdf is not None
    parts = [repr(str(scenario.file(robot.urdf)))]
    if robot.package_dirs:
        parts.append(f"package_dirs={[str(scenario.file(folder)) for folder in robot.package_dirs]!r}")
    if robot.tip is not None:
        parts.append(f"tip={robot.tip!r}")
    if robot.locked is not None:
        parts.append(f"locked={robot.locked!r}")
    if robot.base is not None:
        parts.append(f"base_pose={pose_of(robot.base).tolist()!r}")
    return f"ss.Robot.from_urdf({', '.join(parts)})"


def _goal_code(snapshot: Snapshot) -> list[str]:
    posture = snapshot.posture.q.tolist()
    if snapshot.goal_pose is None:
        return [f"goal = {posture}  # [rad | m]"]
    stiffness = snapshot.numbers[snapshot.method]["stiffness"]
    pull = (
        f"position_stiffness={POSITION_SHARE * stiffness!r}, orientation_stiffness={TURN_SHARE * stiffness!r}"
    )
    lines = [
        f"pose = {snapshot.goal_pose.tolist()}",
        f"goal = ss.PoseGoal(robot, {snapshot.tip!r}, pose, {pull})",
    ]
    says = f"that has the pose: the goal until the tip is within {1e3 * ENTER[0]:g} mm and {ENTER[1]:g} rad of it"
    if not snapshot.posture.found:
        says = "the nearest found to the pose, which is out of reach: the goal"
    return [*lines, f"posture = {posture}  # {says}"]


def _switch_code(method: str, numbers: Mapping[str, float]) -> str:
    match method:
        case "thesis":
            thresholds = (
                f"[{numbers['outer']!r} if k in (0, 1, robot.num_coordinates - 1) else {numbers['inner']!r} "
            )
            thresholds += "for k in range(robot.num_coordinates)]"
            return f"ss.DistanceSwitch({thresholds}, {numbers['slope']!r})"
        case "sigmoid":
            return f"ss.SigmoidSwitch({numbers['threshold']!r}, {numbers['slope']!r})"
        case "binary":
            return f"ss.BinarySwitch({numbers['threshold']!r})"
        case "harmonic_only":
            return "ss.HarmonicOnly()"
    return "None"
