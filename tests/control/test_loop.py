"""The loop that ties a system and a controller together."""

import threading

import numpy as np
import pytest

import sidestep as ss
from sidestep import _core


def scene() -> tuple[ss.Robot, ss.GeometricSystem, ss.Obstacles]:
    robot = ss.Robot.named("planar3")
    links = [next(f.name for f in robot.frames if f.joint == j) for j in range(len(robot.joints))]
    body = _core.Body(
        links=links,
        weights=np.ones(len(links)),
        means=np.zeros((len(links), 3)),
        covariances=[np.diag([0.06, 0.05, 0.07]) ** 2] * len(links),
        levels=np.ones(len(links)),
    )
    tip = robot.pose(robot.neutral, links[-1])[:3, 3]
    return (
        robot,
        ss.GeometricSystem([ss.ClearanceBarrier(robot, body)]),
        ss.Obstacles([tip + np.array([0.0, 0.03, 0.0])]),
    )


def states(robot: ss.Robot, num: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(4)
    q = robot.neutral + rng.normal(scale=0.1, size=(num, robot.num_coordinates))
    return q, rng.normal(scale=0.3, size=q.shape)


def test_is_the_system_followed_by_the_controller() -> None:
    robot, system, obstacles = scene()
    goal = robot.neutral + 0.3
    loop = ss.Loop(system, ss.TorqueController(robot), goal=goal, obstacles=obstacles)
    controller = ss.TorqueController(robot)
    for q, v in zip(*states(robot, 20), strict=True):
        M, h = robot.mass_matrix(q), robot.bias(q, v)
        step = system.acceleration(q, v, goal, obstacles)
        expected = controller.solve(q, v, step.acceleration, M, h, clearances=step)
        found = loop.step(q, v, M, h)
        assert found.status == step.status
        assert found.solution.status == expected.status
        np.testing.assert_array_equal(found.torque, expected.torque)


def test_new_goals_and_obstacles_count_from_the_next_step_on() -> None:
    robot, system, obstacles = scene()
    q, v = states(robot, 1)
    M, h = robot.mass_matrix(q[0]), robot.bias(q[0], v[0])
    controller = ss.TorqueController(robot)
    loop = ss.Loop(system, controller, goal=robot.neutral, obstacles=ss.Obstacles.none())
    free = loop.step(q[0], v[0], M, h).torque
    loop.set_obstacles(obstacles)
    bent = loop.step(q[0], v[0], M, h).torque
    assert not np.allclose(free, bent)
    loop.set_goal(robot.neutral + 0.5)
    elsewhere = loop.step(q[0], v[0], M, h).torque
    fresh = ss.Loop(system, controller, goal=robot.neutral + 0.5, obstacles=obstacles)
    np.testing.assert_array_equal(elsewhere, fresh.step(q[0], v[0], M, h).torque)
    assert not np.allclose(elsewhere, bent)


def test_stops_safely_on_values_that_are_not_finite() -> None:
    robot, system, obstacles = scene()
    loop = ss.Loop(system, ss.TorqueController(robot), goal=robot.neutral, obstacles=obstacles)
    q, v = states(robot, 1)
    bad = np.full(robot.num_coordinates, np.nan)
    found = loop.step(bad, v[0], robot.mass_matrix(q[0]), robot.bias(q[0], v[0]))
    assert found.status == ss.StepStatus.invalid_state
    assert found.solution.status == ss.TorqueStatus.fallback_invalid_input
    assert np.all(np.abs(found.torque) <= robot.limits.effort)


def test_obstacles_may_be_replaced_while_steps_run() -> None:
    """Every step has seen one of the clouds that were set, whole."""
    robot, system, near = scene()
    goal = robot.neutral
    controller = ss.TorqueController(robot)
    q, v = (x[0] for x in states(robot, 1))
    M, h = robot.mass_matrix(q), robot.bias(q, v)
    clouds = [ss.Obstacles(near.points + np.array([0.0, 0.01 * k, 0.0])) for k in range(4)]
    allowed = [
        ss.Loop(system, controller, goal=goal, obstacles=cloud).step(q, v, M, h).torque for cloud in clouds
    ]
    loop = ss.Loop(system, controller, goal=goal, obstacles=clouds[0])
    done = threading.Event()

    def refresh() -> None:
        for k in range(2000):
            loop.set_obstacles(clouds[k % 4])
        done.set()

    writer = threading.Thread(target=refresh)
    writer.start()
    while not done.is_set():
        torque = loop.step(q, v, M, h).torque
        assert any(np.array_equal(torque, one) for one in allowed)
    writer.join()


def test_refuses_a_controller_of_another_robot() -> None:
    robot, system, obstacles = scene()
    other = ss.TorqueController(ss.Robot.named("planar2"))
    with pytest.raises(ValueError, match="the controller has 2 coordinates, the system 3"):
        ss.Loop(system, other, goal=robot.neutral, obstacles=obstacles)
