"""Which links need a finer cover, where a planner finds no way for the cover that they have."""

from __future__ import annotations

from sidestep import _core
from sidestep._core import CoordinateKind, PlanStatus

LEVELS = (24, 48)  # ellipsoids of a link, one after the other; by default it has up to 16
BLOCKED = (PlanStatus.goal_in_collision, PlanStatus.start_in_collision)
WAYLESS = (PlanStatus.no_path, PlanStatus.timeout)


def tight_links(controller: _core.Controller, arm: _core.Arm) -> dict[str, int]:
    """How many ellipsoids to give links that may be why no way leads to the goal; empty if finer covers cannot help.

    If an end is blocked: the links that are named, where they overshoot by more than they reach into what is in the
    way, plus the margin that commands keep. If no path is found: every link that moves.

    Args:
        controller: with a goal. arm: what it moves.
    """
    margin = controller.settings.safety.margin
    plan, at_goal = controller.plan, controller.goal_obstruction
    overshoot = {proof.link: proof.max_overshoot for proof in arm.proof}
    links: list[str] = []
    if at_goal is not None or plan.status in BLOCKED:
        found = plan.obstruction if at_goal is None else at_goal
        links = [found.link, found.other] if found.kind == CoordinateKind.self else [found.link]
        if sum(overshoot.get(link, 0.0) for link in links) <= found.depth + margin:
            return {}
    elif plan.status in WAYLESS:
        links = [frame.name for frame in arm.robot.frames if frame.joint >= 0]
    numbers = {link: arm.body.links.count(link) for link in links if link in overshoot}
    following = {link: next((level for level in LEVELS if level > n), n) for link, n in numbers.items()}
    return {link: number for link, number in following.items() if number > numbers[link]}
