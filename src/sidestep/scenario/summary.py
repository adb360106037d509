"""The figures of a run as rows of text, for the terminal and the report page."""

from __future__ import annotations

import numpy as np

from sidestep._core import Obstacles
from sidestep.robot.tolerance import SLIDING
from sidestep.scenario.config import OPTIONAL, left_out
from sidestep.scenario.result import ScenarioResult, tolerance_units
from sidestep.scenario.scenario import Scenario
from sidestep.simulation import SimulationRun
from sidestep.simulation.evaluation import POSE_TOLERANCE
from sidestep.simulation.joint_words import in_words


def method_in_words(scenario: Scenario) -> str:
    """How the arm is moved."""
    if scenario.method != "custom":
        missing = left_out(scenario.controller, scenario.method)
        if missing == OPTIONAL:
            return "barriers alone"
        return f"controller without {' and '.join(missing).replace('_', ' ')}" if missing else "controller"
    return f"custom, switch: {scenario.system.switch.type.replace('_', ' ')}"


def seen_in_words(seen: Obstacles, *, num_solids: int) -> str:
    """What the controller sees of so many solids: points, bare or with radii."""
    count = len(seen.points)
    if count == 0:
        return "no obstacle"
    points = f"{count} point{'s' if count > 1 else ''}"
    sized = seen.radii[seen.radii > 0.0]
    if not sized.size:
        return f"{count} bare centre{'s' if count > 1 else ''}" if count == num_solids else f"{points}, bare"
    low, high = (f"{1000.0 * radius:.4g}" for radius in (sized.min(), sized.max()))
    radii = f"a radius of {low} mm" if low == high else f"radii of {low} to {high} mm"
    if sized.size == count:
        return f"{points} with {radii}"
    return f"{points}, {count - sized.size} of them bare, the others with {radii}"


def summary_rows(result: ScenarioResult) -> list[tuple[str, str, str]]:
    """Rows (quantity, value with unit, what is allowed or what it means)."""
    evaluation, choice = result.evaluation, result.scenario.simulation
    pose = result.run.pose is not None
    rows = [
        ("method", method_in_words(result.scenario), ""),
        ("controller sees", seen_in_words(result.seen, num_solids=len(result.run.objects)), "at the start"),
        ("goal reached", _yes(evaluation.reached), _allowed(result)),
        ("error of the pose" if pose else "largest joint error", evaluation.way_left(), "at the end"),
        (
            "time to goal",
            _number(evaluation.time_to_goal_s, "{:.2f} s"),
            f"of {evaluation.duration_s:.2f} s simulated",
        ),
        (
            "largest detour",
            in_words(evaluation.path_deviation_rad, evaluation.path_deviation_m),
            f"by {evaluation.path_deviation_joint}",
        ),
    ]
    if evaluation.min_clearance_m is not None:
        where = f"exact meshes, {evaluation.clearance_pair} at {evaluation.clearance_time_s:.2f} s"
        rows.append(("smallest clearance", f"{1000.0 * evaluation.min_clearance_m:.1f} mm", where))
    if evaluation.contacts is not None and result.run.objects:
        pushed = ", ".join(evaluation.moved_objects) or "none"
        rows.append(("contact points", str(evaluation.contacts), f"obstacles pushed away: {pushed}"))
    if isinstance(result.run, SimulationRun):
        rows += _physics(result.run, followed=result.scenario.method == "custom")
    rows += [
        ("limits exceeded", _limits(result), "at samples"),
        (_step_words(result.scenario)[0], _counts(evaluation.system_status), "steps"),
        (_step_words(result.scenario)[1], _counts(evaluation.controller_status), "steps by status"),
        (
            "computing time",
            f"{result.wall_time:.1f} s",
            f"{1000.0 * choice.period:g} ms steps, {choice.mode} mode",
        ),
    ]
    return [row for row in rows if row[1] != "-" or row[0] == "time to goal"]


def _step_words(scenario: Scenario) -> tuple[str, str]:
    """What the two columns of step by step words are of."""
    return ("system", "torque program") if scenario.method == "custom" else ("activity", "safety")


def _physics(run: SimulationRun, *, followed: bool) -> list[tuple[str, str, str]]:
    """How far the arm was from the wanted acceleration, and how much of its torque that took.

    `followed`: the arm tracks what is wanted; else limits and clearances change it first.
    """
    robot, rows = run.robot, []
    errors = np.nan_to_num(np.abs(run.achieved - run.wanted)).max(axis=0)
    joint = int(errors.argmax())
    unit = robot.coordinate_units[joint]
    note = f"largest, of {robot.coordinate_names[joint]}, achieved against wanted acceleration"
    if not followed:
        note = f"largest, of {robot.coordinate_names[joint]}: limits and clearances change what is wanted"
    if np.isfinite(run.achieved - run.wanted).any():
        rows.append(
            ("tracking error" if followed else "largest correction", f"{errors[joint]:.2g} {unit}/s²", note)
        )
    ratios = (np.abs(run.torque) / robot.limits.effort).max(axis=0)
    joint = int(ratios.argmax())
    name = {"rad": "largest torque", "m": "largest force"}[robot.coordinate_units[joint]]
    rows.append((name, f"{100.0 * ratios[joint]:.0f} % of its limit", f"of {robot.coordinate_names[joint]}"))
    return rows


def _allowed(result: ScenarioResult) -> str:
    tolerance = result.scenario.simulation.tolerance
    turning, sliding = tolerance_units(result.run)
    bound = in_words(tolerance if turning else None, SLIDING * tolerance if sliding else None)
    if result.run.pose is None:
        return f"error under {bound} at the end"
    return f"within {1e3 * POSE_TOLERANCE:g} mm and {bound} at the end"


def _limits(result: ScenarioResult) -> str:
    limits = result.evaluation.limits
    counts = {
        "position": limits.position,
        "velocity": limits.velocity,
        "acceleration": limits.acceleration,
        "torque": limits.torque or 0,
    }
    return ", ".join(f"{name} {count}" for name, count in counts.items() if count) or "none"


def _yes(value: bool) -> str:
    return "yes" if value else "NO"


def _number(value: float | None, text: str) -> str:
    return "-" if value is None else text.format(value)


def _counts(statuses: dict[str, int] | None) -> str:
    return "-" if statuses is None else ", ".join(f"{name} {count}" for name, count in statuses.items())
