"""The smallest distance of pairs of bodies along a motion, by how fast they can come closer."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

FINE_CHECKS = 100_000  # distances at the tolerance asked for, some ten seconds; a thesis run takes a thousand
LOOKS = 256  # moments of a motion at which bounding balls show which pairs are near when
FIRST_LOOKS = 16  # of these, at which the closest pairs are measured, for a good first guess of the minimum


class Pairs(Protocol):
    """K pairs of bodies along a motion of T samples. A position s along it is in samples: 4.25 is a quarter of the
    way from 4 to 5. Distances and lower bounds of them are in m; a lower bound that is not above 0 says nothing."""

    def progress(self) -> Array:
        """(T,) not decreasing: the looks are taken at even steps of it."""

    def gaps(self, positions: Array) -> Array:
        """Lower bounds (M, K) of the distances at positions (M,)."""

    def travel_to(self, positions: Array) -> Array:
        """How far (M, K) [m] a pair can have come closer between the start and positions (M,)."""

    def travel(self, k: int) -> Array:
        """The same (T,) for pair k at the samples."""

    def at_least(self, k: int, position: float) -> float:
        """A better lower bound for pair k at a position."""

    def measure(self, k: int, position: float) -> float:
        """A distance at a position that is no larger than that of pair k."""


class Smallest(NamedTuple):
    """The smallest distance that was measured.

    Attributes:
        distance: [m]; infinite without pairs.
        pair, position: of which, and where; -1 without pairs.
        checks: number of looks at a pair that this took.
        tolerance: [m] no distance of the motion is smaller by more.
    """

    distance: float
    pair: int
    position: float
    checks: int
    tolerance: float


def smallest_distance(pairs: Pairs, *, tolerance: float, enough: float = -np.inf) -> Smallest:
    """The smallest distance of a motion, to within a tolerance [m].

    A pair with a lower bound d is skipped until it can have come closer by d - (smallest so far) + tolerance. Where d
    could be below the smallest so far by half of the tolerance, or is not above 0, the pair is measured. Between two
    looks with bounds d, d' and a travel L from one to the other, it is nowhere below (d + d' - L) / 2.

    The number of checks is bounded by the travel over the tolerance, which a diverging motion makes endless. So after
    `FINE_CHECKS` of them the tolerance becomes at least twice the travel of all pairs over `FINE_CHECKS`: no motion
    takes more than twice that many checks, and one per pair and first look.

    Args:
        pairs: along the motion.
        tolerance: [m] > 0.
        enough: [m] ends at the first distance that is not larger.
    """
    progress = pairs.progress()
    samples = np.arange(len(progress), dtype=np.float64)
    at = np.interp(np.linspace(0.0, progress[-1], LOOKS), progress, samples)
    gaps, travel = pairs.gaps(at), pairs.travel_to(at)
    between = 0.5 * (gaps[:-1] + gaps[1:] - np.diff(travel, axis=0))
    between[(gaps[:-1] <= 0.0) | (gaps[1:] <= 0.0)] = -np.inf
    coarse = max(tolerance, 2.0 * float(travel[-1].sum()) / FINE_CHECKS)
    best, pair, where, checks = np.inf, -1, -1.0, 0

    def bound(k: int, position: float, below: float) -> float:
        """A lower bound of pair k; the pair is measured where this is not above `below`."""
        nonlocal best, pair, where, checks
        checks += 1
        distance = pairs.at_least(k, position)
        if distance <= max(below, 0.0):
            distance = pairs.measure(k, position)
            if distance < best:
                best, pair, where = distance, k, position
        return distance

    for look in range(0, LOOKS, LOOKS // FIRST_LOOKS):
        for k in map(int, np.argsort(gaps[look])):
            if gaps[look, k] >= best:
                break
            bound(k, float(at[look]), best)
    for k in map(int, np.argsort(gaps.min(axis=0))):
        near = np.flatnonzero(between[:, k] <= max(best - tolerance, 0.0))
        if best <= enough:
            break
        if len(near) == 0:
            continue
        so_far, here = pairs.travel(k), 0.0
        for look in map(int, near):
            here = max(here, float(travel[look, k]))
            while here < travel[look + 1, k] and best > enough:
                distance = bound(k, float(np.interp(here, so_far, samples)), best - 0.5 * tolerance)
                if checks >= FINE_CHECKS:
                    tolerance = coarse
                here += distance - best + tolerance
    return Smallest(float(best), pair, where, checks, tolerance)
