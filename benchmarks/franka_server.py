"""Whether a robot that speaks Franka's protocol and enforces its limits accepts a Controller's commands.

    python benchmarks/franka_server.py --mode torque [--runs 20] [--keep FOLDER] [--json FILE]
    python benchmarks/franka_server.py --mode position

A run starts a `franka-sim` server (an FR3 in MuJoCo with friction and armature that Sidestep's model does not have),
with limits of velocity, acceleration, jerk and torque rate and the rule about lost cycles enforced, connects with
`pylibfranka` as to a robot, and lets a `Controller` drive the arm from the server's start to a goal on the other side
of a ball. Torque is sent without gravity, which the robot adds itself. A run is accepted where the server ended no
motion; it arrived where every measured joint was within 0.02 rad of the goal for 0.2 s and moved by at most 4 mrad in
that time (velocities are not asked: at rest, under position control, the server's jitter by 0.08 rad/s).
Contacts are of the exact meshes of the measured motion, between samples, with the ball and of the arm with itself.

The first run makes a virtual environment with the server, and one folder with the client, in Sidestep's cache folder
(about 200 MB): the server needs older versions of NumPy and MuJoCo. The server listens on 127.0.0.1 only. Its ticks
take 1 ms where the machine is free. Where it is not, cycles are lost, for which the robot goes on with the last
acceleration of a stream of positions, or the last torque: the controller steps once for each lost cycle of positions.
How many were lost is told; a stream that lost many at once may be refused for them. The controller leaves `MARGIN` of
its limits.

Exit code 1 where a motion was refused, did not arrive or touched something.
"""

from __future__ import annotations

import argparse
import json
import socket
import subprocess
import sys
import time
import venv
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

import sidestep as ss
from sidestep.bench.problems import balls
from sidestep.distance import ExactClearance, SelfCollision
from sidestep.robot import Robot, tip_of
from sidestep.storage.user_cache import cache_root

HOST, PORT = "127.0.0.1", 1337  # the port of the protocol
SERVER = ("franka-sim==1.1.7", "numpy==1.26.4", "mujoco<3.3")
CLIENT = ("pylibfranka==0.21.3",)
MODEL = "franky-sim==1.0.4"  # whose wheel carries an FR3 in MJCF
START_SERVER = f"""
import logging
logging.basicConfig(level=logging.INFO, format="%(levelname)s %(name)s: %(message)s")
from franka_sim import FrankaSimServer
FrankaSimServer(
    host="{HOST}", port={PORT}, enable_gripper=False, enforce_comm_constraints=True, enforce_motion_limits=True
).start()
"""
RADIUS = 0.08  # [m] of the ball
CLEARANCE = 0.05  # [m] of start and goal from it
LEAST_HEIGHT = 0.25  # [m] of the tip: the server has a floor at 0
TOLERANCE, HOLD, REST = (
    0.02,
    0.2,
    0.004,
)  # of arrival: [rad] from the goal, for so long [s], moved by at most [rad]
PERIOD = 0.001  # [s] of the protocol
MARGIN = 0.06  # share of the limits: the robot ends a motion for what noise, friction and lost cycles add


class Environment:
    """The server's virtual environment, the client and the model, in a folder; made where they are not there."""

    def __init__(self, folder: Path) -> None:
        self.python = folder / "server" / "bin" / "python"
        self.client = folder / "client"
        self.model = folder / "fr3.xml"
        if self.model.exists():
            return
        print(f"making the server's environment in {folder}", file=sys.stderr, flush=True)
        venv.create(folder / "server", with_pip=True)
        self._pip("install", *SERVER)
        self._pip("install", "--no-deps", "--target", str(self.client), *CLIENT)
        self._pip("download", "--no-deps", "--dest", str(folder), MODEL)
        (wheel,) = folder.glob("franky_sim-*.whl")
        with zipfile.ZipFile(wheel) as archive:
            names = [name for name in archive.namelist() if name.startswith("franky_sim/assets/")]
            archive.extractall(folder, names)
        assets = folder / "franky_sim" / "assets"
        self.model.write_text(arm_alone((assets / "fr3.xml").read_text(encoding="utf-8"), assets / "meshes"))

    def _pip(self, *words: str) -> None:
        subprocess.run([self.python, "-m", "pip", "--quiet", *words], check=True)


