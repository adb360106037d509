"""What is taken away from the studio: the scenario as it stands, and a system as Python."""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from sidestep.scenario import Scenario
from sidestep.scenario.scenario import (
    BodyChoice,
    EmbeddingChoice,
    JointLimitChoice,
    JointState,
    RobotChoice,
    SwitchChoice,
)
from sidestep.studio.messages import Snapshot
from sidestep.studio.methods import METHODS, THESIS_COMPONENTS


def scenario_now(snapshot: Snapshot, *, name: str) -> Scenario:
    """The scenario as it stands: arm, goal and obstacles where they are now, and the method's numbers.

    Scenario files know the numbers of the thesis's systems; of barriers they say only that they are used, and keep
    what the loaded scenario had beside them.

    Raises:
        ValueError: the goal is a pose, which scenario files do not have.
    """
    if snapshot.goal is None:
        raise ValueError("a scenario file has a configuration as its goal: move a slider of the goal first")
    scenario, numbers = snapshot.scenario, snapshot.numbers[snapshot.method]
    system, body, embedding = scenario.system, scenario.body, scenario.embedding
    covering = METHODS[snapshot.method].covering
    if not covering:
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
        method="barrier" if covering else "written",
        start=JointState("rad", tuple(float(x) for x in snapshot.q.round(6))),
        goal=JointState("rad", tuple(float(x) for x in snapshot.goal.round(6))),
        obstacles=tuple(
            dataclasses.replace(thing.at(pose).obstacle, name=thing.name)
            for thing, pose in zip(snapshot.things, snapshot.poses, strict=True)
        ),
        body=body,
        embedding=embedding,
        system=system,
    )


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
    if scenario.method == "barrier":
        return "barrier", {}
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
    ranges = {parameter.name: parameter for parameter in METHODS[method].parameters}
    return method, {
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


def python_snippet(robot: RobotChoice, method: str, numbers: Mapping[str, float]) -> str:
    """Python that makes the system of a method for a robot, as `system`."""
    arm = (
        f"ss.Robot.named({robot.name!r})" if robot.name is not None else f"ss.Robot.from_urdf({robot.urdf!r})"
    )
    spring = f"stiffness={numbers['stiffness']:.6g}, damping={numbers['damping']:.6g}"
    lines = ["import sidestep as ss", "", f"robot = {arm}"]
    if METHODS[method].covering:
        values = ", ".join(f"{name}={value:.6g}" for name, value in numbers.items())
        lines[1:1] = ["from sidestep.presets import Barriers, barrier_system"]
        lines += [f"numbers = Barriers({values})", "system = barrier_system(robot, numbers=numbers)"]
    else:
        lines += [
            f"body = ss.Body.fit(robot, components={THESIS_COMPONENTS})",
            "psi = ss.Sum([ss.CollisionDensity(robot, body), ss.JointLimitPotential(robot)])",
            f"system = ss.GeometricSystem([psi], {spring}, switch={_switch_code(method, numbers)})",
        ]
    return "\n".join(lines) + "\n"


def _switch_code(method: str, numbers: Mapping[str, float]) -> str:
    match method:
        case "thesis":
            inner, outer = f"{numbers['inner']:.6g}", f"{numbers['outer']:.6g}"
            thresholds = f"[{outer} if k in (0, 1, robot.num_coordinates - 1) else {inner} "
            thresholds += "for k in range(robot.num_coordinates)]"
            return f"ss.DistanceSwitch({thresholds}, {numbers['slope']:.6g})"
        case "sigmoid":
            return f"ss.SigmoidSwitch({numbers['threshold']:.6g}, {numbers['slope']:.6g})"
        case "binary":
            return f"ss.BinarySwitch({numbers['threshold']:.6g})"
        case "harmonic_only":
            return "ss.HarmonicOnly()"
    return "None"
