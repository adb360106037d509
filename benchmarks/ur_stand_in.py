"""Whether a Controller drives a UR around obstacles, and goes on after its protective stops.

    python benchmarks/ur_stand_in.py --output position [--runs 20] [--busy 2] [--json FILE]
    python benchmarks/ur_stand_in.py --output velocity

The robot is Sidestep's own stand-in (`python -m sidestep.drivers.ur_stand_in`), a process that speaks the protocols of
the controller box, moves six joints as servoJ and speedJ would, and goes into a protective stop for what a UR stops
for. The client is the real `ur-rtde`. In each run `sidestep.run` drives the arm from where it is to a goal on the other
side of a ball. In every fifth run the robot is made to go into a protective stop on the way; the driver unlocks it,
which the robot permits after 5 s, and a second `sidestep.run` goes on to the same goal.

A run counts as done where all joints end within `TOLERANCE` of the goal, nothing was touched, no limit was exceeded,
and the robot stopped only where it was made to. Contacts are of the exact meshes, between samples, with the ball and of
the arm with itself; they and the limits are judged on what the stand-in's joints did in every cycle, not on what it was
told. Limits are those of the robot: position, speed, torque, and the 40 rad/s² for which it would stop. The
controller's own limit of acceleration (10 rad/s²) is reported: after a lost cycle the servo catches up by more.

Exit code 1 where a run was not done.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from busy import busy

import sidestep as ss
from sidestep.bench.problems import balls
from sidestep.distance import ExactClearance, SelfCollision
from sidestep.drivers import UR
from sidestep.drivers.ur_stand_in.joints import FASTEST
from sidestep.drivers.ur_stand_in.process import StandInProcess
from sidestep.loop import RunEnd
from sidestep.robot import Robot, tip_of

HOME = np.array([0.0, -1.6, 1.6, -1.6, -1.6, 0.0])  # [rad] about which the goals are
RADIUS, CLEARANCE = 0.08, 0.05  # [m] of the ball; of start and goal from it
TOLERANCE = 0.005  # [rad] of arrival
STOP_AFTER = 0.4  # [s] from the begin of a run until the robot is made to stop
SETTLING = 0.3  # [s] after a run, until the robot's joints are read
MARGIN = 0.05  # share of the limits that the controller leaves
PRIORITY = 40  # of this thread; the loop has 60
ROUNDING = 1e-3  # share of a limit that counts as on it


class Bench:
    """Problems for one arm, and the judgement of what it did."""

    def __init__(self, name: str) -> None:
        """For one robot, by its name."""
        self.robot, self.arm = Robot.named(name), ss.Arm.load(name)
        self.own, self.clearance = SelfCollision(self.robot), ExactClearance(self.robot, ())

    def problem(self, start: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
        """A goal (6,) and the centre (3,) of a ball that is in the way of the straight line there."""
        rng, tip = np.random.default_rng((51, seed)), tip_of(self.robot)
        while True:
            goal = HOME + rng.uniform(-0.4, 0.4, size=len(start))
            goal[0] = start[0] + (-1.0 if start[0] > 0.0 else 1.0) * rng.uniform(0.8, 1.5)
            center = self.robot.pose(0.5 * (start + goal), tip)[:3, 3] + rng.uniform(-0.05, 0.05, size=3)
            exact = self.clearance.among(balls(center[None], np.array([RADIUS])))
            if (
                min(exact.distance(start).distance, exact.distance(goal).distance) > CLEARANCE
                and exact.minimum_over(np.array([start, goal])).clearance.distance <= 0.0
                and not self.own.touching(goal)
            ):
                return goal, center

    def judged(self, file: Path, center: np.ndarray) -> dict[str, float]:
        """Clearance of what the joints did [m]; speed, acceleration and torque as shares of the arm's limits.

        `hardest`: acceleration as a share of what the robot permits. The robot's own brake after a stop counts for
        contacts, not for limits.
        """
        moved, limits = np.load(file), self.robot.limits
        path, playing = moved["position"], moved["playing"]
        path = path[np.r_[True, np.abs(np.diff(path, axis=0)).max(axis=1) > 1e-9]]
        exact = self.clearance.among(balls(center[None], np.array([RADIUS])))
        accelerations = np.abs(moved["target_acceleration"][playing])
        return {
            "ball_m": float(exact.decided_minimum(path).clearance.distance),
            "own_m": float(self.own.minimum_over(path).distance),
            "velocity": float((np.abs(moved["velocity"][playing]) / limits.velocity).max()),
            "acceleration": float((accelerations / limits.acceleration).max()),
            "torque": float((np.abs(moved["torque"][playing]) / limits.effort).max()),
            "hardest": float(accelerations.max() / FASTEST),
            "beyond_rad": float(np.maximum(path - limits.upper, limits.lower - path).max()),
        }

    def run(
        self, robot: StandInProcess, driver: UR, *, output: str, seed: int, stops: bool
    ) -> dict[str, Any]:
        """One run, and what came of it."""
        driver.recover()  # from a run that ended so
        state = driver.read(1.0)
        assert state is not None
        before = robot.tell()
        goal, center = self.problem(state.q, seed)
        period = driver.description.period
        settings = ss.ControllerSettings(output=output, period=period, limit_margin=MARGIN, seed=seed)
        controller = ss.Controller(self.arm, settings)
        controller.set_obstacles(ss.Obstacles(center[None], np.array([RADIUS])))
        controller.set_goal(goal)
        reports, begin = [], time.monotonic()
        if stops:
            threading.Timer(STOP_AFTER, robot.say, ("protective stop",)).start()
        reports.append(ss.run(controller, driver, duration=20.0))
        if stops and reports[-1].end == RunEnd.robot_stopped:
            driver.recover()
            reports.append(ss.run(controller, driver, duration=20.0))
        wall = time.monotonic() - begin
        time.sleep(SETTLING)
        after = robot.tell()
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "moved.npz"
            robot.save(file)
            found = self.judged(file, center)
        error = float(np.abs(np.array(after["position"]) - goal).max())
        own_stops = after["protective stops"] - before["protective stops"] - stops
        broken = max(found["velocity"], found["torque"], found["hardest"]) > 1.0 + ROUNDING
        ends = [RunEnd.robot_stopped] * stops + [RunEnd.arrived]
        return {
            "seed": seed,
            "stopped_on_the_way": stops,
            "ends": [report.end.name for report in reports],
            "why": [report.why for report in reports],
            "arrived": error < TOLERANCE and [report.end for report in reports] == ends,
            "error_rad": error,
            "own_stops": own_stops,
            "contact": found["ball_m"] <= 0.0 or found["own_m"] <= 0.0,
            "limits_broken": broken or found["beyond_rad"] > 0.0,
            "wall_s": wall,
            "cycles": sum(report.cycles for report in reports),
            "missed": sum(report.missed for report in reports),
            "lost": sum(report.lost for report in reports),
            "scheduling": reports[-1].scheduling,
            **found,
        }


def line(run: dict[str, Any]) -> str:
    """One run in words."""
    arrived = "arrived" if run["arrived"] else f"NOT ARRIVED ({', '.join(run['why'])})"
    wrong = ", ".join(name for name in ("contact", "limits_broken", "own_stops") if run[name])
    shares = ", ".join(
        f"{100 * run[name]:.0f} % of {name}" for name in ("velocity", "acceleration", "torque")
    )
    return (
        f"run {run['seed']}: {' then '.join(run['ends'])}; {arrived}, {1e3 * run['error_rad']:.2f} mrad off; "
        f"ball {1e3 * run['ball_m']:.0f} mm, own {1e3 * run['own_m']:.0f} mm; {shares}; "
        f"{run['cycles']} cycles, {run['lost']} lost{'; WRONG: ' + wrong if wrong else ''}"
    )


def prefer_this_thread() -> None:
    """This thread holds Python's lock now and then, which the loop's thread needs: nothing may put it aside then."""
    with suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(PRIORITY))


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--output", choices=("position", "velocity"), default="position")
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--robot", choices=("ur5", "ur10"), default="ur10")
    parser.add_argument("--frequency", type=int, choices=(125, 500), default=500)
    parser.add_argument("--stop-every", type=int, default=5, help="a protective stop in each so manieth run")
    parser.add_argument("--unlock-after", type=float, default=5.0, help="after a protective stop [s]")
    parser.add_argument("--busy", type=int, default=0, help="busy processes beside")
    parser.add_argument("--seed", type=int, default=0, help="of the first run")
    parser.add_argument("--json", metavar="FILE")
    given = parser.parse_args()
    bench = Bench(given.robot)
    words = [
        "--robot",
        given.robot,
        "--frequency",
        str(given.frequency),
        "--unlock-after",
        str(given.unlock_after),
    ]
    runs = []
    prefer_this_thread()
    with (
        StandInProcess(*words, "--record", "--real-time") as robot,
        UR("127.0.0.1") as driver,
        busy(given.busy),
    ):
        for number in range(given.runs):
            stops = number % given.stop_every == given.stop_every - 1
            seed = given.seed + number
            runs.append(bench.run(robot, driver, output=given.output, seed=seed, stops=stops))
            print(line(runs[-1]), flush=True)
    done = [
        run["arrived"] and not (run["contact"] or run["limits_broken"] or run["own_stops"]) for run in runs
    ]
    stopped = [ok for ok, run in zip(done, runs, strict=True) if run["stopped_on_the_way"]]
    document = {
        "version": ss.__version__,
        **{name: getattr(given, name) for name in ("output", "robot", "frequency", "busy")},
        "runs": len(runs),
        "done": sum(done),
        "protective_stops": len(stopped),
        "recovered": sum(stopped),
        "contacts": sum(run["contact"] for run in runs),
        "largest_error_rad": max(run["error_rad"] for run in runs),
        "cycles": sum(run["cycles"] for run in runs),
        "lost": sum(run["lost"] for run in runs),
        "scheduling": runs[-1]["scheduling"],
        "details": runs,
    }
    print(json.dumps({name: value for name, value in document.items() if name != "details"}))
    if given.json:
        Path(given.json).write_text(json.dumps(document, indent=1), encoding="utf-8")
    return 0 if all(done) else 1


if __name__ == "__main__":
    sys.exit(main())
