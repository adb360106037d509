"""Robot, body, geometric system, torque controller and physics together."""

from __future__ import annotations

import numpy as np
import pytest
from stand_ins import simulate

from sidestep import Body, Robot, SceneObject, Simulation, evaluate
from sidestep._core import Obstacles
from sidestep.control import MotionProgram
from sidestep.simulation import run_kinematically
from sidestep.system import GeometricSystem
from sidestep.thesis import CollisionDensity
from sidestep.thesis.adapter import SystemAdapter

START, GOAL = np.deg2rad([0, 45, 0, -66, 0, 66, 45]), np.deg2rad([90, 45, 0, -66, 0, 66, 45])


@pytest.fixture(scope="module")
def fr3() -> tuple[Robot, CollisionDensity]:
    robot = Robot.named("fr3_arm")
    return robot, CollisionDensity(robot, Body.fit(robot, components=1, cache=False))


def test_free_workspace_as_in_the_thesis(fr3: tuple[Robot, CollisionDensity]) -> None:
    """Thesis 6.2.2: only joint 1 moves, exactly as the damped spring, and every limit holds."""
    robot, psi = fr3
    system = GeometricSystem([psi], stiffness=0.5, damping=1.5)
    run = simulate(Simulation(robot), system, MotionProgram(robot), START, GOAL, 6.0, Obstacles.none())
    result = evaluate(run)
    # roots -1/2 and -1: q - goal = -(pi/2)(2 exp(-t/2) - exp(-t));
    # semi-implicit Euler at 1 ms is off by about dt/2
    t = run.time
    expected = np.pi / 2 * (1 - 2 * np.exp(-t / 2) + np.exp(-t))
    np.testing.assert_allclose(run.q[:, 0], expected, atol=1e-3)
    assert result.path_deviation_rad < 1e-6  # the controller's torque weight leaves 1e-8 rad/s^2
    assert result.max_tracking_error is not None
    assert result.max_tracking_error < 1e-6
    assert not result.limits.any
    assert set(result.controller_status or {}) == {"ok"}


def test_torque_control_follows_the_kinematic_motion(fr3: tuple[Robot, CollisionDensity]) -> None:
    """Where the program tracks exactly, physics and the core's rollout are one motion."""
    robot, psi = fr3
    obstacles = Obstacles([[0.4, 0.53, 0.52], [0.4, 0.51, 0.52], [0.3, 0.45, 0.52]])
    objects = SceneObject.balls(obstacles, radius=0.03, motion="free")
    system = GeometricSystem([psi], stiffness=0.5, damping=1.5)
    simulated = simulate(
        Simulation(robot, objects), system, MotionProgram(robot), START, GOAL, 2.0, obstacles, arrival=None
    )
    kinematic = run_kinematically(
        robot, SystemAdapter(system, GOAL, obstacles), START, GOAL, 2.0, objects=objects, arrival=None
    )
    assert len(simulated) == len(kinematic) == 2000
    # the torque weight's 1e-8 rad/s^2, integrated twice along a motion that obstacles make stiffer
    np.testing.assert_allclose(simulated.q, kinematic.q, atol=1e-5)
    np.testing.assert_allclose(simulated.values, kinematic.values, rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(kinematic.achieved, kinematic.wanted, atol=1e-9)
    by_physics, by_rollout = evaluate(simulated), evaluate(kinematic)
    assert by_physics.min_clearance_m == pytest.approx(by_rollout.min_clearance_m, abs=2e-3)
    assert by_rollout.contacts is None


def test_callable_obstacles_and_points_with_velocity_are_the_same_motion(
    fr3: tuple[Robot, CollisionDensity],
) -> None:
    robot, psi = fr3
    system = GeometricSystem([psi], stiffness=0.5, damping=1.5)
    point, velocity = np.array([[0.4, 0.53, 0.52]]), np.array([[0.0, 0.0, -0.1]])
    moving = run_kinematically(
        robot, SystemAdapter(system, GOAL, Obstacles(point, 0.0, velocity)), START, GOAL, 0.5
    )
    called = run_kinematically(
        robot,
        SystemAdapter(system, GOAL, lambda time: Obstacles(point + time * velocity, 0.0, velocity)),
        START,
        GOAL,
        0.5,
    )
    # rounding of the point's position, added up step by step or at once
    np.testing.assert_allclose(moving.q, called.q, atol=1e-10)


def test_kinematic_run_stops_on_arrival(fr3: tuple[Robot, CollisionDensity]) -> None:
    robot, psi = fr3
    system = GeometricSystem([psi], stiffness=4.0, damping=4.0)
    run = run_kinematically(robot, SystemAdapter(system, GOAL, Obstacles.none()), START, GOAL, 20.0)
    assert run.arrived
    assert run.time_to_goal is not None
    assert run.time[-1] - run.time_to_goal == pytest.approx(0.2, abs=1.5e-3)  # the rule's hold, one period
    assert evaluate(run).reached


def test_goal_outside_the_limits(fr3: tuple[Robot, CollisionDensity]) -> None:
    robot, psi = fr3
    system = GeometricSystem([psi])
    with pytest.raises(ValueError, match="goal: joint 'fr3_joint4' is 0"):
        run_kinematically(
            robot, SystemAdapter(system, np.zeros(7), Obstacles.none()), START, np.zeros(7), 1.0
        )


def test_kinematic_objects_follow_their_scripts(fr3: tuple[Robot, CollisionDensity]) -> None:
    robot, psi = fr3
    still = SceneObject("still", "box", size=(0.1, 0.1, 0.1))
    ball = SceneObject.ball(
        "ball", [0, 1, 1], radius=0.1, motion="moving", velocity=(0, 0, -1), moves_during=(0.1, 0.3)
    )
    run = run_kinematically(
        robot,
        SystemAdapter(GeometricSystem([psi]), GOAL, Obstacles.none()),
        START,
        GOAL,
        0.5,
        objects=[still, ball],
    )
    np.testing.assert_allclose(run.object_poses[:, 0], np.tile([0, 0, 0, 1, 0, 0, 0], (len(run), 1)))
    np.testing.assert_allclose(run.object_poses[:, 1, 2], 1 - np.clip(run.time - 0.1, 0, 0.2), atol=1e-12)
