"""A planar arm in ellipsoids made by hand."""

from __future__ import annotations

import pytest

import sidestep as ss
from sidestep import _core
from support.planar_problems import BODY


@pytest.fixture(scope="session")
def robot() -> ss.Robot:
    return ss.Robot.named("planar3")


@pytest.fixture(scope="session")
def body() -> _core.Body:
    return _core.Body(**BODY)
