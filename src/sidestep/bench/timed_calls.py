"""Calls of a controller with the times of a simulation; without them where the core does not know them yet.

Once `Controller.step` takes `time` in every checkout, this file goes, and its callers call the controller.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep._core import Controller

_STEP_TAKES_TIME = ", time:" in Controller.step.__nb_signature__[0][0]  # type: ignore[attr-defined]
_SETS_HAVE_SOURCES = ", source:" in Controller.set_obstacles.__nb_signature__[0][0]  # type: ignore[attr-defined]


def step_at(
    controller: Controller, q: npt.NDArray[np.float64], v: npt.NDArray[np.float64], time: float
) -> None:
    """A step at a time [s]."""
    step: Any = controller.step
    if _STEP_TAKES_TIME:
        step(q, v, time=time)
    else:
        step(q, v)


def set_stamped(
    controller: Controller, obstacles: Any, source: str, *, time: float, valid_for: float
) -> None:
    """Obstacles of a source, captured at a time [s] and valid so long [s]."""
    set_obstacles: Any = controller.set_obstacles
    if _SETS_HAVE_SOURCES:
        set_obstacles(obstacles, source, time=time, valid_for=valid_for)
    else:
        set_obstacles(obstacles)
