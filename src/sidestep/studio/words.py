"""What the arm does, in words."""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from sidestep.studio.scene_obstacle import SceneObstacle


def named(sentence: str, *, owners: npt.NDArray[np.intp], things: tuple[SceneObstacle, ...]) -> str:
    """A sentence about a step with the names of obstacles in place of the numbers of their points.

    Args:
        owners: (n,) index of the thing that each point belongs to.
    """

    def name(match: re.Match[str]) -> str:
        point = int(match[1])
        return things[owners[point]].name if 0 <= point < len(owners) else match[0]

    return re.sub(r"\blink (?=\S*link)", "", re.sub(r"obstacle point (-?\d+)", name, sentence))
