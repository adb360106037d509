"""One of the thesis's systems with its torque QP, as Python."""

from __future__ import annotations

import dataclasses

from sidestep.scenario import Scenario
from sidestep.scenario.config import parts_of
from sidestep.scenario.scenario import SwitchConfig
from sidestep.scenario.torque_program import program_from
from sidestep.studio.messages import Snapshot
from sidestep.studio.snippet import call, robot_code, state_code
from sidestep.studio.systems import fit_arguments


def custom_code(snapshot: Snapshot, written: Scenario) -> list[str]:
    """Makes the `controller` that tracks the acceleration of a `system`, and takes a step without obstacles."""
    torque = program_from(written.controller)
    safety = next(own for _, _, own, _ in parts_of(torque.pop("safety"), "safety."))
    period = f"period={written.simulation.period!r}"
    return [
        f"robot = {robot_code(written.robot, written)}",
        *_system_code(written),
        *call("safety = SafetySettings", safety),
        *call("controller = MotionProgram", torque, "robot", period, "safety=safety"),
        *_goal_code(snapshot),
        "",
        "# what is seen: ss.Obstacles(points, radii), of (n, 3) and (n,) [m]",
        "obstacles = ss.Obstacles.none()",
        "# what is measured",
        *state_code(snapshot),
        "step = system.acceleration(q, v, goal, obstacles)",
        "# controller.solve(q, v, step.acceleration, mass_matrix, bias).torque",
    ]


def _goal_code(snapshot: Snapshot) -> list[str]:
    if snapshot.goal is not None:
        return ["# [rad | m]", f"goal = {snapshot.goal.tolist()}"]
    assert snapshot.posture is not None
    says = "that has the pose of the tip"
    if not snapshot.posture.found:
        says = "the nearest found to the pose of the tip, which is out of reach"
    return [f"# the posture {says} [rad | m]", f"goal = {snapshot.posture.q.tolist()}"]


def _system_code(written: Scenario) -> list[str]:
    body, embedding, system = written.body, written.embedding, written.system
    density = f"density = thesis.CollisionDensity(robot, body, average={embedding.density == 'average'})"
    lines, names = [density], "density"
    if embedding.joint_limits is not None:
        lines += call(
            "limits = thesis.JointLimitPotential", dataclasses.asdict(embedding.joint_limits), "robot"
        )
        names += ", limits"
    together = f"[thesis.Sum([{names}])]" if embedding.combine == "sum" and len(lines) > 1 else f"[{names}]"
    spring = {
        "stiffness": system.stiffness,
        "damping": system.damping,
        "damping_form": system.damping_form,
    }
    return [
        *call("body = ss.Body.fit", fit_arguments(body), "robot"),
        *lines,
        f"psi = {together}",
        f"switch = {_switch_code(system.switch)}",
        *call("system = GeometricSystem", spring, "psi", "switch=switch"),
    ]


def _switch_code(switch: SwitchConfig) -> str:
    match switch.type:
        case "distance":
            return f"thesis.DistanceSwitch({list(switch.thresholds or ())!r}, {switch.slope!r})"
        case "sigmoid":
            return f"thesis.SigmoidSwitch({switch.threshold!r}, {switch.slope!r})"
        case "binary":
            return f"thesis.BinarySwitch({switch.threshold!r})"
        case "harmonic_only":
            return "thesis.HarmonicOnly()"
        case "geodesic_only":
            return "thesis.GeodesicOnly()"
    return "None"
