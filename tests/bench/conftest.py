"""A planar arm with a small covering body, so that a benchmark takes a second."""

from __future__ import annotations

import pytest

from sidestep import Arm, Body, Robot
from sidestep.bench import ControllerRunner, ProblemGenerator, ProblemSettings


@pytest.fixture(scope="session")
def generator() -> ProblemGenerator:
    return ProblemGenerator(ProblemSettings(robot="planar3", obstacles=3, seed=5))


@pytest.fixture(scope="session")
def runner(generator: ProblemGenerator) -> ControllerRunner:
    body = Body.cover(generator.robot, components=3, cache=False)
    return ControllerRunner(generator.robot, Arm.from_robot(generator.robot, body))


@pytest.fixture(scope="session")
def arm() -> Robot:
    return Robot.named("fr3")