def arm_alone(mjcf: str, meshes: Path) -> str:
    """An MJCF with an arm and a hand, without the hand and what holds only with it; meshes: their folder."""
    root = ElementTree.fromstring(mjcf)
    root.find("compiler").set("meshdir", str(meshes.resolve()))
    for name in ("tendon", "equality", "contact", "keyframe", "sensor"):
        for element in root.findall(name):
            root.remove(element)
    for parent in root.iter():
        for child in list(parent):
            if child.get("name") == "hand" and child.tag in ("body", "general"):
                parent.remove(child)
    return ElementTree.tostring(root, encoding="unicode")


@contextmanager
def server(environment: Environment, log: Path) -> Iterator[None]:
    """A server that runs while the context does; what it says goes to `log`."""
    with socket.socket() as probe:
        if probe.connect_ex((HOST, PORT)) == 0:
            raise RuntimeError(f"something listens on {HOST}:{PORT} already; the protocol has no other port")
    with log.open("w", encoding="utf-8") as file:
        process = subprocess.Popen(
            [environment.python, "-c", START_SERVER],
            stdout=file,
            stderr=subprocess.STDOUT,
            env={"FR3_MJCF": str(environment.model), "PATH": str(environment.python.parent)},
        )
    try:
        check = [environment.python.parent / "franka-sim-check", "--host", HOST, "--timeout", "5"]
        while subprocess.run(check, capture_output=True).returncode:
            if process.poll() is not None:
                raise RuntimeError(f"the server ended: {log.read_text(encoding='utf-8')[-2000:]}")
        yield
    finally:
        process.terminate()
        try:
            process.wait(timeout=20.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


class Driver:
    """Drives the arm of a server by a `Controller`."""

    def __init__(self, environment: Environment) -> None:
        sys.path.append(str(environment.client))
        import pylibfranka

        self.franka = pylibfranka
        self.robot, self.arm = Robot.named("fr3"), ss.Arm.load("fr3")
        self.own, self.clearance = SelfCollision(self.robot), ExactClearance(self.robot, ())

    def problem(self, start: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
        """A goal (7,) and the centre (3,) of a ball that is in the way of the straight line there."""
        rng, tip = np.random.default_rng((31, seed)), tip_of(self.robot)
        while True:
            goal = start + rng.uniform(-0.4, 0.4, size=len(start))
            goal[0] = start[0] + rng.choice([-1.0, 1.0]) * rng.uniform(0.8, 1.5)
            goal = np.clip(goal, self.robot.limits.lower + 0.05, self.robot.limits.upper - 0.05)
            center = self.robot.pose(0.5 * (start + goal), tip)[:3, 3] + rng.uniform(-0.05, 0.05, size=3)
            exact = self.clearance.among(balls(center[None], np.array([RADIUS])))
            if (
                self.robot.pose(goal, tip)[2, 3] > LEAST_HEIGHT
                and min(exact.distance(start).distance, exact.distance(goal).distance) > CLEARANCE
                and exact.minimum_over(np.array([start, goal])).clearance.distance <= 0.0
                and not self.own.touching(goal)
            ):
                return goal, center

    def run(self, mode: str, seed: int, duration: float) -> tuple[dict[str, Any], np.ndarray]:
        """One run; what came of it, and the measured positions (T, 7)."""
        franka = self.franka
        robot = franka.Robot(HOST, franka.RealtimeConfig.kIgnore)
        start = np.array(robot.read_once().q)
        goal, center = self.problem(start, seed)
        settings = ss.ControllerSettings(seed=seed, period=PERIOD, output=mode, limit_margin=MARGIN)
        controller = ss.Controller(self.arm, settings)
        controller.set_obstacles(ss.Obstacles(center[None], np.array([RADIUS])))
        controller.set_goal(goal)
        rows, arrived, refused, lost = [], False, "", 0
        near, there = 0.0, start  # for how long it has been at the goal, and where since
        begin = time.perf_counter()
        try:
            impedance = franka.ControllerMode.JointImpedance
            active = (
                robot.start_torque_control()
                if mode == "torque"
                else robot.start_joint_position_control(impedance)
            )
            while len(rows) * PERIOD < duration and not arrived:
                state, span = active.readOnce()
                q, v = np.array(state.q), np.array(state.dq)
                rows.append(q)
                if mode == "position" and len(rows) <= 2:
                    q = np.array(
                        state.q_d
                    )  # a stream of positions begins with that of the robot, and goes on from it
                first = len(rows) == 1
                passed = 1 if first else round(span.to_sec() / PERIOD)  # cycles
                lost += max(0, passed - 1)
                for _ in range(min(1, passed) if mode == "torque" else 0 if first else passed):
                    controller.step(q, v)
                command = controller.command
                if mode == "position" and first:
                    out = franka.JointPositions(q.tolist())
                elif mode == "torque":
                    out = franka.Torques(command.torque_without_gravity.tolist())
                else:
                    out = franka.JointPositions(command.position.tolist())
                if np.abs(q - goal).max() < TOLERANCE and np.abs(q - there).max() < REST:
                    near += max(PERIOD, span.to_sec())
                else:
                    near, there = 0.0, q
                arrived = near >= HOLD
                out.motion_finished = arrived
                active.writeOnce(out)
        except (franka.FrankaException, RuntimeError) as error:
            refused = str(error)
        wall = time.perf_counter() - begin
        path = np.array(rows) if rows else start[None]
        exact = self.clearance.among(balls(center[None], np.array([RADIUS])))
        ball = exact.decided_minimum(path).clearance.distance
        own = self.own.minimum_over(path)
        return {
            "seed": seed,
            "accepted": not refused,
            "refused": refused,
            "cycles": len(rows),
            "wall_s": wall,
            "lost_cycles": lost,
            "arrived": arrived,
            "error_rad": float(np.abs(path[-1] - goal).max()),
            "min_clearance_m": float(ball),
            "contact": bool(ball <= 0.0 or own.distance <= 0.0),
            "last": controller.explain(),
        }, path


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--mode", choices=("torque", "position"), default="torque")
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--duration", type=float, default=20.0, help="of a run at most, robot's time [s]")
    parser.add_argument("--seed", type=int, default=0, help="of the first run")
    parser.add_argument("--cache", type=Path, default=cache_root() / "franka-server", help="folder")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="keeps logs and measured motions there")
    parser.add_argument("--json", metavar="FILE")
    given = parser.parse_args()
    environment = Environment(given.cache)
    driver = Driver(environment)
    logs = given.keep or given.cache / "logs"
    logs.mkdir(parents=True, exist_ok=True)
    runs = []
    for seed in range(given.seed, given.seed + given.runs):
        log = logs / f"{given.mode}-{seed}.log"
        with server(environment, log):
            found, path = driver.run(given.mode, seed, given.duration)
        found["server"] = said(log.read_text(encoding="utf-8"))
        if given.keep:
            np.save(logs / f"{given.mode}-{seed}.npy", path)
        runs.append(found)
        print(line(found), *found["server"][:3], sep="\n    ", flush=True)
    document = {
        "version": ss.__version__,
        "mode": given.mode,
        "runs": len(runs),
        **{name: sum(run[name] for run in runs) for name in ("accepted", "arrived", "contact")},
        "details": runs,
    }
    print(json.dumps({k: v for k, v in document.items() if k != "details"}))
    if given.json:
        Path(given.json).write_text(json.dumps(document, indent=1), encoding="utf-8")
    return 0 if document["accepted"] == document["arrived"] == len(runs) and not document["contact"] else 1


def line(run: dict[str, Any]) -> str:
    """One run in words."""
    accepted = "accepted" if run["accepted"] else f"REFUSED: {run['refused']}"
    arrived = "arrived" if run["arrived"] else f"{run['error_rad']:.3f} rad short"
    clearance = f"clearance {1e3 * run['min_clearance_m']:.1f} mm"
    return f"run {run['seed']}: {accepted}; {run['cycles']} cycles, {run['lost_cycles']} lost; {arrived}; {clearance}"


def said(log: str) -> list[str]:
    """Warnings and errors of a server's log."""
    return [line for line in log.splitlines() if line.startswith(("WARNING", "ERROR"))]


if __name__ == "__main__":
    sys.exit(main())
