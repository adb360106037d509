"""Which links of an arm get barriers against each other, and how near their ellipsoids may come."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from sidestep._core import Obstacles, SelfCollisionBarrier
from sidestep.body import Body
from sidestep.robot import Robot
from sidestep.simulation import SelfCollision

LinkPair: TypeAlias = tuple[str, str, float]

SAMPLES = 3000  # random configurations, of which the gaps between ellipsoids are taken
FEW = 3  # coordinates between two links: of so few the samples leave no way of touching out
NEAR = 0.002  # distance of meshes that counts as touching [m]: the samples do not hit contact itself
SHARE = 0.95  # of samples in which the meshes are apart that the ellipsoids must be: otherwise they are no measure


def barrier_pairs(robot: Robot, body: Body) -> tuple[LinkPair, ...]:
    """The pairs of links for `SelfCollisionBarrier`, with the gap at which they touch: (first, second, contact).

    Covering ellipsoids are larger than links: neighbours but one overlap while their meshes are apart. Where at most
    three coordinates lie between two links, `contact` is the largest gap between their ellipsoids, in random
    configurations, at which their meshes are within 2 mm. It is zero, which is safe without samples, where more lie
    between them or none came so near. Pairs whose clearance is then below zero in more than 5 % of the samples,
    though they do not touch, are left out.

    Args:
        robot: with collision meshes. body: a covering body of it.
    """
    check = SelfCollision(robot)
    pairs = [pair for pair in check.pairs if set(body.links).issuperset(pair)]
    if not pairs:
        return ()
    barrier = SelfCollisionBarrier(robot, body, pairs)
    few = np.array([len(check.coordinates_between(*pair)) <= FEW for pair in pairs])
    rng, rest = np.random.default_rng(0), np.zeros(robot.num_coordinates)
    apart: list[list[float]] = [[] for _ in pairs]  # gaps
    touch = np.full(len(pairs), -np.inf)
    for sample in range(SAMPLES):
        q = robot.random_configuration(rng)
        gaps = barrier.evaluate(q, rest, Obstacles.none()).clearances
        # Ellipsoids cover links: those of links that touch overlap.
        for k in np.flatnonzero((gaps < NEAR) & (few | (sample < SAMPLES // 10))):
            if check.distance_between(q, *pairs[k]) > NEAR:
                apart[k].append(gaps[k])
            else:
                touch[k] = max(touch[k], gaps[k])
    contact = np.where(few & np.isfinite(touch), np.minimum(touch, 0.0), 0.0)
    found = []
    for k, pair in enumerate(pairs):
        overlapping = sum(gap < contact[k] for gap in apart[k])
        if overlapping <= (1.0 - SHARE) * (SAMPLES if few[k] else SAMPLES // 10):
            found.append((*pair, float(contact[k])))
    return tuple(found)
