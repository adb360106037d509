"""The report folder of a run."""

import csv
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from sidestep import Obstacles
from sidestep.report import write_report
from sidestep.report.figures import position_figure, psi_figure, switch_figure
from sidestep.report.tables import csv_columns
from sidestep.scenario import Scenario, ScenarioResult, run_scenario
from sidestep.scenario.summary import seen_in_words, summary_rows
from sidestep.simulation import SimulationRun

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


@pytest.mark.slow
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


def test_of_many_barriers_the_most_active_are_drawn_by_name(result: ScenarioResult) -> None:
    rows = len(result.run.time)
    ramp = np.linspace(0.0, 1.0, rows)
    links = (f"link{k // 2} - obstacles" for k in range(18))
    names = (*links, "joint1 - upper limit", "link0 - link8")
    values = np.zeros((rows, len(names)))
    values[:, :18] = ramp[:, None] * np.arange(18)  # two per link: the second one is the larger
    values[0, 17] = np.nan
    values[:, 18] = 100.0
    barriers = replace(
        result,
        run=replace(result.run, values=values),
        embedding_names=names,
        scenario=replace(result.scenario, method="barrier"),
    )
    figure = psi_figure(barriers)
    assert figure is not None
    (axes,) = figure.axes
    assert [text.get_text() for text in axes.get_legend().get_texts()] == [
        "joint1 - upper limit",
        *(f"link{k} - obstacles" for k in (8, 7, 6, 5, 4)),
    ]
    np.testing.assert_array_equal(axes.lines[2].get_ydata(), values[:, 15])
    assert (
        axes.get_title() == "What bent the motion: barriers by part, the 6 most active of 9"
    )  # link0 is too weak to be seen
    at_rest = replace(barriers, run=replace(result.run, values=np.zeros_like(values)))
    assert psi_figure(at_rest) is None  # none was ever active: there is nothing to see
    plain = psi_figure(result)
    assert plain is not None
    assert (plain.axes[0].get_title(), len(plain.axes[0].lines)) == ("Embedding", 1)
    assert plain.axes[0].get_ylabel() == "collision density ψ [1/m³]"


def test_a_method_without_a_switch_shows_no_switch(result: ScenarioResult) -> None:
    assert switch_figure(result) is not None
    assert "switch 1 [-]" in csv_columns(result)
    barriers = replace(result, scenario=replace(result.scenario, method="barrier"))
    assert switch_figure(barriers) is None
    assert not [name for name in csv_columns(barriers) if name.startswith("switch")]
    document = barriers.to_document()
    assert (document["method"], document["switch"]) == ("barrier", None)


def test_the_columns_of_the_embedding_have_names(result: ScenarioResult) -> None:
    assert result.embedding_names == ("collision density",)
    assert "psi 1 collision density [-]" in csv_columns(result)
    values = np.column_stack([result.run.time, 2.0 * result.run.time, -result.run.time])
    barriers = replace(
        result,
        run=replace(result.run, values=values),
        embedding_names=("link1 - obstacles", "link1 - obstacles", "link1 - link3"),
        scenario=replace(result.scenario, method="barrier"),
    )
    columns = csv_columns(barriers)
    np.testing.assert_array_equal(columns["barrier link1 - obstacles [-]"], values[:, 1])  # the larger of two
    np.testing.assert_array_equal(columns["barrier link1 - link3 [-]"], values[:, 2])
    assert not [name for name in columns if name.startswith("psi")]


def test_the_summary_says_what_is_seen_and_how_much_torque_was_used(result: ScenarioResult) -> None:
    rows = {name: (value, note) for name, value, note in summary_rows(result)}
    assert rows["method"][0] == "custom, switch: distance"
    assert rows["controller sees"][0] == "1 bare centre"
    run = result.run
    assert isinstance(run, SimulationRun)
    ratios = (np.abs(run.torque) / run.robot.limits.effort).max(axis=0)
    joint = run.robot.coordinate_names[int(ratios.argmax())]
    assert rows["largest torque"] == (f"{100 * ratios.max():.0f} % of its limit", f"of {joint}")


@pytest.mark.parametrize(
    ("radii", "solids", "words"),
    [
        ([], 0, "no obstacle"),
        ([0.0, 0.0], 2, "2 bare centres"),
        ([0.0] * 3, 1, "3 points, bare"),
        ([0.01, 0.01, 0.03], 1, "3 points with radii of 10 to 30 mm"),
        ([0.0, 0.03, 0.03], 3, "3 points, 1 of them bare, the others with a radius of 30 mm"),
    ],
)
def test_what_the_controller_sees_in_words(radii: list[float], solids: int, words: str) -> None:
    seen = Obstacles(np.zeros((len(radii), 3)), np.array(radii)) if radii else Obstacles.none()
    assert seen_in_words(seen, num_solids=solids) == words


SLIDING = """\
<robot name="cart"><link name="base"/>
<joint name="rail" type="prismatic"><parent link="base"/><child link="cart"/><axis xyz="1 0 0"/>
<limit lower="-0.02" upper="0.04" velocity="1" effort="100"/></joint>
<link name="cart"><inertial><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link></robot>
"""


def test_ways_of_sliding_joints_are_in_millimetres(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path / "bodies"))
    (tmp_path / "cart.urdf").write_text(SLIDING)
    (tmp_path / "cart.yaml").write_text(
        "format: 1\nname: cart\nrobot: {urdf: cart.urdf}\nbody: {components: 1}\n"
        "start: {unit: rad, position: [0.0]}\ngoal: {unit: rad, position: [0.03]}\n"
        "simulation: {mode: torque, period: 0.005, duration: 0.05, tolerance: 0.002}\n"
    )
    result = run_scenario(Scenario.load(tmp_path / "cart.yaml"))
    left = 0.03 - result.run.q[-1, 0]
    assert 0.02 < left < 0.03
    evaluation = result.evaluation
    assert evaluation.position_error_rad is None
    assert evaluation.position_error_m == pytest.approx(left, abs=1e-12)
    assert evaluation.way_left() == f"{1000 * left:.4g} mm"
    assert f"ends {1000 * left:.4g} mm from the goal" in result.sentence()
    assert result.stop is not None
    assert f"{1000 * left:.1f} mm from the goal" in result.stop
    rows = {name: (value, note) for name, value, note in summary_rows(result)}
    assert rows["goal reached"][1] == "error under 0.2 mm at the end"  # a tenth of the angle
    assert rows["tracking error"][0].endswith(" m/s²")
    assert rows["largest force"][0].endswith(" % of its limit")
    assert not [row for row in rows.values() if re.search(r"\brad\b", " ".join(row))]
    document = result.to_document()
    assert (document["tolerance_rad"], document["tolerance_m"]) == (None, pytest.approx(0.0002))
    (axes,) = position_figure(result).axes
    assert axes.get_ylabel() == "rail\n[mm]"
    assert axes.get_title(loc="right") == "limits [-20, 40]"
    np.testing.assert_allclose(axes.lines[0].get_ydata(), 1000.0 * result.run.q[:, 0])
