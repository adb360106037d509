"""The loop in its own process, what reaches it, and what the studio says when it cannot start or go on."""

from __future__ import annotations

import socket
import time as clock
from collections.abc import Callable
from dataclasses import replace
from multiprocessing import Pipe
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest

from sidestep import Scenario
from sidestep.math.pose import pose_at
from sidestep.studio import messages as m
from sidestep.studio import session_process
from sidestep.studio.command_queue import CommandQueue, add
from sidestep.studio.headless import Window, check_files, save_animation
from sidestep.studio.server import address_of, check_port
from sidestep.studio.session import Session
from sidestep.studio.session_process import FRAME, IDLE_FRAME, Beginning, SessionProcess, _Pacer, serve

PATIENCE = 120.0  # [s] at most for anything


def until(condition: Callable[[], bool], what: str) -> None:
    end = clock.monotonic() + PATIENCE
    while not condition():
        assert clock.monotonic() < end, what
        clock.sleep(0.01)


def wait_for(loop: SessionProcess, condition: Callable[[m.Snapshot], bool]) -> m.Snapshot:
    end = clock.monotonic() + PATIENCE
    while clock.monotonic() < end:
        snapshot = loop.wait(0.2)
        if snapshot is not None and condition(snapshot):
            return snapshot
    raise AssertionError("no such snapshot")


@pytest.mark.slow
def test_a_loop_runs_answers_and_ends(scenario: Scenario, capfd: pytest.CaptureFixture[str]) -> None:
    loop = SessionProcess(Beginning(scenario, "unswitched", {}, 2))
    try:
        first = wait_for(loop, lambda _: True)
        later = wait_for(loop, lambda snapshot: snapshot.time > first.time + 0.2)
        assert later.timing.median > 0.0
        loop.send(m.RemoveObstacle("nobody"))
        refusals: list[m.Failed] = []

        def refused() -> bool:
            refusals.extend(note for note in loop.take_notes() if isinstance(note, m.Failed))
            return bool(refusals)

        until(refused, "an answer")
        (refusal,) = refusals
        assert refusal.message == "there is no obstacle 'nobody'; there are: ball"
        assert not refusal.fatal
        loop.send(m.SetRunning(True, until=later.time + 1.0))
        paused = wait_for(loop, lambda snapshot: not snapshot.running)
        assert paused.time == pytest.approx(later.time + 1.0, abs=1e-3)  # one period
        loop.send(m.SetRecording(True))
        loop.send(m.SetRunning(True, until=paused.time + 0.5))
        wait_for(loop, lambda snapshot: not snapshot.running and snapshot.time > paused.time + 0.4)
        rows = loop.take_rows()
        np.testing.assert_allclose(np.diff([row.time for row in rows]), 0.005, atol=1e-9)  # none is lost
        assert len(rows) == 100
    finally:
        loop.stop()
    until(lambda: loop.ended, "the end")
    assert capfd.readouterr().err == ""  # its end leaves nothing on the terminal


def test_a_loop_that_cannot_start_says_why(scenario: Scenario) -> None:
    """What its process does, without the process: starting one takes seconds."""
    here, there = Pipe()
    here.send(Beginning(replace(scenario, robot=replace(scenario.robot, name="nobody")), "unswitched", {}, 2))
    serve(there)
    assert isinstance(here.recv(), m.Preparing)
    failure = here.recv()
    assert isinstance(failure, m.Failed)
    assert failure.fatal
    assert failure.message.startswith("no robot is named 'nobody'")


def drag(name: str, x: float) -> m.DragObstacle:
    return m.DragObstacle(name, pose_at([x, 0.0, 0.0]))


def test_of_a_stream_of_places_the_latest_is_kept_and_nothing_else_is_lost() -> None:
    waiting: list[m.Command] = []
    throw, pose = m.ThrowObstacle("ball", np.ones(3)), m.SetPoseGoal(np.eye(4), thorough=False)
    final = m.SetPoseGoal(np.eye(4))
    sent: tuple[m.Command, ...] = (
        drag("ball", 0.0),
        pose,
        drag("box", 1.0),
        m.Seen(),
        drag("ball", 2.0),
        final,
    )
    for command in (*sent, throw, drag("ball", 3.0), drag("ball", 4.0), m.DragObstacle("ball", None)):
        add(waiting, command)
    assert [type(command) for command in waiting] == [
        m.DragObstacle,
        m.Seen,
        m.DragObstacle,
        m.SetPoseGoal,
        m.ThrowObstacle,
        m.DragObstacle,
        m.DragObstacle,
    ]
    places = [
        (command.name, None if command.pose is None else command.pose[0, 3])
        for command in waiting
        if isinstance(command, m.DragObstacle)
    ]
    assert places == [("box", 1.0), ("ball", 2.0), ("ball", 4.0), ("ball", None)]
    assert waiting[3] is final


