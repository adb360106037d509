"""Bodies and arms of one robot, each made once; of a draft a finer one is made beside the loop."""

from __future__ import annotations

from collections.abc import Callable

from sidestep.arm import Arm, Refinement
from sidestep.body import Body
from sidestep.robot import Robot
from sidestep.scenario import Scenario
from sidestep.studio.systems import Covering, Recipe

Prepare = Callable[[Robot, Recipe], Body]
Draft = Callable[[Scenario], Arm]

STAGES = {  # of a preparation, in words for the page
    "cover": "ellipsoids around",
    "tables": "clearances between",
    "pairs": "which links can touch:",
}
FAILED = "failed, see the events"  # of a fine body: the draft stays
USUAL = str(Covering(None))


class PreparedBodies:
    """What is prepared of a robot.

    Args:
        prepare: gives the body by a recipe; may take long.
        draft: gives the arm of a description file in seconds; None: such arms are prepared as others are.
    """

    def __init__(self, prepare: Prepare, draft: Draft | None) -> None:
        self._prepare, self._draft = prepare, draft
        self._bodies: dict[str, Body] = {}
        self._arms: dict[str, Arm] = {}
        self._refinement: Refinement | None = None
        self._refining = ""

    def get(self, recipe: Recipe, scenario: Scenario, robot: Robot) -> tuple[Body, Arm | None]:
        """The body of a recipe, and the arm with it where it covers."""
        name = str(recipe)
        if (
            name not in self._bodies
            and name == USUAL
            and scenario.robot.urdf is not None
            and self._draft is not None
        ):
            self._arms[name] = self._draft(scenario)
            self._bodies[name] = self._arms[name].body
        if name not in self._bodies:
            self._bodies[name] = self._prepare(robot, recipe)
        if isinstance(recipe, Covering) and name not in self._arms:
            self._arms[name] = Arm.from_robot(robot, self._bodies[name])
        return self._bodies[name], self._arms.get(name)

    @property
    def is_draft(self) -> bool:
        """Whether the usual arm is a draft, of which a finer one is on its way."""
        return USUAL in self._arms and self._arms[USUAL].is_draft

    @property
    def refining(self) -> str:
        """How far the finer one is; empty without a draft."""
        return self._refining if self.is_draft else ""

    def finer(self) -> Arm | None:
        """The finer arm, once it is there; the first call begins to make it.

        Raises:
            RuntimeError: it cannot be made; once.
        """
        if self._refinement is None:
            self._refining = "just begun"
            self._refinement = Refinement(self._arms[USUAL], progress=self._hear)
            return None
        if not self._refinement.is_done or self._refining == FAILED:
            return None
        try:
            fine = self._refinement.wait(0.0)
        except RuntimeError:
            self._refining = FAILED
            raise
        self._arms[USUAL], self._bodies[USUAL] = fine, fine.body
        self._refinement = None
        return fine

    def stop(self) -> None:
        """Ends what is made beside the loop."""
        if self._refinement is not None:
            self._refinement.cancel()
            self._refinement = None

    def _hear(self, stage: str, item: str, done: int, total: int) -> None:
        """How far the finer one is, from a thread of its own."""
        self._refining = in_words(stage, item, done, total)


def in_words(stage: str, item: str, done: int, total: int) -> str:
    """How far a preparation is, for the page."""
    return f"{STAGES.get(stage, stage)} {item} ({done} of {total})"
