"""Whether a robot that speaks Franka's protocol and enforces its limits accepts a Controller's commands.

    python benchmarks/franka_server.py --output torque [--runs 20] [--delays 0.01] [--busy 2] [--json FILE]
    python benchmarks/franka_server.py --output velocity
    python benchmarks/franka_server.py --output position

A run starts a `franka-sim` server (`sidestep.drivers.FrankaServer`: an FR3 in MuJoCo with friction and armature that
Sidestep's model lacks, limits and the rule about lost cycles enforced), connects `sidestep.drivers.Franka`, and has
`ss.run` drive the arm between a ball and a table: a goal on the other side of the ball, and before it is reached
another one, twice. `--delays` is the share of cycles in which the loop sleeps for 2 to 10 ms, half of them before it
reads and half before it writes; `--busy` starts loops that do nothing but take processor time. Server and loop run
under SCHED_FIFO where the machine permits it.

A run counts where the server ended no motion, the arm arrived within 5 mrad, and the exact meshes of the measured
motion, between samples, touched neither ball nor table nor each other. Exit code 1 where one does not.

Needs the extras `franka`, `simulation` and `robots`. The first run makes the server's environment (about 150 MB).
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from busy import busy

import sidestep as ss
from sidestep.bench.problems import balls
from sidestep.distance import ExactClearance, SceneObject, SelfCollision
from sidestep.drivers import Franka, FrankaServer, RobotState
from sidestep.drivers.real_time_threads import real_time_threads
from sidestep.robot import Robot, tip_of

# Share of limits and speed that stay unused: the server's arm swings by 0.4 rad/s about the velocity that it is told.
SETTINGS = {
    "torque": {"limit_margin": 0.2, "speed": 0.8},
    "velocity": {"limit_margin": 0.2, "speed": 0.8, "tracking": {"drift_gain": 10.0}},
    "position": {"limit_margin": 0.2, "speed": 0.7},
}
RADIUS = 0.08  # [m] of the ball
TABLE = {"size": (0.8, 1.2, 0.04), "at": (0.65, 0.0, 0.1)}  # [m]
CLEARANCE = 0.05  # [m] of start and goals
LEAST_HEIGHT = 0.25  # [m] of the tip
GOALS, NEXT_GOAL = 3, 0.9  # goals of a run, the next one after so long [s]
TOLERANCE = 0.005  # [rad] of arrival
HOLD = 0.2  # [s]
DELAYS = (0.002, 0.01)  # [s]
# The loop's is 60. This thread holds Python's lock now and then: the loop waits for it.
SERVER_PRIORITY, MAIN_PRIORITY = 50, 55


class Watched:
    """A driver that keeps the measured positions, and sleeps in a share of the cycles."""

    def __init__(self, driver: Franka, delays: float, seed: int) -> None:
        self.driver, self.delays = driver, delays
        self.description, self.start, self.stop = driver.description, driver.start, driver.stop
        self.rows: list[np.ndarray] = []
        self._rng = np.random.default_rng(seed)

    def read(self, timeout: float) -> RobotState:
        self._sleep()
        state = self.driver.read(timeout)
        self.rows.append(state.q)
        return state

    def write(self, command: ss.Command) -> None:
        self._sleep()
        self.driver.write(command)

    def _sleep(self) -> None:
        if self.rows and self._rng.random() < 0.5 * self.delays:
            time.sleep(self._rng.uniform(*DELAYS))


class Problems:
    """Goals around a ball above a table, from a start."""

    def __init__(self) -> None:
        self.robot = Robot.named("fr3")
        self.own, self.clearance = SelfCollision(self.robot), ExactClearance(self.robot, ())
        self.table = SceneObject("table", "box", size=TABLE["size"], pose=placed(TABLE["at"]))

    def exact(self, ball: np.ndarray) -> Any:
        return self.clearance.among((*balls(ball[None], np.array([RADIUS])), self.table))

    def draw(self, start: np.ndarray, seed: int) -> tuple[list[np.ndarray], np.ndarray]:
        """Goals (7,), on alternate sides, and the centre (3,) of a ball in the straight way to the first."""
        rng, goals, ball = np.random.default_rng((31, seed)), [], None
        limits, tip = self.robot.limits, tip_of(self.robot)
        while len(goals) < GOALS:
            goal = start + rng.uniform(-0.4, 0.4, size=7)
            goal[0] = start[0] + (-1) ** (len(goals) + seed) * rng.uniform(0.6, 1.2)
            goal = np.clip(goal, limits.lower + 0.05, limits.upper - 0.05)
            middle = self.robot.pose(0.5 * (start + goal), tip)[:3, 3] + rng.uniform(-0.05, 0.05, size=3)
            center = middle if ball is None else ball
            exact = self.exact(center)
            if (
                self.robot.pose(goal, tip)[2, 3] > LEAST_HEIGHT
                and min(exact.distance(q).distance for q in (start, goal)) > CLEARANCE
                and not self.own.touching(goal)
                and (
                    ball is not None or exact.minimum_over(np.array([start, goal])).clearance.distance <= 0.0
                )
            ):
                goals.append(goal)
                ball = center
        assert ball is not None
        return goals, ball

    def least(self, ball: np.ndarray, path: np.ndarray) -> tuple[float, float]:
        """Least distance of the meshes on a path from ball and table, and from each other [m]."""
        return (
            float(self.exact(ball).decided_minimum(path).clearance.distance),
            float(self.own.minimum_over(path).distance),
        )


def placed(position: Any) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = position
    return pose


def run(problems: Problems, arm: ss.Arm, output: str, seed: int, delays: float) -> dict[str, Any]:
    """One run; what came of it."""
    with Franka(FrankaServer.address, enforce_real_time=False) as franka:
        start = franka.read().q
        goals, ball = problems.draw(start, seed)
        controller = ss.Controller(arm, ss.ControllerSettings(seed=seed, output=output, **SETTINGS[output]))
        controller.set_obstacles(
            [ss.Sphere(RADIUS, placed(ball)), ss.Box(TABLE["size"], placed(TABLE["at"]))]
        )
        controller.set_goal(goals[0])
        driver, begun, near = Watched(franka, delays, seed), time.monotonic(), [0.0]
        stage = [0]

        def until(state: RobotState) -> bool:
            now = time.monotonic()
            due = min(GOALS - 1, int((now - begun) / NEXT_GOAL))
            if due != stage[0]:
                stage[0] = due
                controller.set_goal(goals[due])
            if due < GOALS - 1 or np.abs(state.q - goals[-1]).max() > TOLERANCE:
                near[0] = now
            return now - near[0] > HOLD

        with real_time_threads(MAIN_PRIORITY):
            report = ss.run(controller, driver, until=until, duration=20.0)
        path = np.array(driver.rows)
        clearance, own = problems.least(ball, path)
        error = float(np.abs(path[-1] - goals[-1]).max())
        refused = report.end.name == "robot_stopped"
        return {
            "seed": seed,
            "good": report.end.name == "arrived" and error < TOLERANCE and min(clearance, own) > 0.0,
            "accepted": not refused,
            "contact": min(clearance, own) <= 0.0,
            "end": report.end.name,
            "why": report.why,
            "error_rad": error,
            "clearance_m": clearance,
            "own_clearance_m": own,
            "cycles": report.cycles + report.lost,
            "lost": report.lost,
            "late_answers": franka.late,
            "scheduling": report.scheduling,
            "says": report.at_the_end,
        }


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--output", choices=tuple(SETTINGS), default="torque")
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0, help="of the first run")
    parser.add_argument("--delays", type=float, default=0.0, help="share of cycles that are 2 to 10 ms late")
    parser.add_argument("--busy", type=int, default=0, help="processes beside it")
    parser.add_argument("--json", metavar="FILE")
    given = parser.parse_args()
    problems, arm, runs = Problems(), ss.Arm.load("fr3"), []
    for seed in range(given.seed, given.seed + given.runs):
        with FrankaServer(priority=SERVER_PRIORITY) as server, busy(given.busy):
            found = run(problems, arm, given.output, seed, given.delays)
        found["server"] = server.said()
        runs.append(found)
        print(line(found), *found["server"][:2], sep="\n    ", flush=True)
    counts = {name: sum(run[name] for run in runs) for name in ("good", "accepted", "contact")}
    options = {name: value for name, value in vars(given).items() if name != "json"}
    document = {"version": ss.__version__, **options, **counts}
    print(json.dumps(document))
    if given.json:
        Path(given.json).write_text(json.dumps({**document, "details": runs}, indent=1), encoding="utf-8")
    return 0 if counts["good"] == len(runs) else 1


def line(run: dict[str, Any]) -> str:
    """One run in words."""
    return (
        f"run {run['seed']}: {'good' if run['good'] else 'BAD'}; {run['end']}: {run['why']}; {run['cycles']} cycles, "
        f"{run['lost']} lost; {1e3 * run['error_rad']:.1f} mrad from the goal; {1e3 * run['clearance_m']:.0f} mm clear"
    )


if __name__ == "__main__":
    sys.exit(main())
