"""Which links of an arm get barriers against each other, and how near their ellipsoids may come."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from sidestep._core import Obstacles, SelfCollisionBarrier
from sidestep.body import Body
from sidestep.robot import Robot
from sidestep.simulation import SelfCollision

Array: TypeAlias = npt.NDArray[np.float64]
LinkPair: TypeAlias = tuple[str, str, float]

SAMPLES = 3000  # random configurations, of which the gaps between ellipsoids are taken
FEW = 3  # coordinates between two links of which so many samples are dense enough to calibrate a contact
TOUCHING = 20  # samples in which they touch that are needed for it
WAYS = (
    200  # from a sample in which they touch to one in which they do not, on which the contact is looked for
)
NEAR = 0.002  # distance of meshes that counts as touching [m]
SHARE = 0.95  # of samples in which the meshes are apart that the ellipsoids must be: otherwise they are no measure


def barrier_pairs(robot: Robot, body: Body) -> tuple[LinkPair, ...]:
    """The pairs of links for `SelfCollisionBarrier`, with the gap at which they touch: (first, second, contact).

    Covering ellipsoids are larger than links: neighbours but one overlap while their meshes are apart. Where at most
    three coordinates lie between two links that touch in 20 random configurations at least, `contact` is the largest
    gap between their ellipsoids at which their meshes come within 2 mm, on straight ways from 100 configurations in
    which they touch to others: an estimate by samples. Else it is zero, which is safe. Pairs whose clearance is then
    below zero in more than 5 % of the samples, though they do not touch, are left out.

    Args:
        robot: with collision meshes. body: a covering body of it.
    """
    check = SelfCollision(robot)
    pairs = [pair for pair in check.pairs if set(body.links).issuperset(pair)]
    if not pairs:
        return ()
    barrier = SelfCollisionBarrier(robot, body, pairs)
    rng, rest = np.random.default_rng(0), np.zeros(robot.num_coordinates)

    def gaps(q: Array) -> Array:
        return barrier.evaluate(q, rest, Obstacles.none()).clearances

    configurations = np.array([robot.random_configuration(rng) for _ in range(SAMPLES)])
    found = np.array([gaps(q) for q in configurations])
    result = []
    for k, pair in enumerate(pairs):
        few = len(check.coordinates_between(*pair)) <= FEW
        looked = slice(0, SAMPLES if few else SAMPLES // 10)
        # Ellipsoids cover links: those of links that touch overlap.
        overlap = np.flatnonzero(found[looked, k] < 0.0)
        touch = np.array([check.within(configurations[i], *pair, NEAR) for i in overlap], dtype=bool)
        contact = 0.0
        if few and touch.sum() >= TOUCHING:
            apart = np.setdiff1d(np.arange(SAMPLES), overlap[touch])
            ends = zip(rng.choice(overlap[touch], WAYS), rng.choice(apart, WAYS), strict=True)
            first = [_first_touch(check, pair, configurations[i], configurations[j]) for i, j in ends]
            contact = min(0.0, max(float(gaps(q)[k]) for q in first))
        below = int((found[overlap[~touch], k] < contact).sum())
        if below <= (1.0 - SHARE) * looked.stop:
            result.append((*pair, contact))
    return tuple(result)


def _first_touch(check: SelfCollision, pair: tuple[str, str], touching: Array, apart: Array) -> Array:
    """A configuration between the two at which the pair is just within `NEAR`, by halving."""
    for _ in range(14):  # to 1/16,000 of the way
        middle = 0.5 * (touching + apart)
        if check.within(middle, *pair, NEAR):
            touching = middle
        else:
            apart = middle
    return touching
