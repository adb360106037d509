"""The true motion of a simulated arm, cycle by cycle, as a file."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

MAX_CYCLES = 2_000_000  # of one record, as of a scenario: half an hour at 1 kHz, of seven joints 400 MB
COLUMNS = ("time", "q", "v", "torque", "object_poses")


@dataclass
class MotionRecord:
    """Rows (T, …) of a motion: time [s], q, v, torque (T, nv) and the poses of the objects (T, N, 7).

    Attributes:
        left_out: cycles after the record was full.
    """

    left_out: int = 0
    _rows: list[tuple[float, Array, Array, Array, Array]] = field(default_factory=list)

    def add(self, time: float, q: Array, v: Array, torque: Array, object_poses: Array) -> None:
        """One cycle."""
        if len(self._rows) >= MAX_CYCLES:
            self.left_out += 1
            return
        self._rows.append((time, q, v, torque, object_poses))

    def save(self, path: Path) -> None:
        """Writes the columns as an .npz file."""
        columns = zip(*self._rows, strict=True) if self._rows else [()] * len(COLUMNS)
        arrays: dict[str, Any] = {
            name: np.array(column) for name, column in zip(COLUMNS, columns, strict=True)
        }
        np.savez(path, **arrays)
