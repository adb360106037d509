"""The step against the number of points: where the points lie, and that every row is there."""

import numpy as np
import pytest
from PIL import Image

import sidestep as ss
from sidestep.bench import CloudSizeSettings, draw_cloud_sizes, run_cloud_size_bench
from sidestep.bench.cloud_size import points_around, points_beyond
from sidestep.system import ClearanceBarrier


@pytest.fixture(scope="module")
def robot():
    return ss.Robot.named("fr3")


@pytest.fixture(scope="module")
def body(robot):
    return ss.Body.cover(robot)


def test_points_within_reach_are_where_barriers_act(robot, body):
    q, rng = robot.neutral, np.random.default_rng(0)
    points = points_around(robot, body, q, 3000, rng)
    assert points.shape == (3000, 3)
    barrier = ClearanceBarrier(robot, body)
    each = np.array(
        [barrier.evaluate(q, 0.0 * q, ss.Obstacles(p[None])).clearances.min() for p in points[:300]]
    )
    assert np.all(each >= 0.05 - 1e-6)  # 1 um: the Boltzmann mean of one point is its distance
    assert np.all(each <= 0.1 + 1e-6)
    # On all sides: most parts of the body have some of them.
    assert np.isfinite(barrier.evaluate(q, 0.0 * q, ss.Obstacles(points)).clearances).mean() > 0.8


def test_points_out_of_reach_matter_to_no_barrier(robot, body):
    points = points_beyond(robot, 500, np.random.default_rng(0))
    barrier = ClearanceBarrier(robot, body, reach=0.3)
    rng = np.random.default_rng(1)
    for _ in range(20):
        q = robot.random_configuration(rng)
        assert np.all(np.isinf(barrier.evaluate(q, 0.0 * q, ss.Obstacles(points)).clearances))


def test_every_row_is_measured_and_drawn(tmp_path):
    document = run_cloud_size_bench(CloudSizeSettings(robot="planar3", most=150, seconds=0.001))
    rows = document["results"]
    assert [(row["points"], row["where"]) for row in rows] == [
        (n, where) for where in ("out of reach", "within reach") for n in (10, 100)
    ]
    for row in rows:
        assert row["steps"] >= 3
        assert 0.0 < row["median_us"] <= row["p99_us"] <= row["max_us"]
    file = tmp_path / "points.png"
    draw_cloud_sizes(document, file)
    assert np.asarray(Image.open(file).convert("L")).std() > 5.0  # something is drawn


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"most": 9}, "most is 9, must be at least 10"),
        ({"seconds": 0.0}, r"seconds is 0\.0, must be positive"),
    ],
)
def test_settings_are_checked(change, message):
    with pytest.raises(ValueError, match=message):
        CloudSizeSettings(**change)
