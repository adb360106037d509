"""What the steps of one motion leave behind."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

TIMED = 2000  # steps whose times are kept: two seconds at 1 kHz


@dataclass
class Steps:
    """Of one motion, from its start.

    Attributes:
        torque: (nv,) [Nm | N] of the last. count: so far. touched: how many of them in contact.
        contacts: pairs that touch now, in words. times: of the last ones [s].
    """

    torque: npt.NDArray[np.float64]
    count: int = 0
    touched: int = 0
    contacts: tuple[str, ...] = ()
    times: deque[float] = field(default_factory=lambda: deque(maxlen=TIMED))
