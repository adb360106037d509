"""A small session: a planar arm with a body of few ellipsoids, made in seconds."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from sidestep import Body, Robot, Scenario
from sidestep.scenario.scenario import RobotChoice
from sidestep.studio.methods import Method
from sidestep.studio.session import Session
from sidestep.studio.start import scenario_of

SMALL = 2  # ellipsoids per link: a second of work, and kept for all tests


def small_body(robot: Robot, method: Method) -> Body:
    if method.covering:
        return Body.cover(robot, components=SMALL)
    return Body.fit(robot, components=1)


@pytest.fixture
def scenario() -> Scenario:
    """planar2 turns past a ball."""
    return scenario_of(RobotChoice(name="planar2"))


@pytest.fixture
def make_session() -> Callable[..., Session]:
    def make(scenario: Scenario, **options: object) -> Session:
        return Session(scenario, prepare=small_body, **options)  # type: ignore[arg-type]

    return make
