"""The reduced report, by value."""

import re

import numpy as np
import pytest

from sidestep.bench.peers import torch_autograd
from sidestep.thesis.reproduce import PARTS, Figure, Table, performance
from sidestep.thesis.reproduce import planar as toy

pytestmark = pytest.mark.slow

EXPECTED = {
    *(f"figure-{key}" for key in ("2.1", "3.1", "3.2", "3.3", "3.4", "3.5", "3.7")),
    *(f"figure-5.{n}" for n in (1, 3, 4, 5, 6, 7, 8, 9)),
    *(f"figure-6.{n}" for n in (1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14)),
    *("figure-A.1", "figure-B.1", "figure-B.2"),
    *(
        f"table-{key}"
        for key in ("5.3-height", "5.4-kernels", "6.1", "6.1-switches", "6.2-criteria", "errata")
    ),
}


def data(report, name):
    return report.items[name].data


def test_every_figure_and_table_is_there_with_its_files(report):
    assert set(report.items) == EXPECTED
    page = report.page.read_text(encoding="utf-8")
    for name, item in report.items.items():
        assert f"id='{name}'" in page
        assert all(text for _, text in item.caption.lines()), name
        written = {path.suffix for path in report.page.parent.glob(f"{name}.*")}
        assert {".png", ".svg"} <= written if isinstance(item, Figure) else written, name
        assert written & {".csv", ".npz"}, name
    assert not re.search(r"(?:src|href)='(?!data:|#)|url\(|@import|<script|<link|https?://", page)


def test_parts_say_which_items_they_yield(report):
    listed = {key for part in PARTS for key in part.items}
    assert {item.key for item in report.items.values()} | {"table-6.1"} == listed | {"6.1"}


def test_sphere_geodesic_is_a_great_circle(report):
    found = data(report, "figure-2.1")
    # Runge-Kutta of 400 steps over an arc of 1.1 rad.
    np.testing.assert_allclose(found["geodesic"], found["great_circle"], atol=1e-8)


def test_pure_geodesic_bends_away_and_does_not_reach_the_goal(report):
    found = data(report, "figure-5.3")
    for name in ("q_low_rad", "q_high_rad"):
        q = found[name]
        along = (toy.GOAL - toy.START) / np.linalg.norm(toy.GOAL - toy.START)
        offset = q - toy.START
        sideways = offset[:, 0] * along[1] - offset[:, 1] * along[0]
        assert np.abs(sideways).max() > 1.0  # [rad] off the straight line to the goal
        assert np.linalg.norm(q - toy.GOAL, axis=1).min() > 0.2  # [rad]
    assert toy.least_clearance(found["q_high_rad"]) > 0.05  # [m] the high hill is passed by
    assert toy.least_clearance(found["q_low_rad"]) < 0.0  # the low one is climbed


def test_more_geodesics_pass_a_higher_hill(report):
    shares = data(report, "table-5.3-height")["share"]
    assert shares[0] == 0.0
    assert shares[-1] >= 0.75


def test_unswitched_does_not_touch_and_stalls_switched_touches(report):
    found = data(report, "figure-5.4")
    assert toy.least_clearance(found["q_unswitched_rad"]) > 0.15  # [m]
    assert 0.5 < np.linalg.norm(found["q_unswitched_rad"][-1] - toy.GOAL) < 1.2
    assert np.diff(found["energy_unswitched"]).max() < 1e-9
    assert toy.least_clearance(found["q_switched_rad"]) < 0.0
    assert found["energy_switched"].max() > 4.0 * found["energy_switched"][0]


def test_larger_thresholds_make_the_switched_motion_faster(report):
    found = data(report, "figure-5.5")
    assert found["peak_speed_rad_s"][-1] > 5.0 * found["peak_speed_rad_s"][0]


def test_kernels_grow_exponentially(report):
    kernels = data(report, "table-5.4-kernels")["kernels"]
    assert list(kernels) == [17**d - 15**d for d in (1, 2, 3)]


def test_geodesic_leaves_the_joint_limits(report):
    assert np.abs(data(report, "figure-5.6")["q_geodesic_rad"]).max() > np.pi


def test_obstacle_velocity_matters(report):
    found = data(report, "figure-5.7")
    assert np.abs(found["q_rad"] - found["q_velocity_ignored_rad"]).max() > 0.01
    path = zip(found["q_rad"][::20], found["obstacle_m"][::20], strict=True)
    assert min(toy.clearance(q, x) for q, x in path) > 0.0


def test_several_obstacles_need_via_points(report):
    found = data(report, "figure-5.8")
    goal = np.array([1.2, 0.4])
    assert np.linalg.norm(found["q_rad"][-1] - goal) > 0.5


def test_switches_on_seven_joints(report):
    found = data(report, "table-6.1-switches")
    unswitched, binary, sigmoid, distance = range(4)
    assert found["clearance_m"][unswitched] > 0.03
    assert found["error_rad"][unswitched] > 0.3  # stalls
    for mode in (binary, sigmoid, distance):
        assert found["clearance_m"][mode] < 0.0
    weights = data(report, "figure-6.8")["weight"]
    assert np.all((weights > 0.0) & (weights < 1.0))


def test_criteria_of_the_simulated_scenarios(report):
    table = report.items["table-6.2-criteria"]
    assert isinstance(table, Table)
    rows = {row[0]: row for row in table.rows if row[1] == "distance"}
    for name in ("6.2.2", "6.2.3"):
        assert rows[name][2].startswith("yes")
        assert rows[name][4].startswith("yes")
        assert float(rows[name][5]) < 1e-6
    assert rows["6.2.4"][2].startswith(
        "no"
    )  # with correct derivatives the thesis's switch does not arrive here


def test_table_6_1_measures_every_way(report):
    table = report.items["table-6.1"]
    found = {method: table.data[f"{method} [Hz]"] for method in performance.METHODS}
    if not torch_autograd.available():
        assert "not installed" in table.rows[0][1]
        del found["torch.autograd"]
    for method, frequencies in found.items():
        assert np.all((frequencies > 0.0) & np.isfinite(frequencies)), method
    # How far apart the ways are is the table's to say: a test that compares times fails on a busy machine.
    ratios = dict(zip(performance.METHODS, (row[4] for row in table.rows), strict=True))
    assert ratios["analytic, dense"] == "1 / 1 / 1"
    native = [float(ratio.replace(",", "")) for ratio in ratios["core in C++"].split(" / ")]
    np.testing.assert_allclose(native, found["core in C++"] / found["analytic, dense"], rtol=0.01)


def test_projections_have_a_stated_spread(report):
    found = data(report, "figure-A.1")
    assert found["mean_psi_per_m3"].shape == (21, 12, 12)
    # Few samples a cell, yet every map has a spread to state; test_projections.py checks it by value.
    assert np.all(np.isfinite(found["standard_error"]))
    assert np.all(found["standard_error"].max(axis=(1, 2)) > 0.0)
    assert [tuple(pair) for pair in found["pairs"][:2]] == [(1, 2), (1, 3)]


def test_table_6_1_says_when_pytorch_is_missing():
    rates = {method: np.array([1e3, 5e2, 1e2]) for method in performance.METHODS}
    rates["torch.autograd"] = np.full(3, np.nan)
    counts = {method: np.zeros(3, dtype=int) for method in performance.METHODS}
    table = performance.table(rates, counts)
    assert table.rows[0][:2] == ("torch.autograd", "PyTorch is not installed")
    assert table.rows[0][5] == "133 / 57 / 4.5"  # the thesis's own figures need no PyTorch
    assert table.rows[1][4] == "1 / 1 / 1"
