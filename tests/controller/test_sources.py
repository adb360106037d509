"""Obstacles by source: what replaces what, how long it is believed, and what the arm does when a source fails."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

import sidestep as ss
from sidestep.controller import SourceSettings
from sidestep.obstacles import pose_at

START, GOAL = np.array([0.0, 0.3, 0.3]), np.array([1.9, 0.3, 0.3])
PERIOD = 1e-3
FAR = np.array([[3.0, 0.0, 0.0]])


@pytest.fixture(scope="module")
def planar() -> ss.Arm:
    return ss.Arm.load("planar3")


def controller_of(arm: ss.Arm, **settings: object) -> ss.Controller:
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True, **settings))
    controller.set_goal(GOAL)
    return controller


def test_an_arm_that_was_told_nothing_stays_and_says_what_to_do(planar: ss.Arm) -> None:
    controller = controller_of(planar)
    motion = ss.integrate(controller, START, np.zeros(3), steps=300)
    np.testing.assert_array_equal(motion.last_q, START)
    assert set(motion.statuses) == {ss.SafetyStatus.stale}
    assert controller.explain() == (
        "stopped: obstacles were never set: the arm stays where it is; "
        "set_obstacles(Obstacles.none()) says that the space is free"
    )
    controller.set_obstacles(ss.Obstacles.none())
    assert controller.step(START, np.zeros(3)).activity == ss.Activity.moving


def test_a_source_that_falls_silent_stops_the_arm_and_the_next_set_lets_it_go_on(planar: ss.Arm) -> None:
    controller = controller_of(planar)
    q, v = START, np.zeros(3)
    for k in range(400):  # 30 Hz, from which one may expect the next
        if k < 100 and k % 33 == 0:
            controller.set_obstacles(ss.Obstacles(FAR), source="camera", time=controller.time)
        motion = ss.integrate(controller, q, v, steps=1)
        q, v = motion.last_q, motion.last_v
        if k == 340:
            assert motion.statuses[0] < ss.SafetyStatus.stale
    # the newest set was captured at 0.099 s
    assert motion.statuses[0] == ss.SafetyStatus.stale
    assert controller.explain().startswith("stopped: source 'camera' is 0.30 s old and valid for 0.25 s")
    motion = ss.integrate(controller, q, v, steps=600)
    assert np.abs(motion.last_v).max() < 0.01
    controller.set_obstacles(ss.Obstacles(FAR), source="camera", time=controller.time)
    assert controller.step(motion.last_q, motion.last_v).activity == ss.Activity.moving


def test_the_arm_waits_for_a_source_that_is_expected(planar: ss.Arm, tmp_path: Path) -> None:
    controller = controller_of(planar)
    with controller.record(tmp_path / "run.mcap"):
        controller.set_obstacles(ss.Obstacles.none())
        controller.expect_obstacles("side")
        motion = ss.integrate(controller, START, np.zeros(3), steps=100)
        np.testing.assert_array_equal(motion.last_q, START)
        assert controller.explain() == (
            "stopped: source 'side' was expected and has not come yet; the arm goes on when it does"
        )
        assert [(s.name, s.age, s.is_overdue) for s in controller.sources] == [
            ("scene", pytest.approx(0.099), False),
            ("side", np.inf, True),
        ]
        controller.set_obstacles(ss.Obstacles(FAR), source="side", time=controller.time)
        controller.expect_obstacles("side")  # it is there
        assert controller.step(START, np.zeros(3)).activity == ss.Activity.moving
        controller.expect_obstacles("back")
        assert controller.step(START, np.zeros(3)).activity == ss.Activity.stale
        controller.remove_obstacles("back")
        assert controller.step(START, np.zeros(3)).activity == ss.Activity.moving
    assert ss.replay(tmp_path / "run.mcap").equal
    with pytest.raises(ValueError, match="the source's name is ''"):
        controller.expect_obstacles("")


def test_what_rests_in_the_scene_is_believed_for_ever(planar: ss.Arm) -> None:
    controller = controller_of(planar)
    controller.set_obstacles(ss.Obstacles(FAR))
    motion = ss.integrate(controller, START, np.zeros(3), steps=5000)
    assert max(motion.statuses) < ss.SafetyStatus.stale
    np.testing.assert_allclose(motion.last_q, GOAL, atol=0.01)
    assert [(s.name, s.size, s.valid_for) for s in controller.sources] == [("scene", 1, np.inf)]


def test_a_told_velocity_is_not_extrapolated_beyond_its_validity(planar: ss.Arm) -> None:
    controller = controller_of(planar)
    controller.set_obstacles(ss.Obstacles(FAR, velocities=[[-1.0, 0.0, 0.0]]))
    ss.integrate(controller, START, np.zeros(3), steps=1000)
    assert controller.obstacles.points[0, 0] == pytest.approx(2.75, abs=1e-9)
    assert controller.command.status == ss.SafetyStatus.stale
    np.testing.assert_array_equal(controller.obstacles.velocities, np.zeros((1, 3)))


def test_points_are_moved_from_their_capture_to_now(planar: ss.Arm) -> None:
    controller = controller_of(planar)
    controller.set_obstacles(ss.Obstacles.none())
    ss.integrate(controller, START, np.zeros(3), steps=1000)
    captured = controller.time - 0.08
    controller.set_obstacles(
        ss.Obstacles(FAR, velocities=[[0.0, 0.5, 0.0]]), source="tracker", time=captured, valid_for=1.0
    )
    controller.step(START, np.zeros(3))
    assert controller.obstacles.points[0, 1] == pytest.approx(0.5 * (0.08 + PERIOD), abs=1e-9)


def test_sources_do_not_replace_each_other(planar: ss.Arm) -> None:
    controller = controller_of(planar)
    controller.set_obstacles(ss.Sphere(0.1, pose_at([3.0, 0.0, 0.0]), name="post"))
    controller.set_obstacles(ss.Obstacles(FAR + 1.0), source="camera", time=0.0)
    controller.set_obstacles(ss.Obstacles(FAR + 2.0), source="camera", time=0.01)
    controller.step(START, np.zeros(3))
    assert len(controller.obstacles) == 2
    assert controller.obstacles.name_of(0) == "post"
    controller.remove_obstacles("camera")
    controller.step(START, np.zeros(3))
    assert [s.name for s in controller.sources] == ["scene"]


def test_an_empty_set_is_believed_when_the_source_stays_empty(planar: ss.Arm) -> None:
    controller = controller_of(planar, sources=SourceSettings(empty_after=0.5))
    ball = ss.Obstacles([planar.robot.pose(GOAL, planar.robot.links[-1].name)[:3, 3]], radii=0.05)
    controller.set_obstacles(ball)
    motion = ss.integrate(controller, START, np.zeros(3), steps=3000)
    controller.set_obstacles(ss.Obstacles.none())
    blocked = ss.integrate(controller, motion.last_q, motion.last_v, steps=450)
    assert blocked.clearance.max() < 0.1
    assert controller.sources[0].is_emptied
    free = ss.integrate(controller, blocked.last_q, blocked.last_v, steps=5000)
    np.testing.assert_allclose(free.last_q, GOAL, atol=0.01)
    assert (controller.sources[0].size, controller.sources[0].is_emptied) == (0, False)


def test_named_shapes_one_by_one(planar: ss.Arm) -> None:
    controller = controller_of(planar)
    controller.set_obstacles([ss.Sphere(0.1, pose_at([3.0, 0.0, 0.0]), name="post")])
    controller.add_obstacle(ss.Box((0.2, 0.2, 0.2), pose_at([0.0, 4.0, 0.0]), name="box"))
    turned = pose_at([0.0, 0.0, 3.0])
    turned[:3, :3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    controller.move_obstacle("box", turned)
    controller.step(START, np.zeros(3))
    seen = controller.obstacles
    box = seen.points[[seen.name_of(k) == "box" for k in range(len(seen))]]
    np.testing.assert_allclose(box.mean(axis=0), [0.0, 0.0, 3.0], atol=1e-3)
    controller.remove_obstacle("post")
    controller.step(START, np.zeros(3))
    assert {name for name, _ in controller.obstacles.groups} == {"box"}
    with pytest.raises(ValueError, match="source 'scene' has no 'post', it has 'box'"):
        controller.remove_obstacle("post")
    with pytest.raises(ValueError, match="has 'box' already"):
        controller.add_obstacle(ss.Sphere(0.1, pose_at([1.0, 0.0, 0.0]), name="box"))


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ({"time": float("nan")}, "time is nan"),
        ({"time": np.inf}, "time of source 'camera' is infinite"),
        ({"valid_for": 0.0}, r"valid_for of source 'camera' is 0\.0+ s, allowed: above 0"),
    ],
)
def test_times_that_are_none_are_refused(planar: ss.Arm, told: dict[str, float], message: str) -> None:
    controller = controller_of(planar)
    with pytest.raises(ValueError, match=message):
        controller.set_obstacles(ss.Obstacles(FAR), source="camera", **told)
    controller.step(START, np.zeros(3))
    assert controller.sources == []


def test_a_capture_in_the_future_is_of_another_clock(planar: ss.Arm) -> None:
    controller = controller_of(planar)
    controller.set_obstacles(ss.Obstacles(FAR), source="camera", time=1.7e9)
    assert controller.step(START, np.zeros(3)).status == ss.SafetyStatus.stale
    assert "its clock is not that of step" in controller.explain()


def test_velocities_that_nobody_told_are_found_from_a_stream_of_sets(planar: ss.Arm) -> None:
    controller = controller_of(planar)
    rng = np.random.default_rng(0)
    ball = rng.normal(size=(200, 3))
    ball = 0.1 * ball / np.linalg.norm(ball, axis=1, keepdims=True)
    wall = np.stack([np.full(400, 2.0), *(rng.uniform(-1.0, 1.0, (2, 400)))], axis=1)
    speed = np.array([0.0, 0.4, 0.0])
    q, v = START, np.zeros(3)
    for k in range(10):
        at = np.array([3.0, -0.5, 0.5]) + speed * controller.time
        controller.set_obstacles(
            ss.Obstacles(np.vstack([wall, at + ball])), source="camera", time=controller.time
        )
        motion = ss.integrate(controller, q, v, steps=33)
        q, v = motion.last_q, motion.last_v
        found = controller.obstacles.velocities
        if k == 0:
            assert not found.any()
    np.testing.assert_array_equal(found[:400], np.zeros((400, 3)))
    np.testing.assert_allclose(found[400:], np.tile(speed, (200, 1)), atol=0.02)


def test_a_named_shape_that_is_moved_has_the_velocity_of_its_motion(planar: ss.Arm) -> None:
    controller = controller_of(planar)
    controller.set_obstacles(ss.Box((0.2, 0.2, 0.2), pose_at([3.0, 0.0, 0.0]), name="box"), source="tracker")
    q, v = START, np.zeros(3)
    for k in range(5):
        motion = ss.integrate(controller, q, v, steps=20)
        q, v = motion.last_q, motion.last_v
        controller.move_obstacle("box", pose_at([3.0, 0.01 * (k + 1), 0.0]), source="tracker")
    motion = ss.integrate(controller, q, v, steps=1)
    np.testing.assert_allclose(
        controller.obstacles.velocities, np.tile([0.0, 0.5, 0.0], (len(controller.obstacles), 1)), atol=0.01
    )
    ss.integrate(controller, motion.last_q, motion.last_v, steps=400)
    assert controller.command.status == ss.SafetyStatus.stale
    assert "source 'tracker'" in controller.explain()


def test_old_points_with_new_times_are_no_news(planar: ss.Arm) -> None:
    controller = controller_of(planar)
    frozen = ss.Obstacles(FAR, velocities=[[-0.3, 0.0, 0.0]])
    q, v = START, np.zeros(3)
    for _ in range(12):
        controller.set_obstacles(frozen, source="tracker", time=controller.time)
        motion = ss.integrate(controller, q, v, steps=33)
        q, v = motion.last_q, motion.last_v
    assert controller.command.status == ss.SafetyStatus.stale
    assert "old data with new times" in controller.explain()


def test_a_pose_that_is_no_rotation_is_refused_and_nothing_moves(planar: ss.Arm) -> None:
    controller = controller_of(planar)
    controller.set_obstacles(ss.Sphere(0.1, pose_at([3.0, 0.0, 0.0]), name="post"))
    with pytest.raises(ValueError, match=r"move_obstacle: .* is not a rotation: an entry of R\^T R - 1 is 3"):
        controller.move_obstacle("post", np.diag([2.0, 2.0, 2.0, 1.0]))
    mirrored = np.diag([-1.0, 1.0, 1.0, 1.0])
    with pytest.raises(ValueError, match=r"move_obstacle: .* mirrors"):
        controller.move_obstacle("post", mirrored)
    with pytest.raises(ValueError, match=r"obstacles: 'post': .* mirrors"):
        ss.Obstacles(FAR).named(["post"], [1], [mirrored])
    controller.step(START, np.zeros(3))
    np.testing.assert_array_equal(controller.obstacles.points, [[3.0, 0.0, 0.0]])


def faster_than_real_time(planar: ss.Arm) -> ss.Controller:
    """After 0.1 s of a simulation in which a ball moves at 0.3 m/s, set 30 times a second without a time."""
    controller = ss.Controller(planar, ss.ControllerSettings(output="acceleration", planner=None))
    controller.set_goal(START)
    q, v = START, np.zeros(3)
    for k in range(100):
        if k % 33 == 0:
            controller.set_obstacles(ss.Obstacles([[3.0, 0.3e-3 * k, 0.0]], radii=0.05), source="tracker")
        command = controller.step(q, v)
        v = v + PERIOD * command.acceleration
        q = q + PERIOD * v
    return controller


def test_untold_times_of_sets_are_those_of_a_simulation_that_is_faster_than_real_time(planar: ss.Arm) -> None:
    # A machine that holds a step up makes a simulation of it that is slower: another one then.
    tried = (faster_than_real_time(planar) for _ in range(50))
    controller = next(made for made in tried if made.command.late_steps == 0)
    np.testing.assert_allclose(controller.obstacles.velocities, [[0.0, 0.3, 0.0]], atol=0.03)
    assert controller.time == pytest.approx(time.monotonic(), abs=60.0)  # its stamps are of this clock
