"""What a part of the report is made of: figures and tables with their captions and data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure as Drawing

Array = npt.NDArray[np.float64]
Data = Mapping[str, npt.NDArray[np.generic]]
Notify = Callable[[str], None]


@dataclass(frozen=True)
class Caption:
    """The four things that every figure and table says about itself.

    Attributes:
        shows: what is seen.
        answers: which figure, table or section of the thesis it stands beside.
        parameters: the numbers that it was made with.
        differs: where it differs from the thesis, and why.
    """

    shows: str
    answers: str
    parameters: str
    differs: str

    def lines(self) -> tuple[tuple[str, str], ...]:
        """The caption as (label, text)."""
        return (
            ("Shows", self.shows),
            ("Answers", self.answers),
            ("Parameters", self.parameters),
            ("Differs", self.differs),
        )


@dataclass(frozen=True, eq=False)
class Figure:
    """A drawing, and the arrays behind it.

    Attributes:
        key: of the thesis's figure, such as "5.1" or "B.2".
        title, caption: text.
        drawing: Matplotlib figure.
        data: name (with its unit) to array; equally long columns become CSV, everything else NPZ.
    """

    key: str
    title: str
    caption: Caption
    drawing: Drawing
    data: Data = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Stem of its files."""
        return f"figure-{self.key}"


@dataclass(frozen=True, eq=False)
class Table:
    """A table of text, and the arrays behind it.

    Attributes:
        key: of the thesis's table, or a word for those it does not have.
        title, caption: text.
        columns: headings, with units.
        rows: cells, one tuple per row.
        data: name (with its unit) to array; empty: the cells themselves become the CSV file.
    """

    key: str
    title: str
    caption: Caption
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    data: Data = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Stem of its files."""
        return f"table-{self.key}"


Item = Figure | Table
