"""Black boxes: the last seconds stay on disk, whatever comes, and are read from the middle of a motion."""

import itertools
import os
import threading
import time

import numpy as np
import pytest

import sidestep as ss
from sidestep.obstacles import Sphere

Q = np.array([0.0, -0.4, 0.0, -2.2, 0.0, 1.9, 0.785])
PERIOD = 0.01


@pytest.fixture(scope="module")
def arm():
    return ss.Arm.load("fr3")


def controller_of(arm, **settings):
    made = ss.Controller(arm, ss.ControllerSettings(synchronous=True, period=PERIOD, **settings))
    made.set_obstacles([Sphere(0.05, pose=at(0.5, 0.3, 0.5), name="ball")])
    return made


def at(x, y, z):
    X = np.eye(4)
    X[:3, 3] = x, y, z
    return X


def moved(controller, q, v, steps, begin=0):
    rows = []
    for k in range(begin, begin + steps):
        command = controller.step(q, v, time=PERIOD * k)
        rows.append((q, v, command))
        q, v = command.position, command.velocity
    return q, v, rows


def test_the_last_seconds_stay_and_are_those_of_the_steps(arm, tmp_path):
    controller = controller_of(arm)
    controller.set_goal(Q + 0.3)
    q, v, _ = moved(controller, Q, 0.0 * Q, 50)
    with controller.black_box(tmp_path, seconds=3.0) as box:
        q, v, first = moved(controller, q, v, 400, begin=50)
        controller.set_goal(Q)
        _, _, second = moved(controller, q, v, 400, begin=450)
    summary = box.stop()
    rows = first + second
    assert (summary.steps, summary.lost, summary.trouble) == (800, 0, "")
    assert len(summary.files) == 4
    assert sorted(tmp_path.iterdir()) == summary.files
    assert summary.bytes == sum(file.stat().st_size for file in summary.files)
    run = ss.load_recording(tmp_path)
    assert run.complete
    assert run.damage == ""
    assert not run.whole
    kept = len(run)
    assert 3.0 <= PERIOD * kept <= 4.0 + 1e-9
    np.testing.assert_array_equal(run.q, [q for q, _, _ in rows[-kept:]])
    np.testing.assert_array_equal(run.torque, [c.torque for _, _, c in rows[-kept:]])
    np.testing.assert_allclose(run.time, PERIOD * np.arange(850 - kept, 850), atol=1e-8)
    assert [one.words for one in run.events if one.kind == "request"] == ["a joint goal"]
    of_the_ball = [k for k, (_, _, command) in enumerate(rows[-kept:]) if command.point >= 0]
    assert len(of_the_ball) > 20
    for k in of_the_ball:
        assert run.link[k] in run.links
        assert run.nearest[k] == f"link '{run.link[k]}' and 'ball'"


def test_of_a_folder_the_box_that_was_written_to_last_is_read(arm, tmp_path):
    first, second = controller_of(arm), controller_of(arm)
    running = first.black_box(tmp_path)
    time.sleep(0.01)  # boxes are named by their begin
    ended = second.black_box(tmp_path)
    moved(second, Q, 0.0 * Q, 5)
    files = ended.stop().files
    moved(first, Q, 0.0 * Q, 8)
    running.stop()
    for file in files:
        assert file == max(tmp_path.iterdir())  # it began last
        os.utime(file, (0.0, 0.0))
    assert len(ss.load_recording(tmp_path)) == 8


def test_each_file_stands_alone(arm, tmp_path):
    """It begins with the arm, obstacles and request that its first step uses, and says the same as all together."""
    controller = controller_of(arm)
    controller.set_goal(Q + 0.3)
    moving = ss.Obstacles([[0.6, 0.0, 0.5]], radii=0.05, velocities=[[0.0, 0.05, 0.0]])
    controller.set_obstacles(moving, source="tracker", valid_for=100.0)
    with controller.black_box(tmp_path, seconds=3.0) as box:
        moved(controller, Q, 0.0 * Q, 350)
    files = box.stop().files
    whole, last = ss.load_recording(files), ss.load_recording(files[2])
    offset = 200
    assert len(last) == 100
    np.testing.assert_array_equal(whole.q[offset:300], last.q)
    assert list(whole.nearest[offset:300]) == list(last.nearest)
    common = [k for k, t in enumerate(whole.link_time) if t in last.link_time]
    assert len(common) > 20
    rows = [list(last.link_time).index(whole.link_time[k]) for k in common]
    # Obstacles move on from the moment of their first use, which is rounded to nanoseconds.
    np.testing.assert_allclose(whole.link_clearance[common], last.link_clearance[rows], atol=1e-9)


def test_clouds_that_change_little_are_whole_in_each_file(arm, tmp_path):
    rng = np.random.default_rng(3)
    cloud = rng.uniform(0.5, 1.0, (600, 3)).astype(np.float32)
    controller = controller_of(arm)
    controller.set_goal(Q + 0.3)
    q, v = Q, np.zeros(7)
    with (
        controller.record(tmp_path / "run.mcap"),
        controller.black_box(tmp_path / "boxes", seconds=3.0) as box,
    ):
        for k in range(70):
            cloud[rng.integers(0, 600, 10)] += np.float32(0.01)
            controller.set_obstacles(ss.Obstacles(cloud, radii=0.01), source="camera", time=0.05 * k)
            q, v, _ = moved(controller, q, v, 5, begin=5 * k)
    assert ss.replay(tmp_path / "run.mcap").equal
    files = box.stop().files
    assert len(files) == 4
    run = ss.load_recording(tmp_path / "run.mcap")
    for file in files:
        alone = ss.load_recording(file)
        assert alone.damage == ""
        times, common, rows = np.intersect1d(
            np.round(alone.link_time, 6), np.round(run.link_time, 6), return_indices=True
        )
        assert len(times) > 20 or file == files[-1]
        np.testing.assert_allclose(alone.link_clearance[common], run.link_clearance[rows], atol=1e-8)


