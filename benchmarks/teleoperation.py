"""Teleoperation by twists, random and adversarial, among obstacles: contacts, and how well free twists are followed.

    python benchmarks/teleoperation.py [--robots fr3 ur10 xarm7] [--minutes 10] [--jobs 2] [--json FILE]

Each minute has a scene, a start and a stream of twists of its own, told at 50 Hz through `Controller.set_twist(frame,
twist)`: the velocity of the tip's origin and its angular velocity in the world, as in `Robot.jacobian`. Minutes take
turns:
    random: a twist of up to 0.3 m/s and 1 rad/s for 1 to 3 s, then another;
    chase: straight at the nearest ball, with 0.3 m/s;
    flip: a random twist whose sign changes at 5 Hz;
    outward: away from the shoulder, beyond reach and through singularities.
In each of them no twist comes for the last second of every ten: the arm must stop. The arm is a plant of `plant.py`
that is as its model says, under torque; scenes are those of `sidestep bench reach`.

Contacts are of exact meshes between samples. A sample counts as free where the twist has been the same for 0.5 s, the
nearest ball is farther than 0.15 m and the arm from itself than 0.01 m (exact; links next to each other are always
near), joints are farther than 0.2 rad from limits, the smallest singular value of the Jacobian is over 0.05, and
following takes at most 0.8 of velocity limits. There the error is |J v - twist| / |twist|.

Exit code 1 where an arm touched something, or where the median error of free twists is over 5 %, or none was free.
"""

from __future__ import annotations

import argparse
import json
import sys
from functools import cache, partial
from typing import Any

import numpy as np
from plant import SAMPLE, Plant, SimulatedArm

import sidestep as ss
from sidestep.bench.parallel import run_tasks
from sidestep.bench.problems import ProblemGenerator, ProblemSettings, ReachProblem
from sidestep.distance import ExactClearance, SelfCollision
from sidestep.robot import tip_of

ROBOTS = ("fr3", "ur10", "xarm7")
KINDS = ("random", "chase", "flip", "outward")
TICK = 0.02  # [s] between twists
LINEAR, ANGULAR = 0.3, 1.0  # [m/s] and [rad/s] at most
SILENCE = 9.0, 10.0  # [s] of every ten in which no twist comes
SETTLED = 0.5  # [s] for which a twist has been the same
TOLERATED = 0.05  # median error of free twists
FREE_CLEARANCE, FREE_SELF, FREE_LIMIT = 0.15, 0.01, 0.2  # [m], [m], [rad] from which a twist is free
FREE_SINGULAR, FREE_SPEED = 0.05, 0.8  # smallest singular value; share of velocity limits


class Operator:
    """Tells twists (6,) from the measured state, one a tick; None: nothing is told."""

    def __init__(self, kind: str, bench: Bench, problem: ReachProblem, rng: np.random.Generator) -> None:
        self.kind, self.bench, self.rng = kind, bench, rng
        self.exact = bench.clearance.among(problem.objects)
        self.twist, self.until = np.zeros(6), 0.0

    def __call__(self, time: float, q: np.ndarray) -> np.ndarray | None:
        if SILENCE[0] <= time % SILENCE[1]:
            return None
        if self.kind == "chase":
            near = self.exact.distance(q)
            self.twist = np.concatenate([unit(near.point_on_obstacle - near.point_on_link), np.zeros(3)])
            self.twist *= LINEAR
        elif self.kind == "outward":
            tip = self.bench.robot.pose(q, self.bench.tip)[:3, 3]
            self.twist = np.concatenate([LINEAR * unit(tip - self.bench.shoulder), np.zeros(3)])
        elif time >= self.until:
            linear, angular = unit(self.rng.normal(size=3)), unit(self.rng.normal(size=3))
            self.twist = np.concatenate(
                [
                    self.rng.uniform(0.0, LINEAR) * linear,
                    self.rng.choice([0.0, 1.0]) * self.rng.uniform(0.0, ANGULAR) * angular,
                ]
            )
            self.until = time + self.rng.uniform(1.0, 3.0)
        flips = self.kind == "flip" and int(10.0 * time) % 2
        return -self.twist if flips else self.twist.copy()


