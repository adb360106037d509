"""The controller moves the FR3: poses among balls, orders from another thread, settings by name."""

import threading
import time

import numpy as np
import pytest

import sidestep as ss
from sidestep import _core

Fr3 = tuple[ss.Robot, ss.Arm]
TIP = "fr3_hand_tcp"


@pytest.fixture(scope="module")
def fr3() -> Fr3:
    robot = ss.Robot.named("fr3")
    return robot, ss.Arm.from_robot(robot)


def settings(**changes: object) -> ss.ControllerSettings:
    return ss.ControllerSettings(**{"synchronous": True, "output": "acceleration", **changes})


def pose_error(robot: ss.Robot, q: np.ndarray, pose: np.ndarray) -> tuple[float, float]:
    """Distance [m] and angle [rad] of the tip from a pose."""
    reached = robot.pose(q, TIP)
    cosine = (np.trace(pose[:3, :3].T @ reached[:3, :3]) - 1.0) / 2.0
    return float(np.linalg.norm(reached[:3, 3] - pose[:3, 3])), float(np.arccos(np.clip(cosine, -1.0, 1.0)))


def test_poses_among_balls_are_reached(fr3: Fr3) -> None:
    """Within 1 mm and half a degree in 15 s; 200 such goals are reached as often as the same configurations."""
    robot, arm = fr3
    probe = ss.Controller(arm, settings(planner=None, look_ahead=None))
    rng = np.random.default_rng(1)

    def free(q: np.ndarray, obstacles: ss.Obstacles) -> bool:
        probe.set_obstacles(obstacles)
        return probe.step(q, np.zeros(7)).clearance > 0.005

    for _ in range(5):
        while True:
            obstacles = ss.Obstacles(rng.uniform([-0.7, -0.7, 0.1], [0.7, 0.7, 1.0], (5, 3)), [0.06] * 5)
            goal = robot.random_configuration(rng)
            if free(robot.neutral, obstacles) and free(goal, obstacles):
                break
        pose = robot.pose(goal, TIP)
        controller = ss.Controller(arm, settings())
        controller.set_obstacles(obstacles)
        controller.set_goal(ss.PoseGoal(robot, TIP, pose))
        motion = _core.integrate(controller, robot.neutral, np.zeros(7), steps=15000)
        position, rotation = pose_error(robot, motion.last_q, pose)
        assert position < 1e-3
        assert rotation < np.radians(0.5)
        assert motion.activities[-1] == _core.Activity.arrived
        assert controller.explain() == "arrived"
        assert motion.clearance.min() > 0.0
        assert pose_error(robot, controller.target, pose)[0] < 1e-6


def test_goals_and_obstacles_come_from_another_thread_while_it_steps(fr3: Fr3) -> None:
    robot, arm = fr3
    controller = ss.Controller(arm, settings(synchronous=False, output="torque"))
    assert controller.has_torque
    rng = np.random.default_rng(2)
    done = threading.Event()

    def disturb() -> None:
        while not done.is_set():
            controller.set_goal(ss.PoseGoal(robot, TIP, robot.pose(robot.random_configuration(rng), TIP)))
            points, velocities = rng.uniform(0.5, 1.0, (3, 3)), rng.normal(0, 0.2, (3, 3))
            controller.set_obstacles(ss.Obstacles(points, [0.05] * 3, velocities))
            time.sleep(0.02)

    other = threading.Thread(target=disturb)
    other.start()
    q, v = robot.neutral.copy(), np.zeros(7)
    try:
        for _ in range(1000):
            command = controller.step(q, v)
            assert np.isfinite(command.torque).all()
            v += 1e-3 * command.acceleration
            q += 1e-3 * v
    finally:
        done.set()
        other.join()
    limits = robot.limits
    assert np.all((q >= limits.lower - 1e-9) & (q <= limits.upper + 1e-9))


def test_settings_are_refused_by_name(fr3: Fr3) -> None:
    _, arm = fr3
    with pytest.raises(ValueError, match=r"period is 0\.5 s, allowed: 0\.0001 to 0\.1 s"):
        settings(period=0.5)
    with pytest.raises(TypeError, match="has no setting 'perod'; it has: period, "):
        settings(perod=0.001)
    changed = settings()
    changed.barriers.activation = -1.0
    with pytest.raises(ValueError, match=r"barriers\.activation is -1 m"):
        ss.Controller(arm, changed)
