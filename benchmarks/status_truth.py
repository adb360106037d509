"""Whether a Controller's status ever hides an ellipsoid that is inside an obstacle.

    python benchmarks/status_truth.py --steps 1000000 [--jobs 2] [--json FILE]

Motions of 200 steps in random scenes that are as hard as they come: balls that hold whole links, points on the arm,
dense clouds, things that move, appear on the arm and jump; starts in contact, at and beyond limits; pushes; goals
that are reachable, out of reach, not finite, beyond limits, inside obstacles; torque and acceleration; with and
without planner. After each step the gap between every ellipsoid of the cover and every ball is computed in NumPy,
by the nearest point of an ellipsoid (bisection of the secular equation), from forward kinematics alone: nothing of
the controller's own clearances. Where an ellipsoid is inside a ball by more than `DEPTH`, the status must be
`clearance_lost`, and the clearance negative. Exit code 0 if it always is.
"""

from __future__ import annotations

import argparse
import collections
import json
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import cache

import numpy as np

import sidestep as ss

ROBOTS = ("fr3", "ur10", "iiwa", "xarm7", "panda")
STEPS = 200  # of one motion
DEPTH = 1e-6  # [m] of overlap that counts
ITERATIONS = 60  # of the bisection: to the last digit


class Judge:
    """Gaps between the ellipsoids of a cover and balls."""

    def __init__(self, name: str) -> None:
        self.robot = ss.Robot.named(name)
        self.arm = ss.Arm.load(name)
        body = ss.Body.cover(self.robot)
        moves = {frame.name: frame.joint >= 0 for frame in self.robot.frames}
        self.ellipsoids = []
        for link, mean, covariance, level in zip(
            body.links, body.means, body.covariances, body.levels, strict=True
        ):
            if moves[link]:
                variances, axes = np.linalg.eigh(covariance)
                self.ellipsoids.append((link, mean, axes, np.sqrt(level * variances)))

    def least_gap(self, q: np.ndarray, centers: np.ndarray, radii: np.ndarray) -> float:
        """The least gap [m]; anything below -DEPTH is inside. Pairs that are clearly apart count as a lower bound."""
        least = np.inf
        if not len(centers):
            return least
        poses = {link: self.robot.pose(q, link) for link, *_ in self.ellipsoids}
        points, axes, reach = [], [], []
        for link, mean, turn, a in self.ellipsoids:
            X = poses[link]
            local = (centers - X[:3, 3]) @ X[:3, :3] - mean
            apart = np.linalg.norm(local, axis=1) - a.max() - radii
            near = apart <= 0.0
            if not near.all():
                least = min(least, float(apart[~near].min()))
            points.append(local[near] @ turn)
            axes.append(np.broadcast_to(a, (int(near.sum()), 3)))
            reach.append(radii[near])
        x, a, r = np.concatenate(points), np.concatenate(axes), np.concatenate(reach)
        return min(least, float(np.min(distances(x, a) - r, initial=np.inf)))


