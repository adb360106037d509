"""The figures of a run as rows of text, for the terminal and the report page."""

from __future__ import annotations

from sidestep.scenario.result import ScenarioResult


def summary_rows(result: ScenarioResult) -> list[tuple[str, str, str]]:
    """Rows (quantity, value with unit, what is allowed or what it means)."""
    evaluation, choice = result.evaluation, result.scenario.simulation
    limits = evaluation.limits
    rows = [
        ("goal reached", _yes(evaluation.reached), f"joint error under {choice.tolerance:g} rad at the end"),
        ("largest joint error at the end", f"{evaluation.position_error_rad:.4f} rad", ""),
        (
            "time to goal",
            _number(evaluation.time_to_goal_s, "{:.2f} s"),
            f"of {evaluation.duration_s:.2f} s simulated",
        ),
        (
            "largest detour from the straight path",
            f"{evaluation.path_deviation_rad:.3f} rad",
            evaluation.path_deviation_joint,
        ),
    ]
    if result.run.objects:
        pairs = ", ".join(evaluation.contact_pairs or ())
        clearance, pushed = evaluation.min_clearance_m, evaluation.moved_objects
        rows += [
            ("contact points counted", _number(evaluation.contacts, "{}"), pairs or "0 allowed"),
            (
                "smallest clearance, exact meshes",
                _number(None if clearance is None else 1000.0 * clearance, "{:.1f} mm"),
                f"{evaluation.clearance_pair} at {evaluation.clearance_time_s:.2f} s",
            ),
            (
                "obstacles pushed away",
                str(len(pushed)),
                ", ".join(pushed),
            ),
        ]
    rows += [
        (
            "acceleration tracking error, largest",
            _number(evaluation.max_tracking_error, "{:.2g} rad/s²"),
            f"root mean square {_number(evaluation.rms_tracking_error, '{:.2g} rad/s²')}",
        ),
        ("torque over limit, largest", _number(evaluation.max_torque_ratio, "{:.0%}"), "100 % allowed"),
        (
            "samples beyond a limit",
            str(limits.position + limits.velocity + limits.acceleration + (limits.torque or 0)),
            f"position {limits.position}, velocity {limits.velocity}, acceleration {limits.acceleration}, "
            f"torque {limits.torque if limits.torque is not None else '-'}",
        ),
        ("status of the system", _counts(evaluation.system_status), ""),
        ("status of the controller", _counts(evaluation.controller_status), ""),
        (
            "computing time",
            f"{result.wall_time:.1f} s",
            f"{len(result.run)} steps of {1000.0 * choice.period:g} ms, {choice.mode} mode",
        ),
    ]
    return rows


def _yes(value: bool) -> str:
    return "yes" if value else "NO"


def _number(value: float | None, text: str) -> str:
    return "-" if value is None else text.format(value)


def _counts(statuses: dict[str, int] | None) -> str:
    return "-" if statuses is None else ", ".join(f"{name} {count}" for name, count in statuses.items())
