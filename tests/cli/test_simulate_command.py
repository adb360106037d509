"""`sidestep simulate`: what is left of a simulation that fails."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from sidestep.cli import app
from sidestep.scenario.simulated import obstacle_of
from sidestep.simulation.simulator import Simulator

pytest.importorskip("mujoco")


def test_record_and_report_are_written_where_the_physics_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def run(simulator: Simulator, goes_on: object) -> None:
        simulator.robot.start("torque")
        for _ in range(5):
            simulator.cycle()
        raise RuntimeError("the physics diverged")

    monkeypatch.setattr(Simulator, "run", run)
    arguments = ["simulate", "planar2", "--address", f"unix:{tmp_path / 'robot'}", "--quiet"]
    arguments += ["--motion", str(tmp_path / "motion.npz"), "--json", str(tmp_path / "report.json")]
    with pytest.raises(RuntimeError, match="the physics diverged"):
        CliRunner().invoke(app, arguments, catch_exceptions=False)
    report = json.loads((tmp_path / "report.json").read_text())
    assert (report["failure"], report["cycles"]) == ("the physics diverged", 5)
    with np.load(tmp_path / "motion.npz") as rows:
        assert len(rows["time"]) == 5


def test_cycles_that_the_file_lacks_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def run(simulator: Simulator, goes_on: object) -> None:
        simulator.robot.start("torque")
        for _ in range(5):
            simulator.cycle()

    monkeypatch.setattr(Simulator, "run", run)
    monkeypatch.setattr("sidestep.simulation.motion_record.MAX_CYCLES", 3)
    arguments = ["simulate", "planar2", "--address", f"unix:{tmp_path / 'robot'}"]
    arguments += ["--motion", str(tmp_path / "motion.npz"), "--json", str(tmp_path / "report.json")]
    done = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert json.loads((tmp_path / "report.json").read_text())["unrecorded_cycles"] == 2
    assert "cycles not in the motion's file" in done.output


@pytest.mark.parametrize(
    "text", ["sphere:0.05@0,0,0@junk", "sphere:0.05", "sphere:0.05@0,0", "plane:1@0,0,0"]
)
def test_an_object_that_is_malformed_is_named(text: str) -> None:
    with pytest.raises(ValueError, match=f"--object is {text!r}; allowed: KIND:LENGTH"):
        obstacle_of(text, "object0")
    assert obstacle_of("sphere:0.05@0.1,0.2,0.3", "ball").position == (0.1, 0.2, 0.3)
