"""The planner on clearance: one path, or a path kept up beside a motion."""

from sidestep._core import (
    Obstruction,
    OnlinePlanner,
    OnlinePlannerStatus,
    PathPlanner,
    Plan,
    PlannerReference,
    PlannerSettings,
    PlanStatus,
    TimedPathSettings,
)

__all__ = [
    "Obstruction",
    "OnlinePlanner",
    "OnlinePlannerStatus",
    "PathPlanner",
    "Plan",
    "PlanStatus",
    "PlannerReference",
    "PlannerSettings",
    "TimedPathSettings",
]
