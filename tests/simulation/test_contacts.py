"""What MuJoCo reports when the arm meets the scene."""

from __future__ import annotations

import numpy as np
import pytest
from stand_ins import InverseDynamics, Spring, simulate

from sidestep import Robot, SceneObject, Simulation, evaluate
from sidestep._core import Obstacles
from sidestep.distance import seen_obstacles

START, GOAL = np.zeros(2), np.array([1.2, 0.0])


def _sweep(*objects: SceneObject, duration: float = 2.0, obstacles=None):
    """The planar arm, stretched along x, sweeps a quarter turn to the left."""
    simulation = Simulation(Robot.named("planar2"), objects)
    seen = Obstacles.none() if obstacles is None else obstacles
    return simulate(
        simulation, Spring(6.0, 5.0), InverseDynamics(), START, GOAL, duration, seen, arrival=None
    )


def test_free_ball_is_pushed() -> None:
    run = _sweep(SceneObject.ball("ball", [0.8, 0.3, 0.0], radius=0.03, motion="free", mass=0.05))
    assert {(c.link, c.obstacle) for c in run.contacts} == {("link2", "ball")}
    assert max(c.force for c in run.contacts) > 0.0
    result = evaluate(run)
    assert result.contacts == len(run.contacts) > 0
    assert result.contact_pairs == ("link2 - ball",)
    assert result.moved_objects["ball"] > 0.05  # the arm sweeps on over 0.7 m of arc behind the ball
    assert not result.collision_free
    before = run.time < run.contacts[0].time
    np.testing.assert_allclose(run.object_poses[before, 0, :3], [[0.8, 0.3, 0.0]] * before.sum(), atol=1e-9)


def test_fixed_ball_stops_the_arm() -> None:
    run = _sweep(SceneObject.ball("ball", [0.8, 0.3, 0.0], radius=0.03))
    result = evaluate(run)
    assert result.contacts
    assert not result.moved_objects
    assert not result.reached
    assert result.min_clearance_m is not None
    assert result.min_clearance_m < 0.0


def test_untouched_scene() -> None:
    run = _sweep(
        SceneObject.ball("below", [0.8, -0.3, 0.0], radius=0.03, motion="free"),
        SceneObject("box", "box", size=(0.1, 0.1, 0.1), pose=_at(0.5, 1.2, 0.0)),
    )
    result = evaluate(run)
    assert result.contacts == 0
    assert not result.moved_objects
    assert result.reached
    assert result.collision_free
    np.testing.assert_allclose(run.object_poses[-1, 0, :3], [0.8, -0.3, 0.0], atol=1e-9)  # floats still


def test_overlapping_free_balls_do_not_push_each_other() -> None:
    run = _sweep(
        SceneObject.ball("a", [0.8, -0.3, 0.0], radius=0.03, motion="free"),
        SceneObject.ball("b", [0.8, -0.32, 0.0], radius=0.03, motion="free"),
    )
    assert not evaluate(run).moved_objects


def test_moving_ball_follows_its_script_and_is_seen() -> None:
    ball = SceneObject.ball(
        "ball", [0.9, -0.6, 0.0], radius=0.03, motion="moving", velocity=(0, -0.2, 0), moves_during=(0.5, 1.5)
    )
    system = Spring(6.0, 5.0)
    run = simulate(
        Simulation(Robot.named("planar2"), [ball]),
        system,
        InverseDynamics(),
        START,
        GOAL,
        2.0,
        lambda time: seen_obstacles([ball], time),
        arrival=None,
    )
    expected = -0.6 - 0.2 * np.clip(run.time - 0.5, 0.0, 1.0)
    np.testing.assert_allclose(run.object_poses[:, 0, 1], expected, atol=1e-12)
    np.testing.assert_allclose(np.array(system.seen)[:, 0, 1], expected, atol=1e-12)


def test_constant_velocity_obstacles_advance_without_touching_the_callers() -> None:
    obstacles = Obstacles([[0.9, -0.6, 0.0]], 0.0, [[0.0, -0.1, 0.0]])
    system = Spring()
    simulate(
        Simulation(Robot.named("planar2")),
        system,
        InverseDynamics(),
        START,
        GOAL,
        0.5,
        obstacles,
        arrival=None,
    )
    np.testing.assert_allclose(np.array(system.seen)[:, 0, 1], -0.6 - 0.1 * np.arange(500) * 1e-3, atol=1e-12)
    np.testing.assert_array_equal(obstacles.points, [[0.9, -0.6, 0.0]])


def test_floor_catches_what_the_arm_knocks_down() -> None:
    ball = SceneObject.ball("ball", [0.8, 0.3, 0.0], radius=0.03, motion="free")
    simulation = Simulation(Robot.named("planar2"), [ball], floor_height=-0.02)  # the arm itself dips into it
    run = simulate(
        simulation, Spring(6.0, 5.0), InverseDynamics(), START, np.array([0.1, 0.0]), 0.5, Obstacles.none()
    )
    assert not run.contacts  # arm-floor contacts are off


@pytest.mark.parametrize(
    ("start", "message"), [([4.0, 0.0], r"start.*joint1.*4\.0"), ([np.nan, 0.0], "start.*joint1.*nan")]
)
def test_start_outside_the_limits(start, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        simulate(
            Simulation(Robot.named("planar2")),
            Spring(),
            InverseDynamics(),
            np.array(start),
            GOAL,
            1.0,
            Obstacles.none(),
        )


def _at(x: float, y: float, z: float) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose
