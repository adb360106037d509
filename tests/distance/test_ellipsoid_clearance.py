"""Ellipsoids against solids, where the distance is known."""

from __future__ import annotations

import numpy as np
import pytest

from sidestep import Body, Robot, SceneObject
from sidestep.distance import EllipsoidClearance
from sidestep.math.pose import pose_at
from sidestep.robot import planar_arm

SEMI_AXES = np.array([0.3, 0.05, 0.02])


@pytest.fixture
def arm() -> tuple[Robot, Body]:
    """One ellipsoid in the middle of the only moving link, its axes along the link's."""
    robot = Robot.from_urdf(planar_arm(1))
    level = 4.0
    body = Body(
        links=["link1"],
        weights=[1.0],
        means=[[0.25, 0.0, 0.0]],
        covariances=[np.diag(SEMI_AXES**2 / level)],
        levels=[level],
    )
    return robot, body


@pytest.mark.parametrize(
    ("turn", "height", "expected"),
    [(0.0, 0.2, 0.13), (0.0, 0.12, 0.05), (0.0, 0.06, -0.01), (np.pi, 0.2, 0.13)],
)
def test_distance_along_an_axis(arm: tuple[Robot, Body], turn: float, height: float, expected: float) -> None:
    robot, body = arm
    side = 0.25 * np.cos(turn)
    box = SceneObject("box", "box", size=(0.1, 0.1, 0.1), pose=pose_at([side, 0.0, height]))
    ball = SceneObject.ball("ball", [side, 0.0, -height], radius=0.05)
    for item in (box, ball):
        found = EllipsoidClearance(robot, body, [item]).distance(np.array([turn]))
        # 1e-5 m: Coal's iteration on curved shapes ends at 1e-6 of its size
        assert found.distance == pytest.approx(expected, abs=1e-5)
        assert (found.link, found.obstacle) == ("link1", item.name)


def test_what_cannot_be_measured_is_refused(arm: tuple[Robot, Body]) -> None:
    robot, body = arm
    bare = Body(links=["link1"], weights=[1.0], means=body.means, covariances=body.covariances)
    with pytest.raises(ValueError, match="has no levels"):
        EllipsoidClearance(robot, bare, [])
