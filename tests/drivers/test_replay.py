"""A robot that measures what a recording holds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sidestep as ss
from sidestep.loop import RunEnd

SYNCHRONOUS = {"synchronous": True, "output": "position"}


def controller_of(arm: ss.Arm, speed: float = 1.0) -> ss.Controller:
    controller = ss.Controller(arm, ss.ControllerSettings(**SYNCHRONOUS, speed=speed))
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(arm.neutral + 0.3)
    return controller


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[ss.Arm, Path]:
    arm, path = ss.Arm.load("planar3"), tmp_path_factory.mktemp("replay") / "run.mcap"
    report = ss.run(controller_of(arm), ss.drivers.Ideal(arm, real_time=False), record=path)
    assert report.end == RunEnd.arrived
    return arm, path


def test_another_controller_meets_the_recorded_states(recorded: tuple[ss.Arm, Path], tmp_path: Path) -> None:
    arm, path = recorded
    before = ss.load_recording(path)
    driver = ss.drivers.Replay(path)
    report = ss.run(controller_of(arm, speed=0.5), driver, until=None, record=tmp_path / "again.mcap")
    assert report.end == RunEnd.robot_stopped
    assert report.why == "the robot has stopped itself: the recording is over"
    assert driver.cycle == len(before.time)
    again = ss.load_recording(tmp_path / "again.mcap")
    np.testing.assert_array_equal(again.q, before.q)
    np.testing.assert_array_equal(again.v, before.v)
    assert np.abs(again.velocity).max() < np.abs(before.velocity).max()  # it would have moved more slowly


def test_what_is_no_recording_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        ss.drivers.Replay(tmp_path / "none.mcap")
    (tmp_path / "text.mcap").write_text("no recording", encoding="utf-8")
    with pytest.raises(ValueError, match=r"text\.mcap"):
        ss.drivers.Replay(tmp_path / "text.mcap")
