"""A 50 Hz policy that drives into obstacles on purpose, behind a slow servo, with a Controller between.

    python benchmarks/policy.py [--filter keep_path steer none] [--episodes 200] [--json FILE]
    python benchmarks/policy.py --task [--filter keep_path steer none]

Every 20 ms the policy sends a chunk of 16 joint positions, 20 ms apart, from where it believes to be, through
`Controller.set_trajectory(q, times)`. It goes straight for configurations that are inside a ball, one after the other,
at up to 2.62 rad/s in the fastest joint. Positions of the Controller go to a servo that lags,
    q' = k (q_d - q),  k = 7 /s: 0.37 rad behind at 2.62 rad/s,
whose state is what the Controller measures. `none` sends the chunks to the servo as they are. Balls, starts and goals
are those of `sidestep bench reach`. Contacts are of the exact meshes of the servo's motion, between samples, with the
balls and of the arm with itself; what the arm may carry has no part in them.

`--task`: the policy does its task: it follows a planned path to the goal. What the filter costs is then the time to
arrive within 0.05 rad, against `none`, and how far the arm is from the policy's path at most.

Exit code 1 where an arm touched something behind a filter.
"""

from __future__ import annotations

import argparse
import json
import sys
from functools import cache, partial
from typing import Any

import numpy as np

import sidestep as ss
from sidestep.arm.link_pairs import tables_and_pairs
from sidestep.bench.parallel import run_tasks
from sidestep.bench.problems import ProblemGenerator, ProblemSettings, ReachProblem
from sidestep.distance import ExactClearance, SelfCollision
from sidestep.planning import PathPlanner

PERIOD = 0.001  # [s] of the Controller and of the servo
TICK = 0.02  # [s] of the policy
CHUNK = 16  # positions of a chunk, TICK apart
SPEED = (0.5, 2.62)  # [rad/s] of the fastest joint, drawn for each episode
GAIN = 7.0  # [1/s] of the servo
LEASH = 0.5  # [rad] from the measured arm: farther, the policy waits, as it sees that the arm does not follow
INSIDE = 0.03  # [m] by which targets are inside a ball
ARRIVED = 0.05  # [rad]
FILTERS = ("keep_path", "steer", "none")


class Policy:
    """Goes along straight lines from waypoint to waypoint at a constant speed of the fastest joint [rad/s]."""

    def __init__(self, start: np.ndarray, waypoints: np.ndarray, speed: float) -> None:
        corners = np.vstack([start, waypoints])
        spans = np.abs(np.diff(corners, axis=0)).max(axis=1) / speed
        self._times = np.concatenate([[0.0], np.cumsum(np.maximum(spans, 1e-9))])
        self._corners = corners
        self.time = 0.0

    def at(self, times: np.ndarray) -> np.ndarray:
        """Positions (K, nv) at times (K,) [s]; it waits at the last waypoint."""
        return np.column_stack([np.interp(times, self._times, joint) for joint in self._corners.T])

    def chunk(self, q: np.ndarray) -> np.ndarray:
        """What it asks for next, (CHUNK, nv), TICK apart, with the measured arm at q (nv,)."""
        wanted = self.at(self.time + TICK * np.arange(CHUNK))
        if np.abs(wanted[0] - q).max() < LEASH:
            self.time += TICK
        return wanted