def distances(x: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Distance [m] of points x (N, 3) from ellipsoids with semi-axes a (N, 3); 0 inside.

    The nearest point is a^2 x/(t + a^2) with t >= 0 the root of sum (a x/(t + a^2))^2 = 1 (Eberly 2013).
    """
    outside = np.sum((x / a) ** 2, axis=1) > 1.0
    low, high = np.zeros(len(x)), np.linalg.norm(a * x, axis=1)
    for _ in range(ITERATIONS):
        t = 0.5 * (low + high)
        beyond = np.sum((a * x / (t[:, None] + a**2)) ** 2, axis=1) > 1.0
        low, high = np.where(beyond, t, low), np.where(beyond, high, t)
    t = 0.5 * (low + high)[:, None]
    return np.where(outside, np.linalg.norm(x * t / (t + a**2), axis=1), 0.0)


judge = cache(Judge)


def scene(rng: np.random.Generator, judge: Judge, q: np.ndarray) -> tuple[np.ndarray, ...]:
    """Centres, radii and velocities of what is around, near what matters: the links."""
    links = [link for link, *_ in judge.ellipsoids]
    count = int(rng.choice([0, 1, 1, 3, 10, 100]))
    places = np.array([judge.robot.pose(q, rng.choice(links))[:3, 3] for _ in range(count)]).reshape(-1, 3)
    spread = rng.choice([0.02, 0.1, 0.3, 0.6])
    centers = places + spread * rng.normal(size=(count, 3))
    radii = rng.choice([0.0, 0.01, 0.05, 0.1, 0.4]) * rng.uniform(0.5, 1.0, size=count)
    velocities = rng.choice([0.0, 0.0, 0.5, 2.0]) * rng.normal(size=(count, 3))
    return centers, radii, velocities


def goal(rng: np.random.Generator, robot: ss.Robot) -> object:
    lower, upper = robot.limits.lower, robot.limits.upper
    q = robot.random_configuration(rng)
    kind = rng.choice(["joint", "beyond", "nan", "pose", "far pose", "moving", "none"])
    if kind == "joint":
        return q
    if kind == "beyond":
        return np.nextafter(np.where(np.isfinite(upper), upper, q), np.inf)
    if kind == "nan":
        return np.where(np.arange(len(q)) == 0, np.nan, q)
    if kind == "moving":
        return ss.JointGoal(np.clip(q, lower, upper), velocity=rng.normal(size=len(q)))
    if kind == "none":
        return None
    from sidestep.robot import tip_of

    pose = robot.pose(q, tip_of(robot))
    if kind == "far pose":
        pose[:3, 3] *= 3.0
    return ss.PoseGoal(robot, tip_of(robot), pose)


def run(task: tuple[str, int]) -> collections.Counter[str]:
    """One motion; what it counted."""
    name, seed = task
    here, rng = judge(name), np.random.default_rng((17, seed))
    robot, counts = here.robot, collections.Counter[str]()
    limits = robot.limits
    planner = {} if rng.random() < 0.1 else {"planner": None}
    settings = ss.ControllerSettings(
        synchronous=True, seed=seed, output=str(rng.choice(["torque", "acceleration"])), **planner
    )
    controller = ss.Controller(here.arm, settings)
    period = settings.period
    q = robot.random_configuration(rng)
    if rng.random() < 0.1:
        q = q + 0.1 * rng.normal(size=len(q))  # perhaps beyond a limit
    v = rng.choice([0.0, 0.0, 1.0]) * rng.uniform(-1.0, 1.0, size=len(q)) * limits.velocity
    centers, radii, velocities = scene(rng, here, q)
    controller.set_obstacles(
        ss.Obstacles(centers, radii, velocities) if len(centers) else ss.Obstacles.none()
    )
    since = 0
    for k in range(STEPS):
        if k == 0 or rng.random() < 0.01:
            try:
                asked = goal(rng, robot)
                controller.clear_goal() if asked is None else controller.set_goal(asked)
            except ValueError:
                counts["goals refused"] += 1
        if k and rng.random() < 0.01:
            centers, radii, velocities = scene(rng, here, q)
            controller.set_obstacles(
                ss.Obstacles(centers, radii, velocities) if len(centers) else ss.Obstacles.none()
            )
            since = k
        if rng.random() < 0.005:
            v = v + rng.normal(size=len(q))  # a push
        command = controller.step(q, v)
        gap = here.least_gap(q, centers + (k - since) * period * velocities, radii)
        counts["steps"] += 1
        counts[f"status {command.status.name}"] += 1
        if gap < -DEPTH:
            counts["penetrated"] += 1
            if command.status != ss.SafetyStatus.clearance_lost or not command.clearance < 0.0:
                counts["hidden"] += 1
                counts[f"hidden by {command.status.name}"] += 1
                print(
                    f"hidden: {name} seed {seed} step {k}: gap {gap:.6f} m, {command.status.name}, "
                    f"clearance {command.clearance:.6f} m",
                    file=sys.stderr,
                )
        v = v + period * command.acceleration
        q = q + period * v
    return counts


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--steps", type=int, default=1_000_000)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--json")
    arguments = parser.parse_args()
    tasks = [(ROBOTS[k % len(ROBOTS)], k) for k in range(-(-arguments.steps // STEPS))]
    total = collections.Counter[str]()
    with ProcessPoolExecutor(arguments.jobs) as pool:
        for done, counts in enumerate(pool.map(run, tasks, chunksize=10), 1):
            total += counts
            if done % 500 == 0:
                print(
                    f"{done} of {len(tasks)} motions, {total['hidden']} hidden", file=sys.stderr, flush=True
                )
    document = {"version": ss.__version__, "hidden": 0, **dict(sorted(total.items()))}
    print(json.dumps(document, indent=1))
    if arguments.json:
        with open(arguments.json, "w", encoding="utf-8") as file:
            json.dump(document, file, indent=1)
    return 1 if total["hidden"] else 0


if __name__ == "__main__":
    sys.exit(main())
