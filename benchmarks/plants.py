"""How a Controller does on arms that are not what their models say: a matrix of plants in MuJoCo.

    python benchmarks/plants.py [--robots fr3 ur10 xarm7] [--cells NAME ...] [--runs 20] [--json FILE]

Each cell is one way in which the arm differs from its model (`CELLS`, see `plant.py`): an unknown payload, friction,
armature, damping, weak motors, a slow rate, a delay, noise, an encoder offset, pushes, and combinations. A run is a
problem of `sidestep bench reach`: random start and goal among random balls. Every figure is of the true state, from
physics at 2 kHz: contacts of exact meshes between samples, with balls and with itself; arrival within 0.02 rad,
at most 0.02 rad/s, for 0.2 s; by how much position and velocity limits are exceeded. "Holdable" are runs at whose
start and goal the motors can hold the true arm: the others are not expected to arrive. Of commands: the largest jerk
and torque rate, as finite differences, from rest and the told gravity at the start. `--output position` and `velocity`
drive the arm through a stiff drive of its own, whose gains `plant.py` tells.

Exit code 1 where an arm touched something, or exceeded a position limit by more than 5 mrad or a velocity limit by
more than 5 %.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from functools import cache, partial
from typing import Any

import numpy as np
from plant import SAMPLE, Plant, PlantMotion, SimulatedArm

import sidestep as ss
from sidestep.bench.motion import Motion, MotionSettings
from sidestep.bench.outcome import Judge, Outcome
from sidestep.bench.parallel import cpu_name, run_tasks
from sidestep.bench.problem import poses_over
from sidestep.bench.problems import ProblemGenerator, ProblemSettings, ReachProblem
from sidestep.distance import SelfCollision

ROBOTS = ("fr3", "ur10", "xarm7")
POSITION_EXCESS = 5e-3  # [rad] allowed
VELOCITY_EXCESS = 0.05  # share of the limit, allowed
OFFSET = np.radians(0.2)
CELLS = {
    "nominal": Plant(),
    "payload 0.5 kg": Plant(payload=0.5),
    "payload 1 kg": Plant(payload=1.0),
    "payload 3 kg": Plant(payload=3.0),
    "friction 1 Nm": Plant(friction=1.0),
    "friction 5 Nm": Plant(friction=5.0),
    "armature 0.1 kg m2": Plant(armature=0.1),
    "damping 1 Nm s": Plant(damping=1.0),
    "torque 60 %": Plant(torque_share=0.6),
    "500 Hz": Plant(rate=500.0),
    "250 Hz": Plant(rate=250.0),
    "125 Hz": Plant(rate=125.0),
    "delay 1 ms": Plant(delay=0.001),
    "delay 2 ms": Plant(delay=0.002),
    "delay 5 ms": Plant(delay=0.005),
    "noise 0.01 rad/s": Plant(velocity_noise=0.01),
    "offset 0.2 deg": Plant(encoder_offset=OFFSET),
    "pushes 20 N": Plant(push=20.0),
    "robot": Plant(friction=1.0, armature=0.1, damping=1.0, delay=0.001, velocity_noise=0.01),
    "robot, 1 kg": Plant(
        payload=1.0, friction=1.0, armature=0.1, damping=1.0, delay=0.001, velocity_noise=0.01
    ),
    "robot, 250 Hz, offset, pushes": Plant(
        friction=1.0,
        armature=0.1,
        damping=1.0,
        rate=250.0,
        delay=0.002,
        velocity_noise=0.01,
        encoder_offset=OFFSET,
        push=20.0,
    ),
}  # "delay 1 ms" is one step at 1 kHz


class Bench:
    """Runs problems of one robot."""

    def __init__(self, name: str, obstacles: int, seed: int) -> None:
        self.robot, self.arm = ss.Robot.named(name), ss.Arm.load(name)
        own = SelfCollision(self.robot)
        settings = ProblemSettings(robot=name, obstacles=obstacles, seed=seed)
        self.problem = cache(ProblemGenerator(settings, robot=self.robot, self_collision=own).problem)
        self.judge = Judge(self.robot, self_collision=own)

    def run(self, cell: str, index: int, output: str, duration: float) -> dict[str, Any]:
        """What came of one run of a cell."""
        plant, problem = CELLS[cell], self.problem(index)
        settings = ss.ControllerSettings(synchronous=True, seed=index, period=1.0 / plant.rate, output=output)
        controller = ss.Controller(self.arm, settings)
        controller.set_obstacles(problem.obstacles, valid_for=np.inf)
        controller.set_goal(problem.goal)
        simulated = SimulatedArm(self.robot, problem.objects, plant, output)
        document: dict[str, Any] = {"robot": self.robot.name, "cell": cell, "index": index}
        try:
            motion = simulated.drive(controller, problem.start, duration, seed=index, goal=problem.goal)
        except RuntimeError as error:
            return {**document, "diverged": str(error)}
        outcome = self.judge.judge(problem, judged(problem, motion), MotionSettings(period=SAMPLE))
        holdable = simulated.can_hold(problem.start) and simulated.can_hold(problem.goal)
        _, gravity = simulated.told_dynamics(problem.start, np.zeros_like(problem.start))
        return {
            **document,
            "holdable": holdable,
            "physics_contacts": motion.physics_contacts,
            **told(outcome),
            **figures(self.robot.limits, motion, gravity),
        }


bench = cache(Bench)


def judged(problem: ReachProblem, motion: PlantMotion) -> Motion:
    """A motion of a plant as the judge takes it."""
    poses = poses_over(problem.objects, SAMPLE * np.arange(len(motion.q)))
    a = np.diff(motion.v, axis=0, append=motion.v[-1:]) / SAMPLE
    nothing = np.zeros(len(motion.q))
    return Motion(motion.q, motion.v, a, poses, motion.applied, 0, motion.arrived, nothing)


def told(outcome: Outcome) -> dict[str, Any]:
    """Contact and arrival of an outcome."""
    return {
        "contact": outcome.collision,
        "self_contact": outcome.self_collision,
        "contact_pair": outcome.clearance_pair if outcome.collision else outcome.self_pair,
        "min_clearance_m": outcome.min_clearance_m,
        "min_self_clearance_m": outcome.min_self_clearance_m,
        "arrived": outcome.arrived,
        "error_rad": outcome.error_rad,
        "time_s": outcome.time_s,
    }


def figures(limits: Any, motion: PlantMotion, gravity: np.ndarray) -> dict[str, Any]:
    """Largest excess of limits by the true state, and how rough commands were, each as the worst joint's.

    Args:
        limits: of the robot. gravity: (nv,) [Nm] told, at the start: the torque before the first command.
    """
    beyond = np.maximum(limits.lower - motion.q, motion.q - limits.upper)
    true_acceleration = np.abs(np.diff(motion.v, axis=0)) / SAMPLE
    jerk = np.abs(np.diff(motion.acceleration, axis=0, prepend=0.0)) / motion.period
    rate = np.abs(np.diff(motion.torque, axis=0, prepend=gravity[None])) / motion.period
    document = {
        "position_excess_rad": max(0.0, float(beyond.max())),
        "velocity_excess": max(0.0, float((np.abs(motion.v) / limits.velocity).max()) - 1.0),
        "acceleration_ratio": float((true_acceleration / limits.acceleration).max(initial=0.0)),
        "command_acceleration_ratio": float((np.abs(motion.acceleration) / limits.acceleration).max()),
        "command_torque_ratio": float((np.abs(motion.torque) / limits.effort).max()),
        "jerk": float(jerk.max()),
        "torque_rate": float(rate.max()),
        "torque_rate_after_start": float(rate[1:].max(initial=0.0)),
    }
    for name, values in (("jerk", jerk), ("torque_rate", rate)):
        limit = getattr(limits, name, None)  # descriptions that tell none have none
        if limit is not None:
            document[f"{name}_ratio"] = float((values / limit).max())
    return document


WORST = (
    "position_excess_rad",
    "velocity_excess",
    "acceleration_ratio",
    "command_acceleration_ratio",
    "command_torque_ratio",
    "jerk",
    "jerk_ratio",
    "torque_rate",
    "torque_rate_after_start",
    "torque_rate_ratio",
)


def summary(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """The figures of a cell: counts, the worst of each excess, the median time of arrivals."""
    ran = [run for run in runs if "diverged" not in run]
    times = [run["time_s"] for run in ran if run["arrived"]]
    holdable = [run for run in ran if run["holdable"]]
    document: dict[str, Any] = {
        "runs": len(runs),
        "diverged": len(runs) - len(ran),
        "contacts": sum(run["contact"] or run["self_contact"] for run in ran),
        "physics_contacts": sum(run["physics_contacts"] > 0 for run in ran),
        "arrived": sum(run["arrived"] for run in ran),
        "holdable": len(holdable),
        "arrived_of_holdable": sum(run["arrived"] for run in holdable),
        "median_time_s": float(np.median(times)) if times else None,
        "min_clearance_m": min(
            (run["min_clearance_m"] for run in ran if run["min_clearance_m"] is not None), default=None
        ),
    }
    for name in WORST:
        if any(name in run for run in ran):
            document[name] = max(run[name] for run in ran)
    return document


def fails(cell: dict[str, Any]) -> bool:
    """Whether anything touched or broke a limit in a cell."""
    return bool(
        cell["contacts"]
        or cell["diverged"]
        or cell.get("position_excess_rad", 0.0) > POSITION_EXCESS
        or cell.get("velocity_excess", 0.0) > VELOCITY_EXCESS
    )


HEAD = (
    "| robot | plant | runs | contacts | arrived of holdable | position [mrad] | velocity [%] | acceleration / limit "
    "| command: jerk [rad/s³] | torque rate [Nm/s] | time [s] |\n|---|---|---|---|---|---|---|---|---|---|---|"
)


def line(robot: str, name: str, cell: dict[str, Any]) -> str:
    """A row of the table."""
    time = cell["median_time_s"]
    diverged = f", {cell['diverged']} diverged" if cell["diverged"] else ""
    head = f"| {robot} | {name} | {cell['runs']}{diverged} | {cell['contacts']} "
    if cell["diverged"] == cell["runs"]:
        return head + "| | | | | | | |"
    return (
        f"{head}| {cell['arrived_of_holdable']} of {cell['holdable']} | {1e3 * cell['position_excess_rad']:.1f} "
        f"| {100.0 * cell['velocity_excess']:.1f} | {cell['acceleration_ratio']:.2f} | {cell['jerk']:.0f} "
        f"| {cell['torque_rate']:.0f} | {'' if time is None else f'{time:.2f}'} |"
    )


class Worker:
    """What a process needs."""

    def __init__(self, output: str, duration: float, obstacles: int, seed: int) -> None:
        self.output, self.duration, self.obstacles, self.seed = output, duration, obstacles, seed

    def run(self, task: tuple[str, str, int]) -> dict[str, Any]:
        robot, cell, index = task
        found = bench(robot, self.obstacles, self.seed).run(cell, index, self.output, self.duration)
        return {**found, "robot": robot}


def collected(
    results: Iterator[dict[str, Any]], robots: list[str], cells: list[str], runs: int
) -> Iterator[tuple[str, str, list[dict[str, Any]]]]:
    """Cells as they are complete."""
    found: dict[tuple[str, str], list[dict[str, Any]]] = {(r, c): [] for r in robots for c in cells}
    for run in results:
        here = found[run["robot"], run["cell"]]
        here.append(run)
        if len(here) == runs:
            yield run["robot"], run["cell"], sorted(here, key=lambda item: item["index"])


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robots", nargs="+", default=list(ROBOTS), metavar="NAME")
    parser.add_argument("--cells", nargs="+", default=list(CELLS), choices=CELLS, metavar="CELL")
    parser.add_argument("--runs", type=int, default=20, help="of each cell (default 20)")
    parser.add_argument("--output", default="torque", choices=("torque", "position", "velocity"))
    parser.add_argument("--duration", type=float, default=20.0, help="of a run at most [s] (default 20)")
    parser.add_argument("--obstacles", type=int, default=10, help="balls of a problem (default 10)")
    parser.add_argument("--seed", type=int, default=0, help="of problems (default 0)")
    parser.add_argument("--jobs", type=int, default=1, help="processes (default 1)")
    parser.add_argument("--json", metavar="FILE", help="writes every run")
    given = parser.parse_args()
    tasks = [(robot, cell, k) for robot in given.robots for cell in given.cells for k in range(given.runs)]
    make = partial(Worker, given.output, given.duration, given.obstacles, given.seed)
    document: dict[str, Any] = {"version": ss.__version__, "cpu": cpu_name(), **vars(given), "figures": []}
    failed = 0
    print(HEAD, flush=True)
    results = run_tasks(make, tasks, jobs=given.jobs)
    for robot, name, runs in collected(results, given.robots, given.cells, given.runs):
        cell = summary(runs)
        failed += fails(cell)
        print(line(robot, name, cell), flush=True)
        document["figures"].append({"robot": robot, "cell": name, **cell, "details": runs})
        if given.json:  # after every cell: what is there counts if this is cut off
            with open(given.json, "w", encoding="utf-8") as file:
                json.dump(document, file, indent=1)
    print(f"{failed} cells touched something or broke a limit", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
