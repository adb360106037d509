"""`sidestep bench camera-times`: the room, the recipe, the counts of lost images, and that every row is there."""

import json

import numpy as np
import pytest

import sidestep as ss
from sidestep.bench import CameraTimesSettings, run_camera_times
from sidestep.bench.camera_beside import LOADS, LostFrames, lost_on_a_free_core, on_cores
from sidestep.bench.camera_room import CameraImages, cameras, swing
from sidestep.bench.camera_stages import STAGES, ImageTimes
from sidestep.bench.camera_times import BESIDE, CASES, ratios
from sidestep.bench.cloud_recipe import STAGES as RECIPE_STAGES
from sidestep.bench.cloud_recipe import off_the_arm, points_of, update_by_recipe
from sidestep.cli import main
from sidestep.perception import DepthCamera, Frame

TINY = {"images": 3, "width": 212, "height": 120, "rounds": 1, "seconds": 0.2}


@pytest.fixture(scope="module")
def arm():
    return ss.Arm.load("fr3")


@pytest.fixture(scope="module")
def document():
    try:
        return run_camera_times(CameraTimesSettings(**TINY))
    except RuntimeError as error:
        if "which does not start" in str(error):
            pytest.skip(str(error))
        raise


def _camera(**changes):
    return DepthCamera(
        "front", **({"width": 4, "height": 3, "fx": 2.0, "fy": 2.0, "cx": 1.5, "cy": 1.0} | changes)
    )


def test_every_row_is_measured(document):
    rows = document["stages"]["results"]
    assert [row["name"] for row in rows] == [*(case.name for case in CASES), "recipe of 0.2"]
    for row in rows:
        names = RECIPE_STAGES if row["name"] == "recipe of 0.2" else STAGES
        assert set(row["wall_ms"]) == {*names, "total"}
        assert row["images"] == (2 if row["name"] == "recipe of 0.2" else 3)
        assert row["voxels"] > 50  # the table alone has as many
        for times in (*row["wall_ms"].values(), row["thread_ms"]):
            assert 0.0 <= times["p50"] <= times["p99"] <= times["max"]
        assert (
            sum(row["wall_ms"][name]["max"] for name in names if name != "total")
            >= row["wall_ms"]["total"]["p50"]
        )
    unseen = {row["name"]: row["wall_ms"].get("unseen", {}).get("p50") for row in rows}
    assert unseen["default, unseen closed"] > 10.0 * unseen["default"]
    coarse, fine = rows[0], rows[2]
    assert fine["voxels"] > coarse["voxels"]
    assert set(document["stages"]["recipe_over"]) == {case.name for case in CASES}


def test_every_load_is_beside_the_loop(document):
    rows = document["beside"]
    assert [(row["case"], row["beside"]) for row in rows] == [
        (case, load.name) for case in BESIDE for load in LOADS
    ]
    for row, load in zip(rows, 2 * LOADS, strict=True):
        assert row["steps"] == 200
        assert (row["frames"] is None) == (load.cameras == 0)
        if load.cameras:
            # 0.2 s at the rate, fewer where the last images wait; never more than one per period and camera
            assert 1 <= row["frames"]["images"] <= load.cameras * (0.2 * load.rate + 2) * 5
            assert row["frames"]["lost"] == row["frames"]["replaced"] + row["frames"]["late"]


@pytest.mark.parametrize(
    ("milliseconds", "cameras", "late", "replaced"),
    [
        (8.0, 1, 0, 0),
        (10.0, 1, 0, 0),  # ends just as the next one comes
        (15.0, 1, 6, 2),  # done at 15, 30, ..., 90 ms; those of 20 and 50 ms are never taken
        (3.0, 3, 0, 0),
        (4.0, 3, 1, 1),  # the third is done at 12 ms; its next one is replaced at 20 ms
    ],
)
def test_images_that_take_too_long_are_lost(milliseconds, cameras, late, replaced):
    told = lost_on_a_free_core([1e-3 * milliseconds] * 6, cameras=cameras, rate=100.0).to_dict()
    assert (told["late"], told["replaced"], told["images"]) == (late, replaced, 6 + replaced)
    assert told["lost_share"] == pytest.approx((late + replaced) / (6 + replaced))


def test_late_and_replaced_images_count():
    frames = LostFrames()
    frames.count(due=1.0, done=1.02, thread=0.01, skipped=0, period=0.03)
    frames.count(due=1.1, done=1.14, thread=0.03, skipped=2, period=0.03)
    told = frames.to_dict()
    assert (told["images"], told["replaced"], told["late"], told["lost"]) == (4, 2, 1, 3)
    assert told["thread_ms"]["p50"] == pytest.approx(20.0)
    assert told["age_us"]["max"] == pytest.approx(40_000.0)


