"""One set of numbers for every robot and scene: the systems that Sidestep recommends or compares with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sidestep._core import (
    ClearanceBarrier,
    ClearanceTableBarrier,
    CollisionDensity,
    DistanceSwitch,
    Embedding,
    GeometricSystem,
    JointLimitBarrier,
    JointLimitPotential,
    SelfCollisionBarrier,
    Sum,
)
from sidestep.barriers import Barriers as Barriers
from sidestep.body import Body
from sidestep.link_pairs import tables_and_pairs
from sidestep.robot import Robot


@dataclass(frozen=True)
class Thesis:
    """The numbers of the thesis (Bosc 2024, 6.2.2); slope and Gaussians per link are not stated there.

    Attributes:
        stiffness [1/s^2], damping [1/s]: of the pull to the goal.
        outer, inner: distance thresholds [m] of the two first and the last joint, and of those between.
        slope: of the switch [1/m]. components: Gaussians per link.
    """

    stiffness: float = 0.5
    damping: float = 1.5
    outer: float = 0.1
    inner: float = 0.2
    slope: float = 20.0
    components: int = 2


def barrier_system(
    robot: Robot, body: Body | None = None, *, numbers: Barriers = Barriers(), self_collision: bool = True
) -> GeometricSystem:
    """The recommended system: a barrier for every part of the body, every joint limit, every pair of links.

    Args:
        robot: the arm. body: a covering body of it; by default `Body.cover(robot)`.
        numbers: in place of the defaults.
        self_collision: whether pairs of links get barriers.
    """
    body = body if body is not None else Body.cover(robot)
    parts: list[Embedding] = [
        ClearanceBarrier(
            robot,
            body,
            activation=numbers.activation,
            strength=numbers.strength,
            power=numbers.power,
            floor=numbers.floor,
            temperature=numbers.temperature,
        ),
        JointLimitBarrier(
            robot, activation=numbers.limit_activation, strength=numbers.limit_strength, power=numbers.power
        ),
    ]
    if self_collision:
        parts += _self_collision(robot, body, numbers)
    return GeometricSystem(parts, stiffness=numbers.stiffness, damping=numbers.damping, pull_form="one_sided")


def _self_collision(robot: Robot, body: Body, numbers: Barriers) -> list[Embedding]:
    """By tables where there are any, by covers between other links that may touch."""
    settings = {
        "activation": numbers.self_activation,
        "strength": numbers.self_strength,
        "power": numbers.power,
        "floor": numbers.floor,
    }
    parts: list[Embedding] = []
    tables, pairs = tables_and_pairs(robot, body)
    if tables:
        parts.append(ClearanceTableBarrier(robot, tables, **settings))
    if pairs:
        parts.append(SelfCollisionBarrier(robot, body, pairs, temperature=numbers.temperature, **settings))
    return parts


def thesis_system(
    robot: Robot, body: Body | None = None, *, switched: bool = True, numbers: Thesis = Thesis()
) -> GeometricSystem:
    """The thesis's system: one summed density, with the distance switch (T6.2) or unswitched (T2.12).

    Args:
        robot: the arm. body: a mixture; by default `Body.fit` with the thesis's number of Gaussians.
        switched: with the distance switch. numbers: in place of the defaults.
    """
    body = body if body is not None else Body.fit(robot, components=numbers.components)
    nv = robot.num_coordinates
    thresholds = np.full(nv, numbers.inner)
    thresholds[[*range(min(2, nv)), nv - 1]] = numbers.outer
    return GeometricSystem(
        [Sum([CollisionDensity(robot, body), JointLimitPotential(robot)])],
        stiffness=numbers.stiffness,
        damping=numbers.damping,
        switch=DistanceSwitch(thresholds=thresholds, slope=numbers.slope) if switched else None,
    )