class Bench:
    """Runs episodes with one robot."""

    def __init__(self, name: str, obstacles: int, seed: int) -> None:
        self.robot, self.arm = ss.Robot.named(name), ss.Arm.load(name)
        self.own, self.clearance = SelfCollision(self.robot), ExactClearance(self.robot, ())
        settings = ProblemSettings(robot=name, obstacles=obstacles, seed=seed)
        self.problem = cache(ProblemGenerator(settings, robot=self.robot, self_collision=self.own).problem)

    def waypoints(self, problem: ReachProblem, *, task: bool, rng: np.random.Generator) -> np.ndarray:
        """Where the policy goes, (K, nv): through a planned path to the goal, or into balls."""
        if task:
            tables, pairs = tables_and_pairs(self.robot, self.arm.body)
            planner = PathPlanner(self.robot, self.arm.body, pairs=pairs, tables=tables)
            return np.array(planner.plan(problem.start, problem.goal, problem.obstacles).path)[1:]
        exact, found = self.clearance.among(problem.objects), []
        for _ in range(2000):
            q = self.robot.random_configuration(rng)
            if exact.distance(q).distance < -INSIDE:
                found.append(q)
                if len(found) == 8:
                    break
        return np.array(found)

    def run(self, index: int, kind: str, *, task: bool, duration: float) -> dict[str, Any]:
        """One episode."""
        rng, problem = np.random.default_rng((41, index)), self.problem(index)
        speed = rng.uniform(*SPEED)
        waypoints = self.waypoints(problem, task=task, rng=rng)
        if not len(waypoints):
            return {"index": index, "skipped": "no path" if task else "nothing to drive into"}
        policy = Policy(problem.start, waypoints, speed)
        controller = ss.Controller(
            self.arm,
            ss.ControllerSettings(
                synchronous=True, seed=index, period=PERIOD, planner=None, output="position"
            ),
        )
        controller.set_obstacles(problem.obstacles, valid_for=np.inf)
        q, v = problem.start.copy(), np.zeros_like(problem.start)
        times, per_tick = TICK * np.arange(CHUNK), round(TICK / PERIOD)
        rows, lag, arrived_at = [], 0.0, None
        for k in range(round(duration / PERIOD)):
            if k % per_tick == 0:
                chunk = policy.chunk(q)
                if kind != "none":
                    controller.set_trajectory(chunk, times, behaviour=kind)
            rows.append(q)
            if kind == "none":
                share = (k % per_tick) / per_tick
                wanted = (1.0 - share) * chunk[0] + share * chunk[1]
            else:
                wanted = controller.step(q, v).position
            lag = max(lag, float(np.abs(wanted - q).max()))
            after = wanted + np.exp(-GAIN * PERIOD) * (q - wanted)
            q, v = after, GAIN * (wanted - after)
            if task and np.abs(q - waypoints[-1]).max() < ARRIVED:
                arrived_at = PERIOD * (k + 1)
                break
        path = np.array(rows)
        worst = self.clearance.among(problem.objects).decided_minimum(path).clearance
        own = self.own.minimum_over(path)
        return {
            "index": index,
            "speed": speed,
            "contact": bool(worst.distance <= 0.0),
            "self_contact": bool(own.distance <= 0.0),
            "min_clearance_m": float(worst.distance),
            "pair": f"{worst.link} - {worst.obstacle}",
            "lag_rad": lag,
            "arrived_s": arrived_at,
            "deviation_rad": deviation(path, policy),
        }


def deviation(path: np.ndarray, policy: Policy) -> float:
    """How far the arm is from the policy's path at most, by the largest joint [rad], at every 20th sample."""
    reference = policy.at(np.arange(0.0, policy.time + TICK, TICK))
    return max(float(np.abs(reference - q).max(axis=1).min()) for q in path[::20])


bench = cache(Bench)


class Worker:
    """What a process needs."""

    def __init__(self, given: argparse.Namespace) -> None:
        self.given = given

    def run(self, task: tuple[str, int]) -> tuple[str, dict[str, Any]]:
        kind, index = task
        given = self.given
        here = bench(given.robot, given.obstacles, given.seed)
        return kind, here.run(index, kind, task=given.task, duration=given.duration)


def summary(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """Figures of one filter."""
    ran = [run for run in runs if "skipped" not in run]
    times = [run["arrived_s"] for run in ran if run["arrived_s"] is not None]
    return {
        "episodes": len(ran),
        "skipped": len(runs) - len(ran),
        "contacts": sum(run["contact"] for run in ran),
        "self_contacts": sum(run["self_contact"] for run in ran),
        "min_clearance_m": min((run["min_clearance_m"] for run in ran), default=None),
        "largest_lag_rad": max((run["lag_rad"] for run in ran), default=None),
        "median_deviation_rad": float(np.median([run["deviation_rad"] for run in ran])) if ran else None,
        "arrived": len(times),
        "median_arrival_s": float(np.median(times)) if times else None,
    }


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robot", default="fr3")
    parser.add_argument("--filter", nargs="+", choices=FILTERS, default=list(FILTERS))
    parser.add_argument("--episodes", type=int, default=200)
    parser.add_argument("--task", action="store_true", help="the policy follows a free path to the goal")
    parser.add_argument("--duration", type=float, default=8.0, help="of an episode at most [s]")
    parser.add_argument("--obstacles", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--json", metavar="FILE")
    given = parser.parse_args()
    runs: dict[str, list[dict[str, Any]]] = {kind: [] for kind in given.filter}
    tasks = [(kind, index) for kind in given.filter for index in range(given.episodes)]
    for kind, run in run_tasks(partial(Worker, given), tasks, jobs=given.jobs):
        runs[kind].append(run)
    document: dict[str, Any] = {"version": ss.__version__, "gain": GAIN, **vars(given)}
    document["figures"] = {kind: summary(found) for kind, found in runs.items()}
    print(json.dumps(document, indent=1))
    if given.json:
        with open(given.json, "w", encoding="utf-8") as file:
            json.dump({**document, "details": runs}, file, indent=1)
    behind = [figures for kind, figures in document["figures"].items() if kind != "none"]
    return 1 if any(figures["contacts"] or figures["self_contacts"] for figures in behind) else 0


if __name__ == "__main__":
    sys.exit(main())
