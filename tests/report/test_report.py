"""The report folder of a run."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from sidestep.report import write_report
from sidestep.report.figures import psi_figure
from sidestep.scenario import Scenario, ScenarioResult, run_scenario

TEXT = """\
format: 1
name: small
description: An <arm> & a ball.
robot: {name: planar2}
start: {unit: deg, position: [0, 30]}
goal: {unit: deg, position: [20, 30]}
body: {components: 1}
obstacles:
  - {name: ball, shape: {type: sphere, radius: 0.05}, position: [0.2, 0.9, 0.0], free: true}
system: {switch: {type: distance, thresholds: [0.1, 0.1], slope: 50}}
simulation: {mode: torque, period: 0.005, duration: 1.0}
"""


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> ScenarioResult:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path_factory.mktemp("bodies")))
        return run_scenario(Scenario.from_text(TEXT))


@pytest.fixture(scope="module")
def folder(result: ScenarioResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("report") / "new" / "folder"
    files = write_report(result, target)
    assert files[0] == target / "index.html"
    assert sorted(files) == sorted(target.iterdir())
    return target


def test_every_figure_is_there(folder: Path) -> None:
    names = {path.stem for path in folder.glob("*.png")}
    assert names == {"position", "velocity", "acceleration", "torque", "switch", "psi", "clearance", "arm"}
    for path in folder.glob("*.png"):
        pixels = np.asarray(Image.open(path).convert("L"))
        assert pixels.std() > 3.0, f"{path.name} is blank"  # of 255; an empty sheet has 0


def test_the_animation_moves_and_is_small(folder: Path) -> None:
    path = folder / "animation.gif"
    assert path.stat().st_size < 3_000_000
    with Image.open(path) as animation:
        assert animation.n_frames >= 10
        first = np.asarray(animation.convert("L"), dtype=float)
        animation.seek(animation.n_frames - 1)
        last = np.asarray(animation.convert("L"), dtype=float)
    assert np.abs(first - last).max() > 50.0  # of 255: the arm has moved


def test_the_table_holds_the_run_with_units(folder: Path, result: ScenarioResult) -> None:
    with (folder / "log.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(result.run)
    assert "torque joint1 [N m]" in rows[0]
    assert "clearance [m]" in rows[0]
    for key, values in {
        "time [s]": result.run.time,
        "position joint2 [rad]": result.run.q[:, 1],
        "velocity joint1 [rad/s]": result.run.v[:, 0],
        "ball y [m]": result.run.object_poses[:, 0, 1],
    }.items():
        # nine digits are written
        np.testing.assert_allclose([float(row[key]) for row in rows], values, rtol=1e-8, atol=1e-12)


def test_the_arrays_hold_the_run_exactly(folder: Path, result: ScenarioResult) -> None:
    with np.load(folder / "log.npz", allow_pickle=False) as log:
        np.testing.assert_array_equal(log["q"], result.run.q)
        np.testing.assert_array_equal(log["wanted_acceleration"], result.run.wanted)
        np.testing.assert_array_equal(log["torque"], result.run.torque)  # type: ignore[attr-defined]
        assert log["coordinate_names"].tolist() == ["joint1", "joint2"]
        assert log["object_names"].tolist() == ["ball"]


def test_the_scenario_can_be_run_again_and_the_figures_are_there(
    folder: Path, result: ScenarioResult
) -> None:
    assert Scenario.load(folder / "scenario.yaml") == result.scenario
    assert json.loads((folder / "result.json").read_text()) == result.to_document()


def test_the_page_needs_nothing_else(folder: Path, result: ScenarioResult) -> None:
    page = (folder / "index.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") == 8
    assert page.count("data:image/gif;base64,") == 1
    assert "An &lt;arm&gt; &amp; a ball." in page
    assert result.sentence() in page
    assert "http" not in page.replace("http-equiv", "")


def test_of_many_coordinates_the_largest_are_drawn(result: ScenarioResult) -> None:
    rows, many = len(result.run.time), 40
    values = np.zeros((rows, many))
    values[:, 5::4] = np.linspace(0.0, 1.0, rows)[:, None] * np.arange(1.0, 10.0)  # nine of them
    values[0, 7] = np.nan
    barriers = replace(
        result, run=replace(result.run, values=values), scenario=replace(result.scenario, method="barrier")
    )
    figure = psi_figure(barriers)
    (axes,) = figure.axes
    assert [text.get_text() for text in axes.get_legend().get_texts()] == [
        f"ψ{k + 1}" for k in range(9, 40, 4)
    ]
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), values[:, 9])
    assert axes.get_title() == "Embedding, the largest 8 of 40 coordinates"
    assert "barriers" in axes.get_ylabel()
    (plain,) = psi_figure(result).axes
    assert (plain.get_title(), len(plain.lines)) == ("Embedding", result.run.values.shape[1])
    assert "1/m³" in plain.get_ylabel()
