"""Speed, distance and caution: three sliders in place of many settings of the controller."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from sidestep.studio.parameters import Method, Numbers

MM = 1e-3  # [m]
USUAL_DISTANCE, USUAL_ACTIVATION = 5.0, 0.1  # [mm], [m] defaults of the controller
LOOK_CLOSER = 1.0  # [mm] by which a predicted motion may come nearer than a command: it is a prediction
WIDER = 1.2  # a wide way is at least so much wider than the narrowest that is allowed


@dataclass(frozen=True)
class Slider:
    """One of the three.

    Attributes:
        label, sentence: on the page. lower, upper, step, usual: of its value.
        of: its value for the numbers of a method. settings: numbers of a method for its value, perhaps more than the
            method has.
        leading: the number that it shows.
    """

    label: str
    sentence: str
    lower: float
    upper: float
    step: float
    usual: float
    leading: str
    of: Callable[[Mapping[str, Any]], float]
    settings: Callable[[float], Numbers]

    def applies_to(self, numbers: Mapping[str, Any]) -> bool:
        """Whether a method with these numbers can be set by it."""
        return self.leading in numbers

    def numbers(self, value: float, method: Method) -> Numbers:
        """The numbers of a method for its value, within their ranges."""
        known = {parameter.name: parameter for parameter in method.parameters}
        return {
            name: min(max(number, known[name].lower), known[name].upper)
            for name, number in self.settings(value).items()
            if name in known
        }


def _distance(value: float) -> Numbers:
    return {
        "safety_margin": MM * value,
        "planner_floor": MM * value,
        "planner_margin": max(0.06, MM * value * WIDER),
        "look_ahead_clearance": MM * (value - LOOK_CLOSER),
    }


def _caution(value: float) -> Numbers:
    return {"activation": USUAL_ACTIVATION * value, "look_ahead_horizon": 2.0 * value}


SLIDERS = (
    Slider(
        "speed [%]",
        "Share of the velocity and acceleration limits that motions use.",
        10.0,
        100.0,
        5.0,
        100.0,
        "speed",
        lambda numbers: 100.0 * float(numbers["speed"]),
        lambda value: {"speed": 0.01 * value},
    ),
    Slider(
        "distance [mm]",
        "Clearance that every command and every path keep.",
        2.0,
        60.0,
        1.0,
        USUAL_DISTANCE,
        "safety_margin",
        lambda numbers: float(numbers["safety_margin"]) / MM,
        _distance,
    ),
    Slider(
        "caution [×]",
        "How early the arm turns away, and how far it looks ahead.",
        0.5,
        3.0,
        0.1,
        1.0,
        "activation",
        lambda numbers: float(numbers["activation"]) / USUAL_ACTIVATION,
        _caution,
    ),
)
