"""Ctrl-C ends work of the core, and two threads are not let into one object."""

import os
import signal
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import sidestep as ss
from sidestep import thesis
from sidestep._core import PlanStatus
from sidestep.planning import PathPlanner, PlannerSettings
from sidestep.system import GeometricSystem
from support import planar_problems
from support.programs import program

pytestmark = pytest.mark.slow

LONG = {
    "rollout": "thesis.rollout(system, q, 0 * q, q + 1, none, steps=20_000_000)",
    "rollout_batch": "thesis.rollout_batch(system, rows, 0 * rows, rows, none, steps=5_000_000, threads=2)",
    "plan": "planner.plan([0, 0, 0], [1.5, 0, 0], wall)",
    "guide": "guide.set_goal([1.5, 0, 0]), guide.set_obstacles(wall), guide.step([0, 0, 0], 0.0)",
    "finish": "run.finish()",
    "integrate": "ss.integrate(stepped, q, 0 * q, steps=10_000_000)",
    "integrate_batch": "ss.integrate_batch(many, rows, 0 * rows, steps=9_000_000, threads=2)",
    "refine_cover": "refine(steps=10**9)",
}

PROGRAM = """
import signal, sys, time
import numpy as np
import sidestep as ss
from support import planar_problems
from sidestep._core import refine_cover
from sidestep import thesis
from sidestep.loop import Loop
from sidestep.planning import OnlinePlanner, PathPlanner, PlannerSettings
from sidestep.system import GeometricSystem

robot = ss.Robot.named("planar3")
body = ss.Body(**planar_problems.BODY)
q, none = np.array([0.1, 0.2, 0.3]), ss.Obstacles.none()
system, rows = GeometricSystem([], robot=robot), np.tile(q, (4, 1))
angles = np.linspace(0.0, 2.0 * np.pi, 400)
wall = ss.Obstacles([[r * np.cos(0.75), r * np.sin(0.75), 0.0] for r in np.linspace(0.45, 1.6, 40)], 0.05)
settings = PlannerSettings(max_nodes=1_000_000, max_iterations=2_000_000_000)
planner = PathPlanner(robot, body, settings=settings)
guide = OnlinePlanner(robot, body, planner=settings, synchronous=True)
arm = ss.Arm.from_robot(robot)
moving = ss.Controller(arm)
moving.set_obstacles(none)
run = Loop(moving, ss.drivers.Ideal(arm, q))
run.start()
stepped, *many = (ss.Controller(arm, ss.ControllerSettings(synchronous=True)) for _ in range(5))


def refine(steps):
    grid = np.random.default_rng(0).normal(size=(4, 4, 4))
    points = np.random.default_rng(1).normal(size=(50, 3))
    up = points / np.linalg.norm(points, axis=1)[:, None]
    refine_cover(origin=[-1, -1, -1], spacing=0.6, values=grid, points=points, multipliers=np.zeros(50),
                 directions=[up], centres=[[0, 0, 0]], shapes=[np.eye(3)], steps=steps, first_rate=1e-3,
                 last_rate=1e-4, stiffness=1.0, multiplier_steps=10, margin=0.0, unit=0.01, area=1.0, slimness=0.1)


signal.signal(signal.SIGINT, signal.default_int_handler)
print("begins", flush=True)
try:
    {work}
except KeyboardInterrupt:
    print("interrupted", flush=True)
else:
    print("ended by itself", flush=True)
run.stop()
assert len(run.finish().taken) < 100_000
moved = thesis.rollout(system, q, 0 * q, q + 0.1, none, steps=5)
assert np.isfinite(moved.q).all() and len(moved.time) == 6
print("goes on", flush=True)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="SIGINT cannot be sent to one process there")
@pytest.mark.parametrize("name", LONG)
def test_ctrl_c_ends_what_takes_long(name):
    source = PROGRAM.replace("{work}", LONG[name])
    with program([sys.executable, "-c", source], cwd=Path(__file__).parent) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "begins\n"
        time.sleep(0.3)
        begin = time.monotonic()
        process.send_signal(signal.SIGINT)
        assert process.stdout.readline() == "interrupted\n"
        assert time.monotonic() - begin < 5.0  # 0.1 s on a machine that is free; the work takes far longer
        assert process.stdout.readline() == "goes on\n"
        assert process.wait(60.0) == 0


def test_a_handler_that_does_not_raise_does_not_end_the_work():
    system = GeometricSystem([], robot=ss.Robot.named("planar2"))
    seen = []
    before = signal.signal(signal.SIGINT, lambda *_: seen.append(True))
    try:
        timer = threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT))
        timer.start()
        motion = thesis.rollout(system, [0, 0], [0, 0], [1, 1], ss.Obstacles.none(), steps=1_500_000)
        timer.join()
    finally:
        signal.signal(signal.SIGINT, before)
    assert seen == [True]
    assert np.isfinite(motion.q).all()


def test_two_threads_are_not_let_into_one_planner():
    robot, body = ss.Robot.named("planar3"), ss.Body(**planar_problems.BODY)
    wall = ss.Obstacles([[r * np.cos(0.75), r * np.sin(0.75), 0.0] for r in np.linspace(0.45, 1.6, 40)], 0.05)
    many = 2_000_000_000
    settings = PlannerSettings(max_nodes=1_000_000, max_iterations=many, max_checks=many, max_seconds=3.0)
    planner, plans = PathPlanner(robot, body, settings=settings), []
    thread = threading.Thread(target=lambda: plans.append(planner.plan([0, 0, 0], [1.5, 0, 0], wall)))
    thread.start()
    time.sleep(0.3)
    with pytest.raises(RuntimeError, match="the planner is in use by another thread"):
        planner.is_free([0, 0, 0], wall)
    thread.join()
    assert plans[0].status == PlanStatus.timeout
    assert planner.is_free([0, 0, 0], wall, margin=0.0)
