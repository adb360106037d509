"""Numbers that programs on the robot and clients share."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Value: TypeAlias = int | float

SIZE = 48  # registers of each kind


class Registers:
    """Integers and doubles, in and out; by the names that RTDE gives them, for example input_int_register_0.

    Attributes:
        values: by name.
        written: when a client wrote last, on the box's clock [s].
    """

    def __init__(self) -> None:
        """All 0."""
        self.values: dict[str, Value] = {
            f"{way}_{kind}_register_{number}": 0 if kind == "int" else 0.0
            for way in ("input", "output")
            for kind in ("int", "double")
            for number in range(SIZE)
        }
        self.written = 0.0

    @property
    def command(self) -> int:
        """What a client wants of the control program."""
        return int(self.values["input_int_register_0"])

    def doubles(self, count: int) -> Array:
        """The first inputs (count,)."""
        return np.array([self.values[f"input_double_register_{number}"] for number in range(count)])

    def set_output(self, value: int) -> None:
        """What the control program says of the command."""
        self.values["output_int_register_0"] = value

    def set_output_doubles(self, values: Array) -> None:
        """The first outputs."""
        for number, value in enumerate(values):
            self.values[f"output_double_register_{number}"] = float(value)
