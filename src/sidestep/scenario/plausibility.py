"""Warnings of obstacles whose place or size is hardly in metres."""

from __future__ import annotations

import warnings

import numpy as np

from sidestep.distance import SceneObject
from sidestep.scenario.scenario import Obstacle

FAR = 100.0  # [m] a place beyond this is warned of; arms reach a hundredth of it
LARGE = (
    10.0  # [m] a solid that is larger than this in every direction is warned of; floors and walls are thin
)


def warn_of(item: Obstacle, thing: SceneObject, place: str) -> None:
    """Warns of an obstacle that is far away or large; `place` names it. A plane has neither place nor size."""
    if thing.kind == "plane" or item.shape.type == "points":  # the file of points has its own warning
        return
    size = _least_extent(thing)
    for key, position in (("position", item.position), ("motion.to", item.motion and item.motion.to)):
        if position and np.max(np.abs(position)) - 0.5 * size > FAR:
            _warn(f"{place}.{key} is {list(position)}, farther than {FAR:g} m; is it in metres?")
    if size > LARGE:
        _warn(f"{place}.shape: the {thing.kind} is more than {size:.4g} m wide; is it in metres?")


def _least_extent(thing: SceneObject) -> float:
    """The shortest edge of the box around a solid in its own frame [m]."""
    if thing.mesh is not None:
        return float(min(thing.mesh.extents))
    match thing.kind:
        case "sphere" | "capsule":
            return 2.0 * thing.size[0]
        case "cylinder":
            return min(2.0 * thing.size[0], thing.size[1])
    return min(thing.size)


def _warn(words: str) -> None:
    warnings.warn(words, RuntimeWarning, stacklevel=4)
