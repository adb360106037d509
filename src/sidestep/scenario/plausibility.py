"""Warnings of obstacles whose place or size is hardly in metres."""

from __future__ import annotations

import warnings

import numpy as np

from sidestep.distance import SceneObject
from sidestep.scenario.scenario import Obstacle
from sidestep.scenario.shape import PointSource

FAR = 100.0  # [m] a place beyond this is warned of; arms reach a hundredth of it
LARGE = (
    10.0  # [m] a solid that is larger than this in every direction is warned of; floors and walls are thin
)


def warn_of(item: Obstacle, thing: SceneObject, place: str) -> None:
    """Warns of an obstacle that is far away or large; `place` names it. A plane has neither place nor size."""
    if not thing.shape.bounded or isinstance(
        item.shape, PointSource
    ):  # the file of points has its own warning
        return
    size = min(thing.shape.extents)
    for key, position in (("position", item.position), ("motion.to", item.motion and item.motion.to)):
        if position and np.max(np.abs(position)) - 0.5 * size > FAR:
            _warn(f"{place}.{key} is {list(position)}, farther than {FAR:g} m; is it in metres?")
    if size > LARGE:
        _warn(f"{place}.shape: the {thing.kind} is more than {size:.4g} m wide; is it in metres?")


def _warn(words: str) -> None:
    warnings.warn(words, RuntimeWarning, stacklevel=4)