def test_the_page_does_not_wait_for_a_loop_that_is_busy() -> None:
    """While a body is made nobody reads; a hand goes on for minutes."""
    here, there = Pipe()
    outbox = CommandQueue(here)
    drags = 20_000  # some hundred fill the connection
    for k in range(drags):
        outbox.put(drag("ball", float(k)))
    outbox.put(m.Restart())
    received: list[m.Command] = []
    while not received or not isinstance(received[-1], m.Restart):
        assert there.poll(PATIENCE)
        received.append(there.recv())
    assert received[-2].pose[0, 3] == drags - 1  # type: ignore[union-attr]
    assert len(received) < 0.1 * drags
    outbox.stop()
    outbox.join(PATIENCE)
    outbox.put(m.Restart())
    assert not there.poll(0.0)


class Clock:
    """Goes on by a tenth of a millisecond whenever it is looked at."""

    def __init__(self) -> None:
        self.now = 0.0

    def perf_counter(self) -> float:
        self.now += 1e-4
        return self.now


class Hand:
    """A connection whose other end drags without a pause until a time [s], and takes every snapshot at once."""

    def __init__(self, clock: Clock, end: float) -> None:
        self.clock, self.end = clock, end
        self.sent: list[tuple[float, object]] = []
        self._unseen, self._next = 0, 0.0

    def poll(self, timeout: float = 0.0) -> bool:
        self.clock.now += min(timeout, max(0.0, self._next - self.clock.now))
        if self.clock.now >= self.end:
            raise EOFError
        return bool(self._unseen) or self.clock.now >= self._next

    def recv(self) -> m.Command:
        if self._unseen:
            self._unseen -= 1
            return m.Seen()
        self._next = self.clock.now + 2e-3  # a mouse
        return drag("ball", self.clock.now)

    def send(self, message: object) -> None:
        self.sent.append((self.clock.now, message))
        self._unseen += isinstance(message, m.Snapshot)


def paced(session: Session, monkeypatch: pytest.MonkeyPatch, duration: float) -> list[tuple[float, object]]:
    """What a loop sends in so many seconds of a clock of its own."""
    clock = Clock()
    hand = Hand(clock, duration)
    monkeypatch.setattr(session_process, "clock", clock)
    with pytest.raises(EOFError):
        _Pacer(session, hand).run()  # type: ignore[arg-type]
    return hand.sent


@pytest.mark.parametrize("running", [True, False])
def test_a_drag_is_not_shown_more_often_than_thirty_times_a_second(
    make_session: Callable[..., Session], scenario: Scenario, monkeypatch: pytest.MonkeyPatch, running: bool
) -> None:
    session = make_session(scenario, method="unswitched")
    session.running = running
    times = [time for time, message in paced(session, monkeypatch, 1.0) if isinstance(message, m.Snapshot)]
    between = np.diff(times)
    assert between.min() >= FRAME - 1e-9
    assert np.median(between) < 1.2 * FRAME < IDLE_FRAME  # and paused it is shown as often: the hand sees it


class LoadingPage(Hand):
    """A page that asks for a scenario at 0.2 s, and shows it when it has loaded its meshes; None: never."""

    def __init__(self, clock: Clock, scenario: Scenario, drawn: float | None) -> None:
        super().__init__(clock, 1.2)
        self._load, self._drawn, self._next = m.Load(scenario), drawn, 0.2

    def recv(self) -> m.Command:
        if self._unseen:
            self._unseen -= 1
            return m.Seen()
        edition = max(message.edition for _, message in self.sent if isinstance(message, m.Snapshot))
        asked = self._next == 0.2
        self._next = self._drawn if asked and self._drawn is not None else np.inf
        return self._load if asked else m.Drawn(edition)


@pytest.mark.parametrize(("drawn", "begins"), [(0.6, 0.6), (None, 0.7)])
def test_a_scenario_that_is_loaded_waits_for_the_page(
    make_session: Callable[..., Session],
    scenario: Scenario,
    monkeypatch: pytest.MonkeyPatch,
    drawn: float | None,
    begins: float,
) -> None:
    """But no longer than the limit, here half a second: there may be no page."""
    session = make_session(scenario, method="unswitched")
    clock = Clock()
    monkeypatch.setattr(session_process, "clock", clock)
    monkeypatch.setattr(session_process, "LONGEST_HOLD", 0.5)
    page = LoadingPage(clock, scenario, drawn)
    with pytest.raises(EOFError):
        _Pacer(session, page).run()  # type: ignore[arg-type]
    shown = [(at, message) for at, message in page.sent if isinstance(message, m.Snapshot)]
    of_second = [(at, message) for at, message in shown if message.edition > shown[0][1].edition]
    waiting = [message.time for at, message in of_second if at < begins]
    assert len(waiting) > 10
    assert waiting == [0.0] * len(waiting)
    going = [message.time for at, message in of_second if at > begins]
    assert going[-1] == pytest.approx(1.2 - begins, abs=3 * FRAME)
    assert np.diff(going).max() < 3 * FRAME  # and nothing is made up for


