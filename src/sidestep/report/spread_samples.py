"""A few samples, evenly spread over a stream of which nobody knows how long it is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

Sample = TypeVar("Sample")


class SpreadSamples(Generic[Sample]):
    """Keeps between twice and four times `number` samples; the stride doubles whenever there are more."""

    def __init__(self, number: int) -> None:
        self._number, self._stride, self._offered = number, 1, 0
        self._kept: list[Sample] = []

    def offer(self, make: Callable[[], Sample]) -> None:
        """The next of the stream; it is made only where it is kept."""
        if self._number > 0 and self._offered % self._stride == 0:
            self._kept.append(make())
            if len(self._kept) > 4 * self._number:
                self._kept = self._kept[::2]
                self._stride *= 2
        self._offered += 1

    def chosen(self) -> list[Sample]:
        """`number` of those that are kept, the first and the last among them, or all where there are fewer."""
        count = len(self._kept)
        if count <= self._number:
            return list(self._kept)
        if self._number == 1:
            return self._kept[-1:]
        return [self._kept[round(n * (count - 1) / (self._number - 1))] for n in range(self._number)]
