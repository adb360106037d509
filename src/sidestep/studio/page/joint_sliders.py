"""A slider for each joint of an arm: turning joints in degrees, sliding ones in metres."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sidestep._core import JointType
from sidestep.robot import Robot
from sidestep.robot.configurations import finite_interval
from sidestep.studio.page.arm import short_names

if TYPE_CHECKING:
    import viser

Array = npt.NDArray[np.float64]

STEP_DEGREES, STEP_METRES = 0.1, 0.001
DECIMALS_DEGREES, DECIMALS_METRES = 1, 3  # that are shown: more do not fit the field
FEWEST_STEPS = 20  # of a slider: a stroke of some millimetres gets finer ones


class JointSliders:
    """Sliders within the position limits, ±pi where a joint has none.

    Args:
        server, robot: where, and of what. hint: before the name of each joint, when the mouse rests there.
        on_move: called with the configuration (nv,), within the limits, when a person moves one.
    """

    def __init__(
        self, server: viser.ViserServer, robot: Robot, on_move: Callable[[Array], None], *, hint: str
    ) -> None:
        self._robot, self._on_move = robot, on_move
        turning = {joint.coordinate for joint in robot.joints if joint.type == JointType.revolute}
        self._factors = np.array(
            [180.0 / np.pi if k in turning else 1.0 for k in range(robot.num_coordinates)]
        )
        self._decimals = [
            DECIMALS_DEGREES if k in turning else DECIMALS_METRES for k in range(len(self._factors))
        ]
        self._q = np.array(robot.neutral)
        self._sliders: list[Any] = []
        lower, upper = finite_interval(robot.limits)
        labels = short_names(robot.coordinate_names)
        for k, name in enumerate(robot.coordinate_names):
            low, high, rest = (float(self._factors[k] * value[k]) for value in (lower, upper, robot.neutral))
            step = min(STEP_DEGREES if k in turning else STEP_METRES, (high - low) / FEWEST_STEPS)
            if k in turning and step == STEP_DEGREES:  # whole steps within the limits
                low, high = float(np.ceil(10.0 * low) / 10.0), float(np.floor(10.0 * high) / 10.0)
            slider = server.gui.add_slider(
                f"{labels[k]} [{'°' if k in turning else 'm'}]",
                min=low,
                max=high,
                step=step,
                initial_value=float(np.clip(round(rest, self._decimals[k]), low, high)),
                hint=f"{hint} {name}",
            )
            slider.on_update(self._moved)
            self._sliders.append(slider)

    def show(self, q: Array) -> None:
        """Puts the sliders where q (nv,) is, whoever set it."""
        self._q = np.array(q)
        for slider, value, decimals in zip(self._sliders, self._factors * q, self._decimals, strict=True):
            shown = float(np.clip(round(float(value), decimals), slider.min, slider.max))
            if slider.value != shown:  # the one that is being moved is left alone
                slider.value = shown

    def remove(self) -> None:
        """Takes them off the page."""
        for slider in self._sliders:
            slider.remove()

    async def _moved(self, event: Any) -> None:
        if event.client is None:  # set by `show`
            return
        k = self._sliders.index(event.target)
        self._q[k] = self._sliders[k].value / self._factors[k]  # the others are not rounded to what they show
        limits = self._robot.limits
        self._on_move(np.clip(self._q, limits.lower, limits.upper))
