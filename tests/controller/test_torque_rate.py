"""The torque's rate is kept whatever is measured, also where clearances are lost and in stops."""

from __future__ import annotations

import numpy as np
import pytest

import sidestep as ss

PERIOD = 0.001
LAST_LINK = {"fr3": "fr3_rightfinger", "panda": "panda_rightfinger"}


@pytest.mark.parametrize("order", [[2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [2.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0]])
@pytest.mark.parametrize("angle", [0.6, 1.0])
def test_an_arm_that_is_driven_at_a_ball_brakes_within_the_rate(order: list[float], angle: float) -> None:
    """At one of the four the torque once changed 25 times as fast as it may: the row began to brake too late."""
    arm = ss.Arm.load("fr3")
    tip = arm.robot.pose(arm.neutral, "fr3_hand_tcp")[:3, 3]
    c, s = np.cos(angle), np.sin(angle)
    ball = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ tip
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True))
    controller.set_obstacles(ss.Obstacles([ball], radii=0.06))
    q, v = arm.neutral.copy(), np.zeros(arm.num_coordinates)
    torques, least, fastest = [], np.inf, 0.0
    for _ in range(1500):
        controller.set_velocity(order)
        command = controller.step(q, v)
        torques.append(command.torque.copy())
        least = min(least, command.clearance)
        v = v + PERIOD * np.linalg.solve(arm.mass_matrix(q), command.torque - arm.bias(q, v))
        q = q + PERIOD * v
        fastest = max(fastest, v[0])
    rate = np.abs(np.diff(torques, axis=0)) / PERIOD
    assert (rate <= arm.limits.effort_rate * (1.0 + 1e-9)).all()
    assert fastest > 1.0  # [rad/s] before it braked
    assert 0.0045 < least < 0.015  # [m] the margin is 0.005


def torques(name: str, settings: ss.ControllerSettings, seed: int, steps: int, lost: bool) -> np.ndarray:
    """What is sent where one sample in thirty is wrong in position or velocity, is not finite, or follows a blow."""
    rng = np.random.default_rng(seed)
    arm = ss.Arm.load(name)
    limits, nv = arm.limits, arm.num_coordinates
    controller = ss.Controller(arm, settings)
    tip = arm.robot.pose(arm.neutral, LAST_LINK[name])[:3, 3]
    around = ss.Obstacles(tip + rng.normal(size=(8, 3)) * 0.15, radii=0.06)
    controller.set_obstacles(around if lost else ss.Obstacles.none())
    middle = (limits.lower + limits.upper) / 2
    controller.set_goal(middle + 0.7 * (rng.uniform(limits.lower, limits.upper) - middle))
    q, v, sent = arm.neutral.copy(), np.zeros(nv), []
    for _ in range(steps):
        at, speed = q.copy(), v.copy()
        if rng.random() < 1 / 30:
            joint, fault = rng.integers(nv), rng.integers(6)
            if fault == 0:
                at[joint] += rng.choice([-1, 1]) * rng.choice([0.01, 0.02, 0.05, 0.1, 0.19, 0.3, 1.0])
            elif fault == 1:
                speed[joint] += rng.choice([-1, 1]) * rng.choice([0.3, 1.0, 3.0, 10.0])
            elif fault == 2:
                at[joint] = np.nan
            elif fault == 3:
                at += 0.3 * rng.normal(size=nv)
            elif fault == 4:
                controller.restart()
            else:
                q, v = np.clip(q + 0.1 * rng.normal(size=nv), limits.lower, limits.upper), np.zeros(nv)
                at, speed = q.copy(), v.copy()
        command = controller.step(at, speed)
        assert (np.abs(command.torque) <= limits.effort).all()
        sent.append(command.torque)
        v = np.clip(
            v + PERIOD * np.linalg.solve(arm.mass_matrix(q), command.torque - arm.bias(q, v)),
            -2 * limits.velocity,
            2 * limits.velocity,
        )
        q = q + PERIOD * v
        v[(q < limits.lower) | (q > limits.upper)] = 0.0  # a stop
        q = np.clip(q, limits.lower, limits.upper)
    return np.array(sent)


