"""How late and lossy a connection to a simulated robot is."""

from __future__ import annotations

import math
from dataclasses import dataclass

HOLD_CYCLES = 20  # without a command before an arm brakes: what a lossy connection loses in a row


@dataclass(frozen=True)
class Link:
    """How late and how lossy each direction of a connection is.

    A message takes d + j: d is drawn uniformly from `delay` once a second, j from an exponential distribution with the
    mean `jitter` for every message. A message that is overtaken by a newer one is dropped.

    Attributes:
        delay: (least, most) [s]. jitter: [s]. loss: share of messages that never arrive. seed: of all draws.

    Raises:
        ValueError: a value outside its range.
    """

    delay: tuple[float, float] = (0.0, 0.0)
    jitter: float = 0.0
    loss: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        if not (0.0 <= self.delay[0] <= self.delay[1] < math.inf):
            raise ValueError(f"delay is {self.delay} s; allowed: 0 <= least <= most, finite")
        if not (0.0 <= self.jitter < math.inf):
            raise ValueError(f"jitter is {self.jitter} s; allowed: 0 or more, finite")
        if not (0.0 <= self.loss < 1.0):
            raise ValueError(f"loss is {self.loss}; allowed: a share from 0 to below 1")
        if self.seed < 0:
            raise ValueError(f"seed is {self.seed}; allowed: 0 or more")
