"""A page attached to an arm that another program serves."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import sidestep as ss
from sidestep.drivers import Ideal
from sidestep.link import Server
from sidestep.loop import Loop
from sidestep.scenario.scenario import Obstacle, RobotConfig
from sidestep.shapes import Sphere
from sidestep.studio import messages as m
from sidestep.studio import served_session
from sidestep.studio.page.recorder import Recorder
from sidestep.studio.scene_obstacle import SceneObstacle
from sidestep.studio.served_session import ServedSession
from sidestep.studio.start import scenario_of
from support.busy_machine import PATIENT

pytest.importorskip("mujoco")
PATIENCE = 20.0  # [s] on a busy machine


@pytest.fixture
def served(tmp_path: Path) -> Iterator[tuple[ss.Controller, str]]:
    arm = ss.Arm.load("fr3")
    controller = ss.Controller(arm, ss.ControllerSettings(output="position"))
    controller.set_obstacles(ss.Obstacles.none())
    server = Server(controller, f"unix:{tmp_path / 'arm'}")
    loop = Loop(controller, Ideal(arm), PATIENT, observers=[server])
    loop.start()
    yield controller, server.address
    loop.stop()
    loop.finish()


def until(session: ServedSession, holds: Callable[[m.Snapshot], bool]) -> m.Snapshot:
    """Steps the session until a snapshot is as it should be."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        session.step()
        snapshot = session.snapshot()
        if holds(snapshot):
            return snapshot
        time.sleep(session.period)
    raise AssertionError("it did not come to that")


def ball(name: str, position: tuple[float, float, float]) -> SceneObstacle:
    return SceneObstacle(name, Obstacle(Sphere(0.05), position, name=name), Path())


def test_the_page_leads_the_arm_of_another_program(served: tuple[ss.Controller, str]) -> None:
    _, address = served
    session = ServedSession(scenario_of(RobotConfig(name="fr3")), address, None)
    try:
        first = session.snapshot()
        goal = first.q + 0.1
        session.handle(m.SetJointGoal(goal))
        arrived = until(session, lambda s: s.activity == "arrived")
        np.testing.assert_allclose(arrived.q, goal, atol=0.01)  # ArrivalSettings.joint
        assert "new goal" in [words for _, words in arrived.events]
        session.handle(m.SetRunning(False))
        until(session, lambda s: s.activity == "waiting")
        session.handle(m.SetRunning(True))
        until(session, lambda s: s.activity == "arrived")
        assert until(session, lambda s: bool(s.words)).words

        free = session.snapshot().nearest[1]
        beside = session.robot.pose(arrived.q, session.snapshot().tip)[:3, 3] + [0.0, 0.14, 0.0]
        session.handle(m.AddObstacle(ball("ball", tuple(beside))))
        near = until(session, lambda s: s.nearest[1] < 0.1)  # the other program knows of it
        assert near.nearest[1] < free
        before = session.snapshot().edition
        target = session.snapshot().poses[0].copy()
        target[1, 3] += 0.3
        session.handle(m.DragObstacle("ball", target))
        until(session, lambda s: bool(s.poses[0, 1, 3] > beside[1] + 0.25))
        until(session, lambda s: s.nearest[1] > 0.1)
        session.handle(m.RemoveObstacle("ball"))
        assert session.snapshot().edition == before + 1
        assert session.snapshot().things == ()
    finally:
        session.stop()


def test_what_is_not_for_an_attached_page_is_refused(served: tuple[ss.Controller, str]) -> None:
    session = ServedSession(scenario_of(RobotConfig(name="fr3")), served[1], None)
    try:
        with pytest.raises(ValueError, match="SetMethod is not for this page"):
            session.handle(m.SetMethod("controller"))
        with pytest.raises(ValueError, match="no obstacle 'ball'"):
            session.handle(m.RemoveObstacle("ball"))
        with pytest.raises(ValueError, match="goal"):
            session.handle(m.SetJointGoal(np.full(7, 9.0)))
    finally:
        session.stop()


def test_another_arm_is_named(served: tuple[ss.Controller, str]) -> None:
    with pytest.raises(ValueError, match="has the joints fr3_joint1"):
        ServedSession(scenario_of(RobotConfig(name="ur10")), served[1], None)
    with pytest.raises(ConnectionError, match="nobody serves"):
        ServedSession(scenario_of(RobotConfig(name="fr3")), "unix:/nowhere/arm", None)


class Spy:
    """A client that notes what obstacles it tells of."""

    def __init__(self, client: Any) -> None:
        self._client = client
        self.told: list[tuple[ss.Obstacles, float]] = []
        self.removed: list[str] = []
        self.deaf = False

    def __getattr__(self, name: str) -> Any:
        return getattr(self._client, name)

    def set_obstacles(self, obstacles: ss.Obstacles, *, source: str, valid_for: float) -> None:
        self.told.append((obstacles, valid_for))
        self._client.set_obstacles(obstacles, source=source, valid_for=valid_for)

    def remove_obstacles(self, source: str) -> None:
        self.removed.append(source)
        self._client.remove_obstacles(source)

    def explain(self) -> str:
        if self.deaf:
            raise ConnectionError("the server has not answered within 2 s")
        return str(self._client.explain())