def test_a_loop_that_fails_holds_the_arm_and_says_why(
    make_session: Callable[..., Session], scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = make_session(scenario, method="unswitched")
    failing = session._adapter.step
    calls = 0

    def step(*arguments: object) -> object:
        nonlocal calls
        calls += 1
        if calls == 5:
            raise np.linalg.LinAlgError("singular")
        return failing(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(session._adapter, "step", step)
    sent = [message for _, message in paced(session, monkeypatch, 0.5)]
    (failure,) = [message for message in sent if isinstance(message, m.Failed)]
    assert failure.message == "the step at 0.004 s failed, the loop is paused: LinAlgError: singular"
    assert not failure.fatal
    after = [message for message in sent[sent.index(failure) :] if isinstance(message, m.Snapshot)]
    assert len(after) > 10  # it goes on answering
    assert {message.time for message in after} == {after[0].time}
    assert not any(message.running for message in after)
    for message in after:
        np.testing.assert_array_equal(message.q, after[0].q)
    session.handle(m.SetRunning(True))
    session.step()
    assert session.time == pytest.approx(0.005, abs=1e-9)


@pytest.mark.parametrize(
    "command",
    [
        m.DragObstacle("ball", np.full((4, 4), np.nan)),
        m.ThrowObstacle("ball", np.array([np.inf, 0.0, 0.0])),
        m.SetPoseGoal(np.full((4, 4), np.nan)),
        m.SetJointGoal(np.array([np.nan, 0.0])),
    ],
    ids=lambda command: type(command).__name__,
)
def test_what_is_not_finite_is_refused(
    make_session: Callable[..., Session], scenario: Scenario, command: m.Command
) -> None:
    session = make_session(scenario, method="unswitched")
    before = session.snapshot()
    with pytest.raises(ValueError, match=r"nan|inf"):
        session.handle(command)
    session.step()
    now = session.snapshot()
    np.testing.assert_array_equal(now.poses, before.poses)
    np.testing.assert_array_equal(now.goal, before.goal)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("host", "address"),
    [
        ("127.0.0.1", "http://127.0.0.1:80"),
        ("0.0.0.0", "http://127.0.0.1:80"),
        ("192.168.1.2", "http://192.168.1.2:80"),
        ("robot.local", "http://robot.local:80"),
        ("::1", "http://[::1]:80"),
        ("::", "http://[::1]:80"),
        ("fe80::2", "http://[fe80::2]:80"),
    ],
)
def test_the_address_of_every_host_can_be_opened(host: str, address: str) -> None:
    assert address_of(host, 80) == address
    assert urlsplit(address).port == 80


def test_a_port_that_is_taken_is_named() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(
            OSError, match=f"port {port} is taken, perhaps by another studio; choose another with --port"
        ):
            check_port("127.0.0.1", port)
    check_port("127.0.0.1", 0)


def test_pictures_need_a_place_and_a_known_format() -> None:
    with pytest.raises(ValueError, match="--headless needs --screenshot FILE or --video FILE"):
        check_files(None, None)
    with pytest.raises(ValueError, match=r"--video is way\.avi; allowed: \.gif, \.webp, \.mp4, \.webm"):
        check_files(None, Path("way.avi"))
    with pytest.raises(ValueError, match=r"--screenshot is nowhere/end\.png; there is no folder nowhere"):
        check_files(Path("nowhere/end.png"), None)
    check_files(Path("end.png"), Path("way.mp4"))


@pytest.mark.parametrize("suffix", [".mp4", ".webm"])
def test_a_video_shows_the_pictures_a_quarter_of_a_second_each(tmp_path: Path, suffix: str) -> None:
    import av
    from PIL import Image

    colours = [(200, 30, 30), (30, 200, 30), (30, 30, 200)]
    file = tmp_path / f"way{suffix}"
    save_animation([Image.new("RGB", (321, 240), colour) for colour in colours], file)
    with av.open(str(file)) as container:
        frames = list(container.decode(video=0))
    assert [frame.time for frame in frames] == pytest.approx(
        [0.0, 0.25, 0.5], abs=1e-3
    )  # clocks of the formats
    assert (frames[0].width, frames[0].height) == (320, 240)
    for frame, colour in zip(frames, colours, strict=True):
        middle = frame.to_ndarray(format="rgb24")[120, 160]
        np.testing.assert_allclose(middle, colour, atol=12)  # of 255: limited range and lossy


def test_a_window_has_a_size() -> None:
    with pytest.raises(ValueError, match="--size is '10x10'; allowed: WIDTHxHEIGHT"):
        Window.from_text("10x10")
    assert Window.from_text("1920x1080") == Window(1920, 1080)