def test_a_box_beside_a_recording_changes_neither(arm, tmp_path):
    controller = controller_of(arm)
    controller.set_goal(Q + 0.3)
    with controller.record(tmp_path / "run.mcap"):
        q, v, _ = moved(controller, Q, 0.0 * Q, 60)
        with controller.black_box(tmp_path / "boxes"):
            q, v, _ = moved(controller, q, v, 60, begin=60)
        with controller.black_box(tmp_path / "boxes") as again:
            moved(controller, q, v, 60, begin=120)
    assert ss.replay(tmp_path / "run.mcap").equal
    run = ss.load_recording(tmp_path / "run.mcap")
    box = ss.load_recording(again.stop().files)
    np.testing.assert_array_equal(box.acceleration, run.acceleration[120:])
    np.testing.assert_array_equal(box.link, run.link[120:])


def test_a_held_object_and_a_change_of_arm_are_in_the_files_after_it(arm, tmp_path):
    from sidestep.obstacles import Cylinder

    controller = controller_of(arm)
    with controller.black_box(tmp_path, seconds=1.5) as box:
        q, v, _ = moved(controller, Q, 0.0 * Q, 30)
        fingers = ["fr3_leftfinger", "fr3_rightfinger"]
        controller.attach("rod", Cylinder(0.02, 0.2), link="fr3_hand", pose=at(0, 0, 0.2), may_touch=fingers)
        moved(controller, q, v, 300, begin=30)
    files = box.stop().files
    assert "rod" in ss.load_recording(files).links
    assert "rod" in ss.load_recording(files[-1:]).links


def test_a_folder_of_boxes_is_kept_near_a_size(arm, tmp_path):
    most = 4 << 20
    rng = np.random.default_rng(0)
    for _ in range(3):
        controller = controller_of(arm)
        with controller.black_box(tmp_path, seconds=100.0, most_bytes=most):
            for k in range(60):
                cloud = rng.uniform(-1.0, 1.0, (3000, 3)) + np.array([2.0, 0.0, 0.0])
                controller.set_obstacles(ss.Obstacles(cloud, radii=0.01), source="camera")
                controller.step(Q, 0.0 * Q, time=PERIOD * k)
                time.sleep(0.001)
    sizes = [file.stat().st_size for file in tmp_path.iterdir()]
    largest_set = (
        60 * len(cloud) + 300_000
    )  # a file ends after what makes it too large, and begins with the present
    assert most // 2 < sum(sizes) <= most + 2 * largest_set
    assert len(ss.load_recording(tmp_path)) > 0


def test_it_begins_and_ends_in_another_thread_while_steps_go_on(arm, tmp_path):
    controller = ss.Controller(arm, ss.ControllerSettings(planner=None, look_ahead=None))
    controller.set_obstacles(ss.Obstacles.none())
    over, steps = threading.Event(), itertools.count()
    newest = [0]

    def step():
        while not over.is_set():
            controller.step(Q, 0.0 * Q)
            newest[0] = next(steps)

    thread = threading.Thread(target=step)
    thread.start()
    boxes = []
    for n in range(20):
        box = controller.black_box(tmp_path / str(n))
        controller.set_goal(Q + 0.01 * n)
        last = newest[0] + 10
        while newest[0] < last and thread.is_alive():
            time.sleep(0.001)
        boxes.append(box.stop())
    over.set()
    thread.join()
    for box in boxes:
        run = ss.load_recording(box.files)
        assert (len(run), run.damage, box.lost) == (box.steps, "", 0)
        assert box.steps > 0


def test_what_is_wrong_is_said(arm, tmp_path):
    controller = controller_of(arm)
    with pytest.raises(ValueError, match=r"black box: seconds is 0\.0+, allowed: positive and finite"):
        controller.black_box(tmp_path, 0.0)
    with pytest.raises(ValueError, match="black box: most_bytes is 5, allowed: 1048576 and more"):
        controller.black_box(tmp_path, most_bytes=5)
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError):
        controller.black_box(tmp_path / "file")
    box = controller.black_box(tmp_path / "boxes")
    with pytest.raises(RuntimeError, match="its black box is on already"):
        controller.black_box(tmp_path / "boxes")
    moved(controller, Q, 0.0 * Q, 3)
    (file,) = box.stop().files
    with pytest.raises(ValueError, match="begins in the middle of a motion, so that it cannot be replayed"):
        ss.replay(file)
    with pytest.raises(ValueError, match="there is no black box"):
        ss.load_recording(tmp_path)


def test_a_folder_that_vanishes_ends_the_box_and_not_the_steps(arm, tmp_path):
    import shutil

    controller = controller_of(arm)
    box = controller.black_box(tmp_path / "boxes", seconds=0.3)
    q, v, _ = moved(controller, Q, 0.0 * Q, 5)
    time.sleep(0.05)
    shutil.rmtree(tmp_path / "boxes")
    q, v, _ = moved(controller, q, v, 100, begin=5)
    time.sleep(0.05)
    q, v, rows = moved(controller, q, v, 5, begin=105)
    assert len(rows) == 5
    with pytest.warns(
        RuntimeWarning, match=r"black box in '.*': No such file or directory, so that \d+ steps"
    ):
        summary = box.stop()
    assert summary.lost >= 5
    assert summary.trouble == "No such file or directory"
