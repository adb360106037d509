"""What moves an arm, as Python."""

from __future__ import annotations

import dataclasses
from typing import Any

from sidestep.barriers import Barriers
from sidestep.scenario import Scenario
from sidestep.scenario.assembly import pose_of
from sidestep.scenario.scenario import RobotChoice, SwitchChoice
from sidestep.simulation.pose_aim import ENTER, POSITION_SHARE, TURN_SHARE
from sidestep.studio.messages import Snapshot
from sidestep.studio.methods import METHODS
from sidestep.studio.systems import as_file

WIDTH = 80  # [characters] that a window on the page shows


def python_snippet(snapshot: Snapshot) -> str:
    """Python that makes the system that moves the arm, as `system`, and its `goal`, and takes a step without obstacles.

    Beside it are `escape` and `evasion`, or `motion`, where the method has sub-goals and flights, or a guide, and
    `controller`, the torque program.
    """
    method = METHODS[snapshot.method]
    written = as_file(method, snapshot.numbers[method.name], snapshot.scenario)
    lines = ["import sidestep as ss", "", f"robot = {_robot_code(written.robot, written)}"]
    if method.covering:
        lines[1:1] = ["from sidestep.presets import Barriers, barrier_system"]
        count = written.barriers.ellipsoids
        lines += [f"body = ss.Body.cover(robot{'' if count is None else f', components={count}'})"]
        own = {entry.name: getattr(written.barriers, entry.name) for entry in dataclasses.fields(Barriers)}
        lines += _call("numbers = Barriers", own)
        lines += ["system = barrier_system(robot, body, numbers=numbers)"]
    else:
        lines += _written_code(written)
    if method.escapes:
        lines += _call("escape = ss.Escape", dataclasses.asdict(written.escape), "robot")
    if method.evades:
        lines += _call("evasion = ss.Evasion", dataclasses.asdict(written.evasion), "system")
    if method.guided:
        lines += [
            *_call("planner = ss.PlannerSettings", dataclasses.asdict(written.guide.planner)),
            *_call("route = ss.RouteSettings", dataclasses.asdict(written.guide.route)),
            "motion = ss.GuidedMotion(robot, body, system=system, planner=planner, route=route)",
        ]
    torque = dataclasses.asdict(written.torque)
    safety = torque.pop("safety")
    period = f"period={written.simulation.period!r}"
    lines += _call("safety = ss.SafetySettings", safety)
    lines += _call("controller = ss.TorqueController", torque, "robot", period, "safety=safety")
    lines += _goal_code(snapshot)
    return "\n".join([*lines, *_step_code(snapshot)]) + "\n"


def _call(head: str, values: dict[str, Any], *first: str) -> list[str]:
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


def _step_code(snapshot: Snapshot) -> list[str]:
    method = METHODS[snapshot.method]
    place = "goal" if snapshot.goal_pose is None else "posture"
    lines = [
        "",
        "# what is seen: ss.Obstacles(points, radii), of (n, 3) and (n,) [m]",
        "obstacles = ss.Obstacles.none()",
        "# what is measured",
        f"q = {snapshot.q.tolist()}",
        f"v = {snapshot.v.tolist()}",
    ]
    if method.guided:
        lines += [f"motion.set_goal({place})", "step = motion.step(q, v, obstacles)"]
    else:
        if method.escapes:
            lines += [
                "# where it is stuck: goal is escape.pursue(goal, q, step.goal_potential, period) for this step"
            ]
        if method.evades:
            lines += [
                "# where something moves, every delay, in another thread, with a copy.copy of the flight:",
                "# flight = evasion.look(goal, q, v, obstacles, flight); from then on, if it is not None,",
                "# goal is flight.refuge, its flight.acceleration(q, v, period) takes the place of the step's,",
                "# and flight.advance(period) follows",
            ]
        if method.covering:
            lines += [f"# among what is at rest: system.relaxed_at({place}, obstacles) leaves the goal free"]
        lines += ["step = system.acceleration(q, v, goal, obstacles)"]
    kept = ", clearances=step" if method.safe else ""
    return [*lines, f"# controller.solve(q, v, step.acceleration, mass_matrix, bias{kept}).torque"]


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
        return ["# [rad | m]", f"goal = {posture}"]
    numbers = snapshot.numbers[snapshot.method]
    stiffness = numbers.get("stiffness", snapshot.scenario.system.stiffness)
    pull = {
        "position_stiffness": POSITION_SHARE * stiffness,
        "orientation_stiffness": TURN_SHARE * stiffness,
    }
    rows = [f"    {row}," for row in snapshot.goal_pose.tolist()]
    lines = ["pose = [", *rows, "]", *_call("goal = ss.PoseGoal", pull, "robot", repr(snapshot.tip), "pose")]
    says = f"that has the pose: the goal until the tip is within {1e3 * ENTER[0]:g} mm and {ENTER[1]:g} rad"
    if not snapshot.posture.found:
        says = "the nearest found to the pose, which is out of reach: the goal"
    return [*lines, f"# {says}", f"posture = {posture}"]


def _written_code(written: Scenario) -> list[str]:
    body, embedding, system = written.body, written.embedding, written.system
    density = f"density = ss.CollisionDensity(robot, body, average={embedding.density == 'average'})"
    lines, names = [density], "density"
    if embedding.joint_limits is not None:
        lines += _call("limits = ss.JointLimitPotential", dataclasses.asdict(embedding.joint_limits), "robot")
        names += ", limits"
    together = f"[ss.Sum([{names}])]" if embedding.combine == "sum" and len(lines) > 1 else f"[{names}]"
    spring = {
        "stiffness": system.stiffness,
        "damping": system.damping,
        "damping_form": system.damping_form,
    }
    return [
        *_call("body = ss.Body.fit", dataclasses.asdict(body), "robot"),
        *lines,
        f"psi = {together}",
        f"switch = {_switch_code(system.switch)}",
        *_call("system = ss.GeometricSystem", spring, "psi", "switch=switch"),
    ]


def _switch_code(switch: SwitchChoice) -> str:
    match switch.type:
        case "distance":
            return f"ss.DistanceSwitch({list(switch.thresholds or ())!r}, {switch.slope!r})"
        case "sigmoid":
            return f"ss.SigmoidSwitch({switch.threshold!r}, {switch.slope!r})"
        case "binary":
            return f"ss.BinarySwitch({switch.threshold!r})"
        case "harmonic_only":
            return "ss.HarmonicOnly()"
        case "geodesic_only":
            return "ss.GeodesicOnly()"
    return "None"
