"""Which links need a finer cover, where a planner finds no way for the cover that they have."""

from __future__ import annotations

from sidestep import _core
from sidestep._core import CoordinateKind, PlanStatus

LEVELS = (24, 48)  # ellipsoids of a link, one after the other: they overshoot half as much as 8, and a third
BLOCKED = (PlanStatus.goal_in_collision, PlanStatus.start_in_collision)
WAYLESS = (PlanStatus.no_path, PlanStatus.timeout)


def tight_links(plan: _core.Plan, arm: _core.Arm, margin: float) -> dict[str, int]:
    """How many ellipsoids links are to have that may be why a plan failed; empty where a finer cover cannot help.

    Of an end in collision: the links that are named, if both overshoot together by more than they reach into what is in
    the way, and the margin. Where an arm finds no path: every link that moves.

    Args:
        plan: the last one. arm: what it is for. margin: [m] that commands keep.
    """
    overshoot = {proof.link: proof.max_overshoot for proof in arm.proof}
    links: list[str] = []
    if plan.status in BLOCKED:
        found = plan.obstruction
        links = [found.link, found.other] if found.kind == CoordinateKind.self else [found.link]
        if sum(overshoot.get(link, 0.0) for link in links) <= found.depth + margin:
            return {}
    elif plan.status in WAYLESS:
        links = [frame.name for frame in arm.robot.frames if frame.joint >= 0]
    numbers = {link: arm.body.links.count(link) for link in links if link in overshoot}
    following = {link: next((level for level in LEVELS if level > n), n) for link, n in numbers.items()}
    return {link: number for link, number in following.items() if number > numbers[link]}
