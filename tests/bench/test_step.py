"""What a step costs: that the figures are of the steps asked for, not how large they are."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from sidestep import Obstacles, _core
from sidestep.bench import StepSettings, compare_steps, run_step_bench
from sidestep.bench import step as step_module
from sidestep.bench.methods import barrier_system
from sidestep.bench.step_scenes import REACH, table_cloud, uniform_cloud
from sidestep.body import Body
from sidestep.robot import Robot


@pytest.fixture(scope="module")
def document() -> dict[str, object]:
    settings = StepSettings(steps=20, robot="planar3", points=(5,))
    return run_step_bench(settings)


def test_measures_every_row(document: dict[str, list[dict[str, object]]]) -> None:
    rows = document["results"]
    assert len(rows) == 2 * len(step_module.TABLE_ROBOTS) + 2 * 4 + 1
    assert len({(row["name"], row["language"]) for row in rows}) == len(rows)
    for row in rows:
        assert row["steps"] >= 20
        assert 0.0 < row["median_us"] <= row["p99_us"] <= row["p99.9_us"] <= row["max_us"]
        if row["interruptions"] == 0:
            assert row["undisturbed_max_us"] == row["max_us"]
        elif row["undisturbed_max_us"] is not None:
            assert row["undisturbed_max_us"] <= row["max_us"]
    assert [row["joints"] for row in rows[:6:2]] == [2, 3, 7]
    assert {row["points"] for row in rows[6:-1]} == {5}
    assert [row["name"].split(", ", 3)[3] for row in rows[6:10]] == [
        "without filter",
        "controller",
        "controller, acceleration",
        "without filter",
    ]
    assert rows[-1]["name"] == "planar3, mass matrix and bias"
    json.dumps(document, allow_nan=False)


def test_motions_during_which_the_core_was_taken_away_are_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    row = next(step_module._rows(StepSettings(steps=30, points=(5,))))
    q, warm_up = row.robot.neutral, [1e-6] * 3
    durations = iter([warm_up, [2e-6] * 10, [9e-3] * 10, [3e-6] * 10])
    monkeypatch.setattr(step_module._Row, "_from_cpp", lambda *_: (q, np.array(next(durations))))
    counts = iter([0, 0, 0, 2, 2, 2, 2])
    monkeypatch.setattr(step_module, "interruptions", lambda: next(counts))
    times = row.measure(StepSettings(steps=30, points=(5,)))
    assert times["interruptions"] == 2
    assert times["undisturbed_max_us"] == pytest.approx(3.0)
    assert times["max_us"] == pytest.approx(9000.0)


def test_a_machine_that_holds_a_loop_up_is_told() -> None:
    readings = iter([0, 1_000, 500_000, 3_500_000, 4_600_000, 10_000_000])
    idle = step_module.held_up(0.01, lambda: next(readings))
    assert idle == {"seconds": pytest.approx(0.01), "longest_us": pytest.approx(5_400.0), "above_1ms": 3}


def test_the_machine_is_held_up_beside_the_rows(document: dict[str, dict[str, float]]) -> None:
    longest = max(row["steps"] / row["steps_per_s"] for row in document["results"])
    assert longest <= document["idle"]["seconds"] < longest + 1.0
    assert 0.0 < document["idle"]["longest_us"] <= 1e6 * document["idle"]["seconds"]
    assert (document["idle"]["above_1ms"] > 0) == (document["idle"]["longest_us"] > 1_000.0)


def test_the_dense_kernel_is_related_to_the_peak_of_the_same_run(
    document: dict[str, dict[str, float]],
) -> None:
    dense = document["dense"]
    assert dense["gaussians"] == Body.cover(Robot.named("planar3")).num_components
    assert dense["operations_per_s"] == pytest.approx(1e9 * dense["operations_per_pair"] / dense["pair_ns"])
    assert dense["share_of_peak"] == pytest.approx(dense["operations_per_s"] / dense["multiply_add_per_s"])
    assert dense["share_of_peak"] > 0.0


def test_the_peak_needs_a_duration() -> None:
    with pytest.raises(ValueError, match="duration is 0"):
        _core.multiply_add_rate(0.0)


def test_arms_are_drawn_to_where_they_have_clearance() -> None:
    robot = Robot.named("planar3")
    body = Body.cover(robot)
    system = barrier_system(robot, body)
    obstacles = Obstacles([[0.9, 0.2, 0.0], [0.5, -0.6, 0.0]], 0.1)
    rng = np.random.default_rng(0)
    for _ in range(20):
        q = step_module.clear_place(robot, system, obstacles, rng)
        assert step_module.clearance_at(q, system, obstacles) >= step_module.CLEARANCE
    crowd = Obstacles(np.random.default_rng(1).uniform(-1.5, 1.5, (2000, 3)) * [1.0, 1.0, 0.05])
    drawn = np.random.default_rng(2)
    clearances = [
        step_module.clearance_at(robot.random_configuration(drawn), system, crowd)
        for _ in range(step_module.TRIES)
    ]
    best = step_module.clear_place(robot, system, crowd, np.random.default_rng(2))
    assert step_module.clearance_at(best, system, crowd) == max(clearances) < step_module.CLEARANCE


def test_compares_row_by_row(document: dict[str, list[dict[str, object]]]) -> None:
    slower = {
        "benchmark": "step",
        "results": [{**row, "median_us": 2.0 * row["median_us"]} for row in document["results"][:3]],
    }
    rows = compare_steps(document, slower)
    assert [row["ratio"] for row in rows] == [2.0] * 3
    with pytest.raises(ValueError, match="share no row"):
        compare_steps(document, {"benchmark": "step", "results": []})
    with pytest.raises(ValueError, match="not a result of"):
        compare_steps(document, {"benchmark": "reach"})


@pytest.mark.parametrize(
    ("wrong", "message"),
    [({"steps": 0}, "steps is 0"), ({"seconds": 0.0}, "seconds is 0"), ({"points": ()}, r"points is \(\)")],
)
def test_names_wrong_settings(wrong: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        StepSettings(**wrong)


@pytest.mark.parametrize("cloud", [uniform_cloud, table_cloud])
def test_clouds_have_as_many_points_as_asked_for_within_the_workspace(cloud: object) -> None:
    points = cloud(1000, np.random.default_rng(0)).points
    assert points.shape == (1000, 3)
    assert np.linalg.norm(points, axis=1).max() < REACH[1] + 0.05
    assert len(np.unique(points, axis=0)) == 1000


def test_the_committed_result_is_one(tmp_path: Path) -> None:
    path = Path(__file__).parents[2] / "benchmarks" / "results" / "step.json"
    stored = json.loads(path.read_text("utf-8"))
    assert all(row["ratio"] == 1.0 for row in compare_steps(stored, stored))
