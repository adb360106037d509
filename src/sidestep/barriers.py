"""The numbers of the recommended system."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Barriers:
    """The numbers of the recommended system; see the barriers of the core for what each trades.

    Attributes:
        stiffness [1/s^2], damping [1/s]: of the pull to the goal.
        activation [m], strength, power: of obstacles.
        limit_activation [rad | m], limit_strength: of joint limits.
        self_activation [m], self_strength: of self-collision.
        floor [m]: clearance below which obstacles and links count as touched. temperature [m]: smoothing between them.
    """

    stiffness: float = 4.0
    damping: float = 4.0
    activation: float = 0.1
    strength: float = 0.1
    power: float = 2.0
    limit_activation: float = 0.1
    limit_strength: float = 0.02
    self_activation: float = 0.05
    self_strength: float = 0.02
    floor: float = 0.002
    temperature: float = 0.002
