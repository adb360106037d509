"""The planner on clearance: one path, or a path kept up beside a motion."""

from sidestep._core import (
    Obstruction,
    OnlinePlanner,
    PathPlanner,
    Plan,
    PlannerReference,
    PlannerSettings,
    TimedPathSettings,
)

__all__ = [
    "Obstruction",
    "OnlinePlanner",
    "PathPlanner",
    "Plan",
    "PlannerReference",
    "PlannerSettings",
    "TimedPathSettings",
]
