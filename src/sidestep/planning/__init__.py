"""The planner on clearance: one path, or a path kept up beside a motion."""

from sidestep._core import (
    Guidance,
    Guide,
    GuideStatus,
    Obstruction,
    PathPlanner,
    Plan,
    PlannerSettings,
    PlanStatus,
    RouteSettings,
)

__all__ = [
    "Guidance",
    "Guide",
    "GuideStatus",
    "Obstruction",
    "PathPlanner",
    "Plan",
    "PlanStatus",
    "PlannerSettings",
    "RouteSettings",
]
