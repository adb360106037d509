"""The loop in its own process, and what the studio says when it cannot start."""

from __future__ import annotations

import socket
import time as clock
from collections.abc import Callable
from dataclasses import replace
from multiprocessing import Pipe
from pathlib import Path

import numpy as np
import pytest

from sidestep import Scenario
from sidestep.studio import messages as m
from sidestep.studio.headless import Window, check_files, save_animation
from sidestep.studio.loop import Beginning, Loop, serve
from sidestep.studio.studio import check_port

PATIENCE = 120.0  # [s] at most for anything


def until(condition: Callable[[], bool], what: str) -> None:
    end = clock.monotonic() + PATIENCE
    while not condition():
        assert clock.monotonic() < end, what
        clock.sleep(0.01)


def wait_for(loop: Loop, condition: Callable[[m.Snapshot], bool]) -> m.Snapshot:
    end = clock.monotonic() + PATIENCE
    while clock.monotonic() < end:
        snapshot = loop.wait(0.2)
        if snapshot is not None and condition(snapshot):
            return snapshot
    raise AssertionError("no such snapshot")


def test_a_loop_runs_answers_and_ends(scenario: Scenario) -> None:
    loop = Loop(Beginning(scenario, "unswitched", {}, 2))
    try:
        first = wait_for(loop, lambda _: True)
        later = wait_for(loop, lambda snapshot: snapshot.time > first.time + 0.2)
        assert later.timing.median > 0.0
        loop.send(m.RemoveThing("nobody"))
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
