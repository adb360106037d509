"""Times of steps, kept as a histogram, so that those of many processes add up."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

SHORTEST, LONGEST = 1e-8, 1e2  # [s] ends of the histogram
PER_DECADE = 500  # bins: a percentile is right to 0.5 %


@dataclass(eq=False)
class StepTimes:
    """A histogram of step times with bins of equal ratio; the longest is kept as it is."""

    counts: npt.NDArray[np.int64] = field(
        default_factory=lambda: np.zeros(round(np.log10(LONGEST / SHORTEST) * PER_DECADE), dtype=np.int64)
    )
    longest: float = 0.0

    def add(self, seconds: Array) -> None:
        """Adds times [s] of any shape."""
        if seconds.size == 0:
            return
        at = np.floor(np.log10(np.clip(seconds, SHORTEST, LONGEST) / SHORTEST) * PER_DECADE).astype(int)
        np.add.at(self.counts, np.minimum(at, len(self.counts) - 1), 1)
        self.longest = max(self.longest, float(seconds.max()))

    def merge(self, other: StepTimes) -> None:
        """Adds those of another."""
        self.counts += other.counts
        self.longest = max(self.longest, other.longest)

    @property
    def total(self) -> int:
        """Number of times."""
        return int(self.counts.sum())

    def percentile(self, percent: float) -> float | None:
        """The time [s] that `percent` of the steps do not exceed, to 0.5 %; None without any."""
        if self.total == 0:
            return None
        k = int(np.searchsorted(np.cumsum(self.counts), percent / 100.0 * self.total))
        return float(min(SHORTEST * 10 ** ((k + 1) / PER_DECADE), self.longest))

    def microseconds(self) -> dict[str, float | None]:
        """median, p95, p99, p99.9 and max [us]."""
        rows = {"median": 50.0, "p95": 95.0, "p99": 99.0, "p99.9": 99.9}
        found = {name: self.percentile(percent) for name, percent in rows.items()}
        found["max"] = self.longest if self.total else None
        return {name: None if value is None else round(1e6 * value, 3) for name, value in found.items()}
