"""When an arm has to stand after a sensor failed, and contacts after that."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from sidestep.bench import Encounter, EncounterJudge
from sidestep.bench.encounters import Course, load_with_meshes
from sidestep.bench.motion import Motion
from sidestep.bench.sensor_fault import SensorFault, first_word
from sidestep.distance import SceneObject
from sidestep.robot import Robot

STEPS = 600


@cache
def robot() -> Robot:
    return load_with_meshes("fr3")[1]


@cache
def judge() -> EncounterJudge:
    return EncounterJudge(robot())


def turning(speed: float) -> tuple[Motion, SceneObject]:
    """An arm that turns its first joint to where a ball stands in 0.6 s, at 1 rad/s, and goes on at a speed."""
    q = np.tile(robot().neutral, (STEPS, 1))
    q[:, 0] += 1e-3 * np.arange(STEPS)
    ball = SceneObject.ball("ball", robot().pose(q[-1], "fr3_hand")[:3, 3], radius=0.05, motion="moving")
    poses = np.tile(np.r_[ball.pose[:3, 3], 1.0, 0.0, 0.0, 0.0], (2 * STEPS, 1, 1))
    q = np.vstack([q, q[-1] + 1e-3 * speed * np.arange(STEPS)[:, None] * np.eye(7)[0]])
    v = np.zeros_like(q)
    v[:STEPS, 0], v[STEPS:, 0] = 1.0, speed
    motion = Motion(q, v, np.zeros_like(q), poses, None, 0, False, np.zeros(len(q)))
    return motion, ball


def test_the_time_to_stop_is_that_of_the_slowest_joint() -> None:
    motion, _ = turning(0.0)
    limits, fault = robot().limits, SensorFault(0.1, math.inf, 0.2)
    braking = 1.0 / limits.acceleration[0] + limits.acceleration[0] / limits.jerk[0]
    assert fault.stopped_by(motion, limits, 1e-3) == pytest.approx(0.3 + braking)
    at_rest = replace(motion, v=0.0 * motion.v)
    assert fault.stopped_by(at_rest, limits, 1e-3) == pytest.approx(
        0.3 + (limits.acceleration / limits.jerk).max()
    )
    assert [fault.is_on(time) for time in (0.1, 0.101, 5.0)] == [False, True, True]
    assert not SensorFault(0.1, 1.1, 0.2).is_on(1.1)


@pytest.mark.parametrize(
    ("begins", "ends", "speed", "late"),
    [
        (0.1, math.inf, 0.0, 1.0),  # it has to stand at 0.402 s, and is still on its way when it touches
        (0.55, math.inf, 0.0, None),  # it stands before that
        (0.55, math.inf, 0.04, None),  # it creeps
        (0.55, math.inf, 0.3, 0.3),  # it goes on
        (0.55, 0.7, 0.3, None),  # data came again before
    ],
)
def test_contacts_count_after_the_arm_has_to_stand(
    begins: float, ends: float, speed: float, late: float | None
) -> None:
    motion, ball = turning(speed)
    fault = SensorFault(begins, ends, 0.2)
    encounter = Encounter(0, motion.q[0], len(motion.q), (ball,), lambda *_: None, fault=fault)
    statuses = ("ok",) * 800 + ("stale",) * 400
    verdict = judge().judge(encounter, Course(motion, statuses, explained="it waits"))
    assert verdict.contact_s is not None
    assert verdict.contact_after_fault_s == pytest.approx(verdict.contact_s - begins)
    assert verdict.contact_speed == pytest.approx(1.0)
    assert verdict.late_contact_speed == (late and pytest.approx(late))
    assert (verdict.said, verdict.said_after_fault_s) == ("stale", pytest.approx(0.8 - begins))
    assert verdict.explained == "it waits"


def test_usual_statuses_say_nothing() -> None:
    assert first_word(("stale", "ok", "limited"), 1) is None
    assert first_word(("ok", "stale", "limited", "stopping"), 2) == (3, "stopping")
