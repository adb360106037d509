"""Whether an arm that something ran into could have got out of its way."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sidestep.bench.motion import Motion
from sidestep.bench.problem import Problem, between_jumps, poses_over
from sidestep.distance import ExactClearance, SceneObject, SelfCollision
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]

POSTURES = 2000  # random, of which one would have to be free
AROUND = 1.0  # [s] before and after the deepest contact at which postures are looked at
LOOK = 0.05  # [s] between the moments looked at
DEPARTURES = (0.3, 1.0, 2.0)  # [s] before the first contact, but not before what was touched is there
TARGETS = 100  # random postures to go for from each
AFTER = 1.0  # [s] after the deepest contact until which a motion has to stay free
TOLERANCE = 1e-3  # [m] of the clearance of a motion


@dataclass(frozen=True)
class WayOut:
    """What a search for a way out found.

    Attributes:
        found: a motion within the limits that touches nothing.
        sentence: how it is known, or how it was looked for.
    """

    found: bool
    sentence: str


def find_way_out(
    problem: Problem,
    motion: Motion,
    touched: SceneObject,
    deepest: float,
    *,
    period: float,
    clearance: ExactClearance,
    self_collision: SelfCollision,
) -> WayOut:
    """Looks for a way out of a collision, in two ways; both are searches by samples.

    First for a moment, within 1 s of the deepest contact, at which all of 2,000 random postures touch what was
    touched: then there is none. Else for a motion from where the arm was 0.3, 1 or 2 s before it was touched, but not
    before what was touched is there, to one of 100 random postures, each joint as fast as its velocity and acceleration
    limits allow, that touches nothing and not itself until 1 s after the deepest contact.

    Args:
        problem, motion: that go together. touched: what was. deepest: when it was so deepest [s].
        period: of its samples [s]. clearance, self_collision: of the robot; the former's objects do not matter.
    """
    robot, name = clearance.robot, touched.name
    rng = np.random.default_rng(problem.index)
    postures = np.array([robot.random_configuration(rng) for _ in range(POSTURES)])
    alone, whole = clearance.among([touched]), clearance.among(problem.objects)
    moments: Array = np.arange(max(0.0, deepest - AROUND), deepest + AROUND, LOOK, dtype=np.float64)
    for time in moments[np.argsort(np.abs(moments - deepest))]:
        pose = poses_over([touched], np.array([time]))[0]
        if all(alone.distance(q, pose).distance <= 0.0 for q in postures):
            return WayOut(False, f"no way out: all of {POSTURES} postures touch {name} at {time:.2f} s")
    there = math.ceil(touched.present[0] / period)
    first = max(there, _first_contact(whole, motion, round(deepest / period), round(LOOK / period)))
    begins = sorted({max(there, first - round(before / period)) for before in DEPARTURES}, reverse=True)
    for begin in begins:
        steps = round((deepest + AFTER) / period) - begin
        times: Array = period * np.arange(begin, begin + steps, dtype=np.float64)
        poses = poses_over(problem.objects, times)
        for target in rng.permutation(postures)[:TARGETS]:
            way = _fastest(robot, motion.q[begin], motion.v[begin], target, period, steps)
            if way is not None and _is_free(whole, self_collision, way, poses, round(LOOK / period)):
                return WayOut(True, f"there was a way out {period * (first - begin):.1f} s before")
    tried, earliest = len(begins) * TARGETS, period * (first - begins[-1])
    return WayOut(False, f"none of {tried} motions from up to {earliest:.1f} s before gets out of the way")


def _first_contact(clearance: ExactClearance, motion: Motion, deepest: int, stride: int) -> int:
    """The sample at which the contact of a sample begins, to within a stride."""
    at = min(deepest, len(motion.q) - 1)
    while at > 0 and clearance.distance(motion.q[at], motion.object_poses[at]).distance <= 0.0:
        at = max(0, at - stride)
    return at


def _fastest(robot: Robot, q: Array, v: Array, target: Array, period: float, steps: int) -> Array | None:
    """To rest at a target (T, nv), each joint as fast as its limits allow; None where that leaves position limits."""
    limits = robot.limits
    way = np.empty((steps, q.size))
    q, v = q.copy(), v.copy()
    for k in range(steps):
        way[k] = q
        left = target - q
        # The speed from which it can stop there, a step ahead.
        wanted = np.sign(left) * np.minimum(
            np.sqrt(1.8 * limits.acceleration * np.abs(left)), limits.velocity
        )
        a = np.clip((wanted - v) / period, -limits.acceleration, limits.acceleration)
        q = q + period * v + 0.5 * period**2 * a
        v = v + period * a
    inside = (way >= limits.lower) & (way <= limits.upper)
    return way if inside.all() else None


def _is_free(
    clearance: ExactClearance, self_collision: SelfCollision, way: Array, poses: Array, stride: int
) -> bool:
    for k in range(len(way) - 1, -1, -stride):  # quickly, from where it has to be free at last
        if clearance.distance(way[k], poses[k]).distance <= 0.0 or self_collision.touching(way[k]):
            return False
    for begin, end in between_jumps(poses):
        if (
            clearance.decided_minimum(way[begin:end], poses[begin:end], tolerance=TOLERANCE).lower_bound
            <= 0.0
        ):
            return False
    return self_collision.minimum_over(way, tolerance=TOLERANCE).distance > 0.0