def test_points_are_where_pixels_look_and_none_where_they_see_nothing():
    X = np.eye(4)
    X[:3, 3] = 0.0, 0.0, 1.0
    depth = np.zeros((3, 4))
    depth[1, 3], depth[0, 0] = 2.0, np.nan
    np.testing.assert_allclose(points_of(_camera(pose=X), depth), [[1.5, 0.0, 3.0]])


def test_the_recipe_takes_the_arm_out_and_sets_the_rest(arm):
    hand = arm.robot.pose(arm.neutral, "fr3_hand")[:3, 3]
    np.testing.assert_array_equal(
        off_the_arm(arm, arm.neutral, np.array([hand, [0.9, 0.5, 0.3]])), [False, True]
    )
    X = np.eye(4)
    X[:3, 3] = hand - [0.0, 0.0, 1.0]
    depth = np.zeros((3, 4), dtype=np.uint16)
    depth[1, 1:3] = 1000  # 25 cm to both sides of the hand's middle
    depth[0, 0] = 3000
    controller = ss.Controller(arm)
    camera = _camera(pose=X, cx=1.0, fx=4.0)
    balls, stages = update_by_recipe(controller, arm, camera, Frame("front", 0.0, depth, 0.001, arm.neutral))
    assert balls == 2
    assert len(stages) == len(RECIPE_STAGES)
    assert min(stages) > 0.0


def test_the_replay_goes_on_and_the_arm_swings_within_limits(arm):
    q = np.array([swing(arm, k, 20) for k in range(21)])
    np.testing.assert_allclose(q[0], q[20], atol=1e-12)
    assert np.ptp(q, axis=0).min() > 0.2
    limits = arm.robot.limits
    assert ((q >= limits.lower) & (q <= limits.upper)).all()
    camera = _camera(pose=np.eye(4))
    frames = tuple(
        Frame("front", 0.1 * k, np.full((3, 4), 100 + k, np.uint16), 0.001, q[k]) for k in range(3)
    )
    images = CameraImages(camera, frames)
    again = images.at(7)
    assert again.time == pytest.approx(7.0 / 30.0)
    assert again.depth[0, 0] == 101
    with pytest.raises(ValueError, match="there are no frames, allowed: one or more"):
        CameraImages(camera, ())
    assert [each.fx for each in cameras(width=424, height=240)] == [212.5] * 3


def test_times_of_images_are_kept_apart_where_the_core_was_taken_away():
    times = ImageTimes()
    for k, interrupted in enumerate((0, 3, 0)):
        times.add(10 * k, {"total": 0.001 * (1 + 9 * (k == 1))}, 0.001, interrupted, remembered=k)
    told = times.to_dict()
    assert (told["images"], told["voxels"], told["remembered"], told["undisturbed_images"]) == (3, 10, 1, 2)
    assert told["wall_ms"]["total"]["max"] == 10.0
    assert told["undisturbed_ms"]["total"]["max"] == 1.0


def test_ratios_are_of_processor_time():
    rows = [
        {"name": name, "thread_ms": {"p50": p50}} for name, p50 in (("a", 5.0), ("b", 20.0), ("r", 300.0))
    ]
    assert ratios(rows) == {"a": 60.0, "b": 15.0}


def test_cores_are_given_back():
    os = pytest.importorskip("os")
    if not hasattr(os, "sched_getaffinity"):
        pytest.skip("the system has no affinity")
    before = os.sched_getaffinity(0)
    with on_cores({min(before)}):
        assert os.sched_getaffinity(0) == {min(before)}
    assert os.sched_getaffinity(0) == before


def test_the_command_writes_the_same(capsys, monkeypatch, document):
    few = ["--images", "2", "--width", "64", "--height", "48", "--rounds", "1", "--seconds", "0"]
    monkeypatch.setattr("sys.argv", ["sidestep", "bench", "camera-times", *few, "--json", "-"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code in (0, None)
    told = json.loads(capsys.readouterr().out)
    assert told["benchmark"] == document["benchmark"] == "camera times"
    assert told["beside"] == []
    assert told["image"] == [64, 48]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rounds": 0}, "rounds is 0, must be at least 1"),
        ({"seconds": np.inf}, "seconds is inf, must be 0 or more, and finite"),
    ],
)
def test_settings_are_checked(change, message):
    with pytest.raises(ValueError, match=message):
        CameraTimesSettings(**change)
