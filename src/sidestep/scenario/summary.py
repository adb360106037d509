"""The figures of a run as rows of text, for the terminal and the report page."""

from __future__ import annotations

from sidestep.scenario.result import ScenarioResult
from sidestep.simulation.evaluation import POSE_TOLERANCE


def summary_rows(result: ScenarioResult) -> list[tuple[str, str, str]]:
    """Rows (quantity, value with unit, what is allowed or what it means)."""
    evaluation, choice = result.evaluation, result.scenario.simulation
    pose = result.run.pose is not None
    rows = [
        ("goal reached", _yes(evaluation.reached), _allowed(result)),
        ("error of the pose" if pose else "largest joint error", evaluation.way_left(), "at the end"),
        (
            "time to goal",
            _number(evaluation.time_to_goal_s, "{:.2f} s"),
            f"of {evaluation.duration_s:.2f} s simulated",
        ),
        (
            "largest detour",
            f"{evaluation.path_deviation_rad:.4g} rad",
            f"by {evaluation.path_deviation_joint}",
        ),
    ]
    if evaluation.min_clearance_m is not None:
        where = f"exact meshes, {evaluation.clearance_pair} at {evaluation.clearance_time_s:.2f} s"
        rows.append(("smallest clearance", f"{1000.0 * evaluation.min_clearance_m:.1f} mm", where))
    if evaluation.contacts is not None and result.run.objects:
        pushed = ", ".join(evaluation.moved_objects) or "no obstacle"
        rows.append(("contact points", str(evaluation.contacts), f"pushed away: {pushed}"))
    if evaluation.max_tracking_error is not None:
        rows.append(
            (
                "tracking error",
                f"{evaluation.max_tracking_error:.2g} rad/s²",
                "largest, achieved against wanted acceleration",
            )
        )
    if evaluation.max_torque_ratio is not None:
        rows.append(("torque over limit", f"{evaluation.max_torque_ratio:.0%}", "largest"))
    rows += [
        ("limits exceeded", _limits(result), "at samples"),
        ("system", _counts(evaluation.system_status), "steps by status"),
        ("controller", _counts(evaluation.controller_status), "steps by status"),
        (
            "computing time",
            f"{result.wall_time:.1f} s",
            f"{1000.0 * choice.period:g} ms steps, {choice.mode} mode",
        ),
    ]
    return [row for row in rows if row[1] != "-" or row[0] == "time to goal"]


def _allowed(result: ScenarioResult) -> str:
    angle = f"{result.scenario.simulation.tolerance:g} rad"
    if result.run.pose is None:
        return f"error under {angle} at the end"
    return f"within {1e3 * POSE_TOLERANCE:g} mm and {angle} at the end"


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
