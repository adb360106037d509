"""Steps beyond limits are counted with the worst of them, and told apart by what is near."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from sidestep.bench.encounters import load_with_meshes
from sidestep.bench.limits_broken import FREE, LOOK_EVERY, count, excesses, in_free_space
from sidestep.bench.motion import Motion
from sidestep.distance import ExactClearance, SceneObject
from sidestep.robot import Robot


@cache
def robot() -> Robot:
    return load_with_meshes("fr3")[1]


def motion_of(q: np.ndarray, v: np.ndarray, a: np.ndarray, torque: np.ndarray | None = None) -> Motion:
    return Motion(q, v, a, np.zeros((len(q), 0, 7)), torque, 0, False, np.zeros(len(q)))


def test_steps_beyond_limits_are_counted_with_the_worst_ratio() -> None:
    limits = robot().limits
    all_of_them = np.ones(5, dtype=bool)
    still = np.tile(robot().neutral, (5, 1))
    v, a = np.zeros((5, 7)), np.zeros((5, 7))
    kept = excesses(motion_of(still, v, a), limits, period=1e-3, commanded=still)
    assert set(kept) == {"position", "commanded position", "velocity", "acceleration", "jerk"}
    assert count(kept, where=all_of_them) == {}
    v[2, 1], v[3, 1] = 1.5 * limits.velocity[1], 1.1 * limits.velocity[1]
    q = still.copy()
    q[4, 0] = limits.upper[0] + 0.2
    commanded = still.copy()
    commanded[0] = np.nan  # before a state was known
    commanded[1, 0] = limits.lower[0] - 0.1
    torque = np.zeros((5, 7))
    torque[1:, 3] = 2.0 * limits.effort_rate[3] * 1e-3
    found = excesses(motion_of(q, v, a, torque), limits, period=1e-3, commanded=commanded)
    broken = count(found, where=all_of_them)
    assert broken["velocity"] == (2, pytest.approx(1.5, rel=1e-3))
    assert broken["position"] == (1, pytest.approx(0.2, abs=1e-6))
    assert broken["commanded position"] == (1, pytest.approx(0.1, abs=1e-6))
    assert broken["torque rate"] == (1, pytest.approx(2.0, rel=1e-3))
    assert set(broken) == {"velocity", "position", "commanded position", "torque rate"}
    np.testing.assert_array_equal(np.flatnonzero(found["torque rate"]), [1])
    before = np.arange(5) < 3
    assert count(found, where=before)["velocity"] == (1, pytest.approx(1.5, rel=1e-3))
    assert "position" not in count(found, where=before)


def test_changes_are_over_the_period_of_the_calls() -> None:
    limits = robot().limits
    still, none = np.tile(robot().neutral, (9, 1)), np.zeros((9, 7))
    torque = none.copy()
    torque[8:, 3] = 2.0 * limits.effort_rate[3] * 1e-3
    motion = motion_of(still, none, none, torque)
    assert excesses(motion, limits, period=1e-3)["torque rate"].max() == pytest.approx(2.0)
    assert excesses(motion, limits, period=8e-3)["torque rate"].max() == 0.0


def test_free_space_is_away_from_everything() -> None:
    """A ball that comes nearer to an arm at rest: free as long as it is 10 cm away."""
    arm, steps = robot(), 300
    hand = arm.pose(arm.neutral, "fr3_hand")[:3, 3]
    speed = np.array([-1.0, 0.0, 0.0])
    begin = hand + np.array([0.5, 0.0, 0.0])
    ball = SceneObject.ball("ball", begin, radius=0.05, motion="moving", velocity=speed.tolist())
    poses = np.tile(np.r_[begin, 1.0, 0.0, 0.0, 0.0], (steps, 1, 1))
    poses[:, 0, :3] += 1e-3 * np.arange(steps)[:, None] * speed
    q = np.tile(arm.neutral, (steps, 1))
    motion = Motion(q, 0.0 * q, 0.0 * q, poses, None, 0, False, np.zeros(steps))
    exact = ExactClearance(arm, [ball])
    chosen = np.ones(steps, dtype=bool)
    chosen[5] = False
    free = in_free_space(exact, motion, chosen)
    assert free[0]
    assert not free[5]
    assert not free[-1]
    last = int(np.flatnonzero(free)[-1])
    assert exact.distance(q[last], poses[last]).distance == pytest.approx(FREE, abs=1e-3 * LOOK_EVERY)