@pytest.fixture
def spied(served: tuple[ss.Controller, str]) -> Iterator[tuple[ServedSession, Spy]]:
    session = ServedSession(scenario_of(RobotConfig(name="fr3")), served[1], None)
    spy = Spy(session._client)
    session._client = spy
    yield session, spy
    session.stop()


def test_recording_and_replay_leave_the_arm_to_others(spied: tuple[ServedSession, Spy]) -> None:
    session, spy = spied
    control = SimpleNamespace(on_click=lambda _: None, on_update=lambda _: None, content="", value=0.0)
    names = "add_button_group", "add_slider", "add_button", "add_markdown", "add_html"
    gui = SimpleNamespace(**dict.fromkeys(names, lambda *_, **__: control))
    sent: list[m.Command] = []
    view = SimpleNamespace(send=sent.append, last=None, telling=lambda _: contextlib.nullcontext())
    recorder = Recorder(SimpleNamespace(gui=gui), view)  # type: ignore[arg-type]

    def press(press: Callable[[Any], None], name: str) -> None:
        press(SimpleNamespace(target=SimpleNamespace(value=name), client=None))
        for command in sent:
            session.handle(command)
        sent.clear()
        for _ in range(3):
            session.step()
            view.last = session.snapshot()
            recorder.take(list(view.last.rows))

    press(recorder._on_record, "Record")  # before anything was shown
    activity = until(session, lambda s: True).activity
    for button, name in (
        (recorder._on_record, "Record"),
        (recorder._on_record, "Stop"),
        (recorder._on_replay, "Play"),
        (recorder._on_replay, "Live"),
    ):
        press(button, name)
        assert not spy.in_command, name
        assert session.snapshot().activity == activity, name
        assert recorder.replaying == (name == "Play")
    assert len(recorder.rows) >= 2
    assert view.last.attached


def test_an_obstacle_that_is_let_go_stands_for_the_server_too(spied: tuple[ServedSession, Spy]) -> None:
    session, spy = spied
    session.handle(m.AddObstacle(ball("ball", (1.0, 1.0, 1.0))))
    assert spy.told[-1][1] == math.inf
    target = session.snapshot().poses[0].copy()
    target[0, 3] += 0.5
    session.handle(m.DragObstacle("ball", target))
    for _ in range(5):
        session.step()
    obstacles, valid_for = spy.told[-1]
    assert np.linalg.norm(obstacles.velocities[0]) > 0.05
    assert valid_for == 1.0  # not for ever: the page may die
    session.handle(m.DragObstacle("ball", None))
    obstacles, valid_for = spy.told[-1]
    assert not obstacles.velocities.any()
    assert valid_for == math.inf
    session.handle(m.ThrowObstacle("ball", np.array([0.2, 0.0, 0.0])))
    assert spy.told[-1][1] == 1.0
    session.handle(m.ThrowObstacle("ball", np.zeros(3)))
    assert not spy.told[-1][0].velocities.any()
    assert spy.told[-1][1] == math.inf


def test_the_obstacles_of_a_page_go_with_it(served: tuple[ss.Controller, str]) -> None:
    _, address = served
    session = ServedSession(scenario_of(RobotConfig(name="fr3")), address, None)
    free = until(session, lambda s: bool(s.activity)).nearest[1]
    beside = session.robot.pose(session.snapshot().q, session.snapshot().tip)[:3, 3] + [0.0, 0.14, 0.0]
    session.handle(m.AddObstacle(ball("ball", tuple(beside))))
    until(session, lambda s: s.nearest[1] < free - 0.01)
    session.stop()
    after = ServedSession(scenario_of(RobotConfig(name="fr3")), address, None)
    try:
        until(after, lambda s: s.nearest[1] == pytest.approx(free, abs=1e-6))
    finally:
        after.stop()


def test_a_page_that_was_stopped_by_a_failure_goes_on(spied: tuple[ServedSession, Spy]) -> None:
    session, spy = spied
    for command in (m.SetRunning(True), m.Restart()):
        session.running = False  # as after a step that failed
        session.handle(command)
        assert session.snapshot().running
    spy.deaf = True
    until(session, lambda s: s.words == "the server has not answered within 2 s")
    spy.deaf = False
    session.handle(m.SetRunning(False))
    until(session, lambda s: s.words.startswith("paused"))
    assert session.snapshot().activity == "waiting"


def test_a_session_that_does_not_begin_closes_its_connection(
    served: tuple[ss.Controller, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    closed: list[bool] = []

    class Noted(Spy):
        def close(self) -> None:
            closed.append(True)
            self._client.close()

    monkeypatch.setattr(served_session, "connect", lambda *given, **named: Noted(ss.connect(*given, **named)))
    with pytest.raises(ValueError, match="has the joints"):
        ServedSession(scenario_of(RobotConfig(name="ur10")), served[1], None)
    assert closed == [True]