class Bench:
    """Runs minutes with one robot."""

    def __init__(self, name: str, obstacles: int, seed: int) -> None:
        self.robot, self.arm = ss.Robot.named(name), ss.Arm.load(name)
        self.tip = tip_of(self.robot)
        self.own, self.clearance = SelfCollision(self.robot), ExactClearance(self.robot, ())
        settings = ProblemSettings(robot=name, obstacles=obstacles, seed=seed)
        generator = ProblemGenerator(settings, robot=self.robot, self_collision=self.own)
        self.shoulder, self.problem = generator.workspace.shoulder, generator.problem

    def run(self, index: int, seconds: float) -> dict[str, Any]:
        """One minute, or part of it."""
        problem, kind = self.problem(index), KINDS[index % len(KINDS)]
        operator = Operator(kind, self, problem, np.random.default_rng((43, index)))
        controller = ss.Controller(self.arm, ss.ControllerSettings(synchronous=True, seed=index))
        controller.set_obstacles(problem.obstacles, valid_for=np.inf)
        told: list[np.ndarray | None] = []

        def tell(time: float, q: np.ndarray, v: np.ndarray) -> None:
            if time + 1e-9 < len(told) * TICK:
                return
            twist = operator(time, q)
            told.append(twist)
            if twist is not None:
                controller.set_twist(self.tip, twist)

        motion = SimulatedArm(self.robot, problem.objects, Plant()).drive(
            controller, problem.start, seconds, seed=index, before=tell
        )
        ball = operator.exact.decided_minimum(motion.q).clearance
        own = self.own.minimum_over(motion.q)
        every = round(TICK / SAMPLE)
        q, v = motion.q[::every], motion.v[::every]
        limits = self.robot.limits
        return {
            "robot": self.robot.name,
            "index": index,
            "kind": kind,
            "contact": bool(ball.distance <= 0.0 or own.distance <= 0.0),
            "pair": f"{ball.link} - {ball.obstacle}" if ball.distance <= 0.0 else " - ".join(own.pair),
            "min_clearance_m": float(ball.distance),
            "position_excess_rad": float(np.maximum(limits.lower - motion.q, motion.q - limits.upper).max()),
            "velocity_ratio": float((np.abs(motion.v) / limits.velocity).max()),
            "moved_rad": float(np.abs(np.diff(q, axis=0)).sum(axis=0).max()),
            "errors": self.free_errors(operator.exact, q, v, told),
            "speed_after_silence": speeds_after_silence(v, told),
        }

    def free_errors(
        self, exact: ExactClearance, q: np.ndarray, v: np.ndarray, told: list[np.ndarray | None]
    ) -> list[float]:
        """|J v - twist| / |twist| where the twist is free, see the module."""
        limits, found, same = self.robot.limits, [], 0
        for k, twist in enumerate(told[: len(q)]):
            repeats = k > 0 and twist is not None and told[k - 1] is not None
            same = same + 1 if repeats and np.array_equal(twist, told[k - 1]) else 0
            if twist is None or same * TICK < SETTLED or not np.any(twist):
                continue
            if min((q[k] - limits.lower).min(), (limits.upper - q[k]).min()) < FREE_LIMIT:
                continue
            J = self.robot.jacobian(q[k], self.tip)
            if np.linalg.svd(J, compute_uv=False)[min(J.shape) - 1] < FREE_SINGULAR:
                continue
            if (np.abs(np.linalg.pinv(J) @ twist) > FREE_SPEED * limits.velocity).any():
                continue
            if exact.distance(q[k]).distance < FREE_CLEARANCE or self.own.distance(q[k]).distance < FREE_SELF:
                continue
            found.append(float(np.linalg.norm(J @ v[k] - twist) / np.linalg.norm(twist)))
        return found


bench = cache(Bench)


def speeds_after_silence(v: np.ndarray, told: list[np.ndarray | None]) -> list[float]:
    """The fastest joint [rad/s] at the last tick of each silence."""
    ends = [
        k
        for k in range(min(len(told), len(v)))
        if told[k] is None and (k + 1 == len(told) or told[k + 1] is not None)
    ]
    return [float(np.abs(v[k]).max()) for k in ends]


def unit(x: np.ndarray) -> np.ndarray:
    """x over its length; a zero stays."""
    length = float(np.linalg.norm(x))
    return x / length if length > 0.0 else x


class Worker:
    """What a process needs."""

    def __init__(self, given: argparse.Namespace) -> None:
        self.given = given

    def run(self, task: tuple[str, int, float]) -> dict[str, Any]:
        robot, index, seconds = task
        return {**bench(robot, self.given.obstacles, self.given.seed).run(index, seconds), "robot": robot}


def summary(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """Figures of one robot."""
    errors = [error for run in runs for error in run["errors"]]
    speeds = [speed for run in runs for speed in run["speed_after_silence"]]
    return {
        "minutes": len(runs),
        "contacts": sum(run["contact"] for run in runs),
        "min_clearance_m": min(run["min_clearance_m"] for run in runs),
        "position_excess_rad": max(run["position_excess_rad"] for run in runs),
        "velocity_ratio": max(run["velocity_ratio"] for run in runs),
        "least_moved_rad": min(run["moved_rad"] for run in runs),
        "free_samples": len(errors),
        "median_error": float(np.median(errors)) if errors else None,
        "p95_error": float(np.quantile(errors, 0.95)) if errors else None,
        "fastest_after_silence": max(speeds, default=None),
    }


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robots", nargs="+", default=list(ROBOTS), metavar="NAME")
    parser.add_argument("--minutes", type=int, default=10, help="of each robot (default 10)")
    parser.add_argument("--seconds", type=float, default=60.0, help="of each minute, to try it (default 60)")
    parser.add_argument("--obstacles", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--json", metavar="FILE")
    given = parser.parse_args()
    tasks = [(robot, k, given.seconds) for robot in given.robots for k in range(given.minutes)]
    runs: dict[str, list[dict[str, Any]]] = {robot: [] for robot in given.robots}
    for run in run_tasks(partial(Worker, given), tasks, jobs=given.jobs):
        runs[run["robot"]].append(run)
        print({key: value for key, value in run.items() if key != "errors"}, file=sys.stderr, flush=True)
    document: dict[str, Any] = {"version": ss.__version__, **vars(given)}
    document["figures"] = {robot: summary(found) for robot, found in runs.items()}
    print(json.dumps(document, indent=1))
    if given.json:
        with open(given.json, "w", encoding="utf-8") as file:
            json.dump({**document, "details": runs}, file, indent=1)
    return 1 if any(fails(figures) for figures in document["figures"].values()) else 0


def fails(figures: dict[str, Any]) -> bool:
    """Whether anything touched, or free twists were not followed."""
    error = figures["median_error"]
    return bool(figures["contacts"]) or error is None or error > TOLERATED


if __name__ == "__main__":
    sys.exit(main())
