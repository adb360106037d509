"""Where the arm of a session is to go."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class Aim(NamedTuple):
    """A pose (4, 4) or None, and the configuration, or one near that of the pose; written: as the scenario says."""

    pose: Array | None
    near: Array
    written: bool
