"""`sidestep studio` and `sidestep demo` up to where the studio opens."""

from __future__ import annotations

import dataclasses
import socket
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from sidestep import Scenario, cli
from sidestep.cli import run_command, studio_command
from sidestep.studio import headless, server


def invoke(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["sidestep", *arguments])
    with pytest.raises(SystemExit) as caught:
        cli.main()
    return int(caught.value.code or 0)


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Scenario, dict[str, Any]]]:
    """What a studio is opened with, instead of opening it."""
    calls: list[tuple[Scenario, dict[str, Any]]] = []
    monkeypatch.setattr(
        studio_command, "open_studio", lambda scenario, **options: calls.append((scenario, options))
    )
    return calls


@pytest.mark.parametrize(
    ("stdin", "stdout", "ci", "opens"),
    [(True, True, "", True), (False, True, "", False), (True, False, "", False), (True, True, "1", False)],
)
def test_the_demo_opens_the_studio_at_a_terminal(
    monkeypatch: pytest.MonkeyPatch, stdin: bool, stdout: bool, ci: str, opens: bool
) -> None:
    monkeypatch.setenv("CI", ci)
    with monkeypatch.context() as patch:
        patch.setattr(sys, "stdin", SimpleNamespace(isatty=lambda: stdin))
        patch.setattr(sys, "stdout", SimpleNamespace(isatty=lambda: stdout))
        answer = run_command._can_open_studio()
    assert answer == opens


def test_the_demo_is_the_cluster_of_balls_with_barriers(
    monkeypatch: pytest.MonkeyPatch, opened: list[tuple[Scenario, dict[str, Any]]]
) -> None:
    monkeypatch.setattr(run_command, "_can_open_studio", lambda: True)
    assert invoke(monkeypatch, "demo") == 0
    ((scenario, options),) = opened
    assert scenario == dataclasses.replace(Scenario.load("thesis-6.2.3"), method="controller")
    assert options == {"method": "controller"}


def test_it_listens_to_this_machine_alone_unless_told_otherwise(
    monkeypatch: pytest.MonkeyPatch, opened: list[tuple[Scenario, dict[str, Any]]]
) -> None:
    assert server.HOST == "127.0.0.1"
    assert invoke(monkeypatch, "studio", "--robot", "planar2", "--no-browser") == 0
    assert invoke(monkeypatch, "studio", "--robot", "planar2", "--host", "0.0.0.0", "--port", "0") == 0
    assert [options["host"] for _, options in opened] == ["127.0.0.1", "0.0.0.0"]
    assert [options["browser"] for _, options in opened] == [False, True]
    assert all(options["method"] == "controller" for _, options in opened)


def test_a_scenario_opens_with_the_method_it_is_written_for(
    monkeypatch: pytest.MonkeyPatch, opened: list[tuple[Scenario, dict[str, Any]]], tmp_path: Path
) -> None:
    shipped = Scenario.load("planar-one-obstacle")
    dataclasses.replace(shipped, method="controller").save(tmp_path / "mine.yaml")
    for arguments in ((str(tmp_path / "mine.yaml"),), (shipped.name,), (shipped.name, "--method", "thesis")):
        assert invoke(monkeypatch, "studio", *arguments) == 0
    assert [options["method"] for _, options in opened] == ["controller", "custom", "thesis"]


def test_a_taken_port_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        assert invoke(monkeypatch, "studio", "--robot", "planar2", "--port", str(port), "--no-browser") == 2
    error = capsys.readouterr().err
    assert f"port {port} is taken, perhaps by another studio; choose another with --port" in error
    assert len(error.strip().splitlines()) == 1


def test_pictures_are_taken_of_the_scenario_that_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    taken: list[tuple[Scenario, dict[str, Any]]] = []
    monkeypatch.setattr(
        headless, "take_pictures", lambda scenario, **options: taken.append((scenario, options))
    )
    picture = tmp_path / "end.png"
    arguments = ("--headless", "--screenshot", str(picture), "--size", "1920x1080", "--duration", "3")
    assert invoke(monkeypatch, "studio", "planar-several", "--method", "thesis", *arguments) == 0
    ((scenario, options),) = taken
    assert scenario.name == "planar-several"
    assert options["method"] == "thesis"
    assert (options["screenshot"], options["video"], options["duration"]) == (picture, None, 3.0)
    assert options["window"] == headless.Window(1920, 1080)
