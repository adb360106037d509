"""Cartesian speed by the distance to obstacles, of the whole controller."""

from dataclasses import dataclass

import numpy as np
import pytest

import sidestep as ss
from sidestep.controller import SpeedLimitSettings

PERIOD = 0.001
GOAL = np.array([1.2, 0.5, 0.0, -1.6, 0.0, 2.1, 0.8])


@pytest.fixture(scope="module")
def fr3() -> ss.Arm:
    return ss.Arm.load("fr3_arm")


@dataclass(frozen=True)
class Motion:
    """Largest speed over its limit and largest speed [m/s], least clearance [m], seconds, steps relaxed, words."""

    excess: float
    fastest: float
    clearance: float
    seconds: float
    relaxed: int
    words: set[str]


def allowed(limits: SpeedLimitSettings, distance: float) -> float:
    share = (distance - limits.near_distance) / (limits.far_distance - limits.near_distance)
    between = limits.far_speed**2 - limits.near_speed**2
    return float(np.sqrt(limits.near_speed**2 + np.clip(share, 0.0, 1.0) * between))


def move(arm: ss.Arm, speed_limits: SpeedLimitSettings | None = None) -> Motion:
    """From one side of a ball named person to the other, with every part of the controller."""
    robot, limits = arm.robot, SpeedLimitSettings()
    controller = ss.Controller(
        arm, ss.ControllerSettings(synchronous=True, output="acceleration", speed_limits=speed_limits)
    )
    q, v = np.array([-1.2, 0.5, 0.0, -1.6, 0.0, 2.1, 0.8]), np.zeros(7)
    controller.set_obstacles(ss.Obstacles([[0.75, 0.0, 0.5]], [0.05]).named(["person"], [1]))
    controller.set_goal(GOAL)
    excess, fastest, clearance, relaxed, words = -np.inf, 0.0, np.inf, 0, set()
    for step in range(15_000):
        command = controller.step(q, v)
        tip = np.linalg.norm(robot.jacobian(q, "fr3_link8")[:3] @ v)
        assert tip <= command.speed + 1e-12
        if np.isfinite(command.speed_limit):
            assert command.speed_limit == pytest.approx(allowed(limits, command.distance), abs=1e-12)
            excess = max(excess, command.speed - command.speed_limit)
        fastest = max(fastest, command.speed)
        clearance = min(clearance, command.clearance)
        relaxed += command.status == ss.SafetyStatus.relaxed
        if step % 100 == 0:
            words.add(controller.explain())
        if command.activity == ss.Activity.arrived:
            break
        v = v + PERIOD * command.acceleration
        q = q + PERIOD * v
    assert command.activity == ss.Activity.arrived
    return Motion(excess, fastest, clearance, step * PERIOD, relaxed, words)


def test_the_fr3_is_slow_near_a_person_and_arrives(fr3: ss.Arm) -> None:
    free, limited = move(fr3), move(fr3, SpeedLimitSettings())
    assert free.fastest > 1.5
    assert free.excess == -np.inf
    assert limited.excess <= 0.0
    assert limited.fastest < 1.2
    assert (free.relaxed, limited.relaxed) == (0, 0)
    assert free.seconds < limited.seconds < 4.5
    assert limited.clearance > 0.5 * free.clearance  # the reference on the path waits: no corner is cut
    assert any("may move at 0.25 m/s, 0.0" in words and "m from 'person'" in words for words in limited.words)
    assert not any("speed limit" in words for words in free.words)


def test_limits_that_do_not_go_together_are_refused_by_name() -> None:
    with pytest.raises(
        ValueError, match=r"speed_limits: near_speed is 2\.0*, must be no more than far_speed"
    ):
        ss.ControllerSettings(speed_limits=SpeedLimitSettings(near_speed=2.0)).validate()
    with pytest.raises(ValueError, match=r"near_speed is 0 m/s, allowed: 0\.02 to 10 m/s"):
        SpeedLimitSettings(near_speed=0.0)