@pytest.mark.parametrize("name", ["fr3", "panda"])
@pytest.mark.parametrize("stiffness", [0.0, 0.5])
@pytest.mark.parametrize("lost", [False, True])
def test_torque_keeps_its_rate_whatever_is_measured(name: str, stiffness: float, lost: bool) -> None:
    """Up to 159 times the rate before: where windows did not meet, a clearance was lost, or a state was not finite."""
    arm = ss.Arm.load(name)
    settings = ss.ControllerSettings(synchronous=True)
    settings.tracking.stiffness = stiffness
    for seed in range(4):
        rate = np.abs(np.diff(torques(name, settings, seed, 400, lost), axis=0)) / PERIOD
        assert (rate <= arm.limits.effort_rate * (1.0 + 1e-6)).all()  # 1e-6: rounding of the differences


@pytest.mark.parametrize("joint", range(7))
@pytest.mark.parametrize("by", [0.05, 0.19, 0.3, 1.0])
def test_one_outlier_in_position_keeps_the_rate(joint: int, by: float) -> None:
    arm = ss.Arm.load("fr3")
    rng = np.random.default_rng(joint)
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True))
    controller.set_obstacles(ss.Obstacles.none())
    limits, middle = arm.limits, (arm.limits.lower + arm.limits.upper) / 2
    controller.set_goal(middle + 0.7 * (rng.uniform(limits.lower, limits.upper) - middle))
    q, v, sent = arm.neutral, np.zeros(7), []
    for k in range(400):
        wrong = by * (np.arange(7) == joint) if k == 350 else np.zeros(7)
        command = controller.step(np.where(q + wrong > limits.upper, q - wrong, q + wrong), v)
        sent.append(command.torque)
        v = v + PERIOD * np.linalg.solve(arm.mass_matrix(q), command.torque - arm.bias(q, v))
        q = q + PERIOD * v
    rate = np.abs(np.diff(sent, axis=0)) / PERIOD
    assert (rate <= limits.effort_rate * (1.0 + 1e-6)).all()  # 1e-6: rounding of the differences


def test_without_a_mass_matrix_the_stop_keeps_the_rate() -> None:
    arm = ss.Arm.load("fr3")
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True))
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(arm.neutral + 0.3)
    q, v, sent = arm.neutral, np.zeros(7), []
    for k in range(400):
        mass = arm.mass_matrix(q) * (np.nan if 200 <= k < 220 else 1.0)
        command = controller.step(q, v, mass, arm.bias(q, v))
        assert (command.status == ss.SafetyStatus.stopping) == (200 <= k < 220)
        sent.append(command.torque)
        v = v + PERIOD * np.linalg.solve(arm.mass_matrix(q), command.torque - arm.bias(q, v))
        q = q + PERIOD * v
    rate = np.abs(np.diff(sent, axis=0)) / PERIOD
    assert (rate <= arm.limits.effort_rate * (1.0 + 1e-6)).all()  # 1e-6: rounding of the differences


@pytest.mark.parametrize("mass", [3.0, 6.0, 12.0])
def test_no_torque_limit_breaks_where_gravity_takes_more_than_there_is(mass):
    """A payload that the fr3 cannot hold: what the model says has held the arm until now is more than its limits."""
    arm = ss.Arm.load("fr3")
    controller = ss.Controller(arm, ss.ControllerSettings(output="torque", synchronous=True, look_ahead=None))
    controller.set_obstacles(ss.Obstacles.none())
    controller.attach(
        "load", ss.Sphere(0.04), link="fr3_hand", pose=ss.obstacles.pose_at([0.0, 0.0, 0.1]), mass=mass
    )
    limits, q, torques = arm.limits, arm.neutral, []
    for _ in range(50):
        torques.append(controller.step(q, 0.0 * q).torque)
    torques = np.array(torques)
    assert np.abs(torques / limits.effort).max() <= 1.0 + 1e-9  # rounding
    assert np.abs(np.diff(torques, axis=0) / 1e-3 / limits.effort_rate).max() <= 1.0 + 1e-6
