"""The page that plays a recording, without a browser: arm, obstacles and words of each moment."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import sidestep as ss
from sidestep.cli import app, studio_command
from sidestep.studio.recording_view import RecordingView

Q = np.array([0.0, -0.4, 0.0, -2.2, 0.0, 1.9, 0.785])


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recordings") / "run.mcap"
    controller = ss.Controller(ss.Arm.load("fr3"), ss.ControllerSettings(synchronous=True, period=0.01))
    with controller.record(path):
        controller.set_obstacles(
            ss.Obstacles([[0.6, 0.3, 0.5]], radii=0.05, velocities=[[0.0, 0.1, 0.0]]), valid_for=10.0
        )
        controller.set_goal(Q + 0.3)
        q, v = Q, np.zeros(7)
        for k in range(200):
            command = controller.step(q, v, time=3.0 + 0.01 * k)
            q, v = command.position, command.velocity
    return path


def test_the_page_shows_arm_obstacles_and_why_at_each_moment(path: Path) -> None:
    run = ss.load_recording(path, scenes=True)
    with RecordingView(run, port=0) as page:
        assert page.address.startswith(f"http://127.0.0.1:{page.port}/")
        for step in (0, 100, 199):
            page.show(0.01 * step)
            assert page.step == step
            assert np.array_equal(page._arm.q, run.q[step])
            place = page._obstacles.batched_positions[0]
            moment = 0.02 * (step // 2)
            np.testing.assert_allclose(place, [0.6, 0.3 + 0.1 * moment, 0.5], atol=1e-6)
            assert f"step {step}" in page._words.content
        assert "a joint goal" in page._words.content
        page._slider.value = 1.0
        assert page.step == 100
        page._playing.value = True
        for _ in range(50):
            if page.step != 100:
                break
            page._stopping.wait(0.1)
        assert page.step > 100


def test_a_recording_without_steps_is_refused(tmp_path: Path) -> None:
    controller = ss.Controller(ss.Arm.load("planar2"), ss.ControllerSettings(synchronous=True))
    with controller.record(tmp_path / "empty.mcap"):
        pass
    with pytest.raises(ValueError, match=r"empty\.mcap: no step was recorded"):
        RecordingView(ss.load_recording(tmp_path / "empty.mcap"), port=0)


def test_the_command_plays_a_recording_and_draws_none_without_a_browser(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    played = []

    def wait(page: RecordingView) -> None:
        played.append((len(page.run), page.run.has_scenes))

    monkeypatch.setattr(RecordingView, "wait", wait)
    done = CliRunner().invoke(app, ["studio", str(path), "--no-browser", "--port", "0"])
    assert done.exit_code == 0, done.output
    assert "Recording: http://127.0.0.1:" in done.output
    assert played == [(200, True)]
    with pytest.raises(ValueError, match="--headless takes no recording"):
        CliRunner().invoke(app, ["studio", str(path), "--headless"], catch_exceptions=False)


def test_a_moment_between_two_steps_shows_the_one_before(path: Path) -> None:
    with RecordingView(ss.load_recording(path, scenes=True), port=0) as page:
        for seconds, step in ((0.0, 0), (0.015, 1), (0.019, 1), (0.02, 2), (99.0, 199)):
            page.show(seconds)
            assert page.step == step, seconds


def test_a_frame_is_drawn_once(path: Path) -> None:
    with RecordingView(ss.load_recording(path, scenes=True), port=0) as page:
        drawn: list[float] = []
        show = page.show

        def counted(seconds: float) -> None:
            drawn.append(seconds)
            show(seconds)

        page.show = counted  # type: ignore[method-assign]
        page._playing.value = True
        for _ in range(100):
            if len(drawn) >= 6:
                break
            page._stopping.wait(0.1)
        page._playing.value = False
        assert len(drawn) >= 6
        assert len(set(drawn)) == len(drawn)


def test_a_page_that_cannot_be_drawn_leaves_its_port(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stopped: list[int] = []

    def fail(page: RecordingView, run: object) -> None:
        server, stop = page.server, page.server.stop
        server.stop = lambda: (stopped.append(page.port), stop())  # type: ignore[method-assign,func-returns-value]
        raise ValueError("no such mesh")

    monkeypatch.setattr(RecordingView, "_draw_arm", fail)
    with pytest.raises(ValueError, match="no such mesh"):
        RecordingView(ss.load_recording(path, scenes=True), port=0)
    assert len(stopped) == 1


def test_what_a_recording_and_an_attached_page_do_not_take_is_named(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("play_recording", "open_studio"):
        monkeypatch.setattr(studio_command, name, lambda *_, **__: None)

    def invoke(*arguments: str) -> None:
        CliRunner().invoke(app, ["studio", *arguments, "--no-browser"], catch_exceptions=False)

    with pytest.raises(ValueError, match="it takes no --robot, --attach, --host"):
        invoke(str(path), "--robot", "fr3", "--attach", "arm", "--host", "0.0.0.0")
    with pytest.raises(ValueError, match=r"the program that serves it: it takes no --method, --ellipsoids"):
        invoke("--attach", "arm", "--method", "controller", "--ellipsoids", "3")
    with pytest.raises(ValueError, match="--token goes with --attach"):
        invoke("--token", str(path))


def test_the_token_of_a_file_goes_to_the_served_arm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[dict[str, object]] = []
    monkeypatch.setattr(studio_command, "open_studio", lambda scenario, **options: opened.append(options))
    (tmp_path / "arm.token").write_text("secret\n")
    arguments = ["studio", "--attach", "arm", "--robot", "planar2", "--token", str(tmp_path / "arm.token")]
    CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert (opened[0]["attach"], opened[0]["token"]) == ("arm", "secret")
