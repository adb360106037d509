"""What the arm does, in words."""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from sidestep._core import Diagnosis, MotionState
from sidestep.studio.things import Thing

INSIDE = re.compile(r"(.*) is inside the barrier of (.*), and moves out")


def in_words(
    here: Diagnosis,
    there: Diagnosis | None,
    *,
    owners: npt.NDArray[np.intp],
    things: tuple[Thing, ...],
) -> str:
    """A diagnosis as a sentence, with the names of obstacles in place of the numbers of their points.

    Args:
        here: of the step. there: of an arm that rests, what it would be at its goal; None while it moves.
        owners: (n,) index of the thing that each point belongs to.
    """
    sentence = here.describe()
    if there is not None and here.state == MotionState.arriving:
        sentence = sentence.replace("arriving", "at rest", 1)
    elif there is not None and here.state in (MotionState.free, MotionState.sliding, MotionState.stuck):
        blocked = INSIDE.fullmatch(there.describe())
        if blocked is not None:
            way = f"stopped {here.way_left} from the goal"
            sentence = f"{way}, which is itself blocked: {blocked[1]} against {blocked[2]}"
        elif here.state == MotionState.free:
            sentence = sentence.replace("on the way", "held by the torque program's clearances", 1)

    def name(match: re.Match[str]) -> str:
        point = int(match[1])
        return things[owners[point]].name if 0 <= point < len(owners) else match[0]

    return re.sub(r"\blink (?=\S*link)", "", re.sub(r"obstacle point (-?\d+)", name, sentence))
