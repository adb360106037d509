"""A small session: a planar arm with a body of few ellipsoids, made in seconds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from sidestep import Scenario
from sidestep.scenario.scenario import RobotConfig
from sidestep.studio import messages as m
from sidestep.studio.headless import browser, driver
from sidestep.studio.session import Session
from sidestep.studio.start import scenario_of
from sidestep.studio.studio import Studio
from sidestep.studio.systems import make_body
from studio.looker import PATIENCE, Looker, reset

SMALL = 2  # ellipsoids per link: a second of work, and kept for all tests


@pytest.fixture
def scenario() -> Scenario:
    """planar2 turns past a ball."""
    return scenario_of(RobotConfig(name="planar2"))


@pytest.fixture
def make_session() -> Callable[..., Session]:
    def make(scenario: Scenario, **options: object) -> Session:
        kept = {"prepare": make_body, "ellipsoids": SMALL, "synchronous": True}  # motions that repeat
        return Session(scenario, **kept | options)  # type: ignore[arg-type]

    return make


@pytest.fixture(scope="session")
def playwright() -> Iterator[Any]:
    with driver() as started:
        yield started


@pytest.fixture(scope="session")
def chromium(playwright: Any) -> Iterator[Any]:
    with browser(playwright) as started:
        yield started


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("scenarios")


@pytest.fixture(scope="session")
def studio(folder: Path) -> Iterator[Studio]:
    scenario = scenario_of(RobotConfig(name="planar2"))
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        with Studio(scenario, port=0, ellipsoids=SMALL) as running:
            running.wait_ready(PATIENCE)
            running.send(m.SetRunning(False))
            running.server.scene.configure_default_lights(cast_shadow=False)  # half the time of a frame
            yield running


@pytest.fixture(scope="session")
def looker(chromium: Any, studio: Studio) -> Looker:
    return Looker(chromium, studio)


@pytest.fixture
def at_the_start(studio: Studio) -> None:
    """The arm at its start, paused, and one ball."""
    reset(studio)
