"""What moves an arm, as Python."""

from __future__ import annotations

import math
import re
from typing import Any

from sidestep.scenario import Scenario
from sidestep.scenario.assembly import pose_of
from sidestep.scenario.config import parts_of
from sidestep.scenario.scenario import RobotConfig
from sidestep.studio.messages import Snapshot
from sidestep.studio.methods import METHODS
from sidestep.studio.other_methods import methods_of_custom
from sidestep.studio.systems import as_file, settings_of

WIDTH = 80  # [characters] that a window on the page shows


# Where the classes are that a snippet needs beside those of `sidestep` itself.
_ROOMS = {
    "sidestep.control": ("SafetySettings", "MotionProgram"),
    "sidestep.controller": (
        "ArrivalSettings",
        "BarrierSettings",
        "ContactSettings",
        "InputSettings",
        "LocalMinimumSettings",
        "LookAheadSettings",
        "OnlinePlannerSettings",
        "PlannerSettings",
        "SourceSettings",
        "SpeedLimitSettings",
        "TimedPathSettings",
        "TrackingSettings",
    ),
    "sidestep.system": ("GeometricSystem",),
}


def _import(room: str, names: list[str]) -> str:
    """An import statement that fits a page."""
    line = f"from {room} import {', '.join(names)}"
    return (
        line
        if len(line) <= 88
        else f"from {room} import (\n" + "".join(f"    {name},\n" for name in names) + ")"
    )


def _spelled(name: str) -> str:
    """A class as the snippet names it."""
    return name if any(name in names for names in _ROOMS.values()) else f"ss.{name}"


def python_snippet(snapshot: Snapshot) -> str:
    """Python that makes the `controller` that moves the arm, and takes a step without obstacles.

    By one of the thesis's methods it is a `MotionProgram`, which tracks the acceleration of a `system`.
    """
    method = METHODS[snapshot.method]
    written = as_file(method, snapshot.numbers[method.name], snapshot.scenario)
    code = _controller_code if method.controlled else methods_of_custom().custom_code
    lines = code(snapshot, written)
    used = set(re.findall(r"(?<!\.)\b[A-Z]\w+(?=\()", "\n".join(lines)))
    imports = [
        _import(room, sorted(used & set(names))) for room, names in _ROOMS.items() if used & set(names)
    ]
    thesis = [] if method.controlled else ["from sidestep import thesis"]
    return "\n".join(["import sidestep as ss", *thesis, *imports, "", *lines]) + "\n"


def _controller_code(snapshot: Snapshot, written: Scenario) -> list[str]:
    lines = [f"arm = {_arm_code(written, written.body.ellipsoids)}"]
    for name, thing, own, parts in parts_of(settings_of(written)):
        given = [f"{part}={part if getattr(thing, part) is not None else None}" for part in parts]
        if not name:
            given.append(f"output={thing.output.name!r}")
        finite = {key: value for key, value in own.items() if math.isfinite(value)}
        head = f"{name.rpartition('.')[2] or 'settings'} = {_spelled(type(thing).__name__)}"
        lines += call(head, finite, *given)
    return [
        *lines,
        "controller = ss.Controller(arm, settings)",
        "",
        "# from any thread, at any time",
        *_goal_code(snapshot),
        "controller.set_goal(goal)",
        "# what is seen: ss.Obstacles(points, radii, velocities), (n, 3), (n,), (n, 3) [m, m, m/s]",
        "controller.set_obstacles(ss.Obstacles.none())",
        "",
        "# once a period: what is measured, perhaps with mass matrix and bias",
        *state_code(snapshot),
        "command = controller.step(q, v)",
        "# command.torque goes to the arm; controller.explain() says what it does, and why",
    ]


def state_code(snapshot: Snapshot) -> list[str]:
    """The measured state."""
    return [f"q = {snapshot.q.tolist()}", f"v = {snapshot.v.tolist()}"]


def call(head: str, values: dict[str, Any], *first: str) -> list[str]:
    """`head(first, name=value, ...)`, in as many lines as it takes."""
    arguments = [*first, *(f"{name}={value!r}" for name, value in values.items())]
    whole = f"{head}({', '.join(arguments)})"
    if len(whole) <= WIDTH:
        return [whole]
    lines = [f"{head}("]
    for argument in arguments:
        if lines[-1].endswith("(") or len(lines[-1]) + len(argument) + 2 > WIDTH:
            lines.append(f"    {argument},")
        else:
            lines[-1] += f" {argument},"
    return [*lines, ")"]


def _arm_code(written: Scenario, ellipsoids: int | None) -> str:
    name = written.robot.name
    if name is not None and ellipsoids is None:
        return f"ss.Arm.load({name!r}{_locked_code(written.robot)})"
    robot = robot_code(written.robot, written)
    count = "" if ellipsoids is None else f", components={ellipsoids}"
    return f"ss.Arm.from_robot(robot := {robot}, ss.Body.cover(robot{count}))"


def _locked_code(robot: RobotConfig) -> str:
    return "" if robot.locked is None else f", locked={robot.locked!r}"


def robot_code(robot: RobotConfig, scenario: Scenario) -> str:
    """The robot of a scenario."""
    if robot.name is not None:
        return f"ss.Robot.named({robot.name!r}{_locked_code(robot)})"
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
    for limits in ("effort_limits", "velocity_limits"):
        if getattr(robot, limits) is not None:
            parts.append(f"{limits}={getattr(robot, limits)!r}")
    return f"ss.Robot.from_urdf({', '.join(parts)})"


def _goal_code(snapshot: Snapshot) -> list[str]:
    if snapshot.goal is not None:
        return ["# [rad | m]", f"goal = {snapshot.goal.tolist()}"]
    assert snapshot.goal_pose is not None
    posture = None if snapshot.posture is None else snapshot.posture.q.tolist()
    pose = ["pose = [", *(f"    {row}," for row in snapshot.goal_pose.tolist()), "]"]
    near = ["# near which a posture for it is looked for", f"rest = {posture}"]
    return [*pose, *near, f"goal = ss.PoseGoal(arm.robot, {snapshot.tip!r}, pose, rest=rest)"]
