"""The thesis's system, with one set of numbers for every robot and scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sidestep._core import CollisionDensity, DistanceSwitch, GeometricSystem, JointLimitPotential, Sum
from sidestep.body import Body
from sidestep.robot import Robot


@dataclass(frozen=True)
class ThesisNumbers:
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


def thesis_system(
    robot: Robot, body: Body | None = None, *, switched: bool = True, numbers: ThesisNumbers = ThesisNumbers()
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
