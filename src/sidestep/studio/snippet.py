"""The system that moves an arm, as Python."""

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


def python_snippet(snapshot: Snapshot) -> str:
    """Python that makes the system that moves the arm, as `system`, its `goal`, and what the loop has beside it.

    That is `escape` or `motion`, where the method has sub-goals or a guide, and `controller`, the torque program.
    """
    method = METHODS[snapshot.method]
    written = as_file(method, snapshot.numbers[method.name], snapshot.scenario)
    lines = ["import sidestep as ss", "", f"robot = {_robot_code(written.robot, written)}"]
    if method.covering:
        lines[1:1] = ["from sidestep.presets import Barriers, barrier_system"]
        count = written.barriers.ellipsoids
        lines += [f"body = ss.Body.cover(robot{'' if count is None else f', components={count}'})"]
        own = {entry.name: getattr(written.barriers, entry.name) for entry in dataclasses.fields(Barriers)}
        lines += [f"numbers = Barriers({_arguments(own)})"]
        lines += ["system = barrier_system(robot, body, numbers=numbers)"]
    else:
        lines += _written_code(written)
    if method.escapes:
        lines += [f"escape = ss.Escape(robot, {_arguments(dataclasses.asdict(written.escape))})"]
    if method.guided:
        lines += [
            f"planner = ss.PlannerSettings({_arguments(dataclasses.asdict(written.guide.planner))})",
            f"route = ss.RouteSettings({_arguments(dataclasses.asdict(written.guide.route))})",
            "motion = ss.GuidedMotion(robot, body, system=system, planner=planner, route=route)",
        ]
    torque = dataclasses.asdict(written.torque)
    safety = torque.pop("safety")
    lines += [
        f"safety = ss.SafetySettings({_arguments(safety)})",
        f"controller = ss.TorqueController(robot, period={written.simulation.period!r}, safety=safety, "
        f"{_arguments(torque)})",
    ]
    lines += _goal_code(snapshot)
    if method.covering:
        place = "goal" if snapshot.goal_pose is None else "posture"
        lines += [f"# among obstacles at rest: system.relaxed_at({place}, obstacles) leaves the goal free"]
    return "\n".join(lines) + "\n"


def _arguments(values: dict[str, Any]) -> str:
    return ", ".join(f"{name}={value!r}" for name, value in values.items())


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
    numbers = snapshot.numbers[snapshot.method]
    stiffness = numbers.get("stiffness", snapshot.scenario.system.stiffness)
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


def _written_code(written: Scenario) -> list[str]:
    body, embedding, system = written.body, written.embedding, written.system
    psi = [f"ss.CollisionDensity(robot, body, average={embedding.density == 'average'})"]
    if embedding.joint_limits is not None:
        limits = embedding.joint_limits
        psi += [f"ss.JointLimitPotential(robot, slope={limits.slope!r}, height={limits.height!r})"]
    together = f"[{', '.join(psi)}]"
    if embedding.combine == "sum" and len(psi) > 1:
        together = f"[ss.Sum({together})]"
    spring = (
        f"stiffness={system.stiffness!r}, damping={system.damping!r}, damping_form={system.damping_form!r}"
    )
    return [
        f"body = ss.Body.fit(robot, components={body.components!r}, covariance={body.covariance!r}, "
        f"seed={body.seed!r})",
        f"psi = {together}",
        f"system = ss.GeometricSystem(psi, {spring}, switch={_switch_code(system.switch)})",
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
