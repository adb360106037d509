"""`MuJoCo`: the simulator in a process of its own, with real sockets and a real loop."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import sidestep as ss
from sidestep._core import RobotPort
from sidestep.drivers import MuJoCo
from sidestep.loop import Loop, RunEnd
from sidestep.simulation import Simulation
from support.busy_machine import PATIENT
from support.planar_scenario import planar_scenario

SCENARIO = "planar-one-obstacle"


def has_ended(pid: int, within: float = 10.0) -> bool:
    """Whether a process that need not be ours is gone."""
    until = time.monotonic() + within
    while time.monotonic() < until:
        state = Path(f"/proc/{pid}/stat")
        if not state.exists() or state.read_text().rsplit(")", 1)[1].split()[0] == "Z":
            return True
        time.sleep(0.02)
    return False


def test_two_programs_move_as_one_process_does(tmp_path: Path) -> None:
    scenario, parts = planar_scenario()
    with MuJoCo(scenario, speed=0.0, motion=tmp_path / "motion.npz") as driver:
        assert driver.description.joints == list(parts.robot.coordinate_names)
        assert not driver.description.real_time
        report = ss.run(parts.mover, driver, settings=PATIENT)
    assert report.end == RunEnd.arrived
    assert report.lost == 0
    assert driver.report["limits_exceeded"] == []
    with np.load(tmp_path / "motion.npz") as rows:
        q, torque = rows["q"], rows["torque"]
    _, again = planar_scenario()
    run = Simulation(again.robot, timestep=0.001, visuals=False).run(
        again.driver, again.start, again.goal, len(q) * 0.001, arrival=None
    )
    # The loop steps thrice before the first motion, and gravity and masses are those of the core, not MuJoCo's.
    moved = np.flatnonzero(np.abs(q - again.start).max(axis=1) > 0.0)[0]
    same = np.flatnonzero(np.abs(run.q - again.start).max(axis=1) > 0.0)[0]
    count = min(len(q) - moved, len(run.q) - same, 1500)
    assert count > 500
    np.testing.assert_allclose(q[moved : moved + count], run.q[same : same + count], atol=2e-4)
    assert np.isfinite(torque).all()


def test_a_late_and_lossy_connection_is_coped_with_and_repeats(tmp_path: Path) -> None:
    ends, motions = [], []
    for _ in range(2):
        scenario, parts = planar_scenario()
        motion = tmp_path / "motion.npz"
        with MuJoCo(
            scenario, delay=(0.001, 0.005), jitter=0.0005, loss=0.1, seed=3, speed=0.0, motion=motion
        ) as driver:
            ends.append(ss.run(parts.mover, driver, duration=20.0, settings=PATIENT).end)
        assert driver.report["limits_exceeded"] == []
        assert driver.report["messages"]["to_driver"]["lost"] > 50
        with np.load(motion) as rows:
            motions.append(rows["q"])
        assert np.abs(motions[-1][-1] - parts.goal).max() < 0.02
    assert ends == [RunEnd.arrived] * 2
    count = min(map(len, motions)) - 300  # how long the last cycles take is the machine's
    np.testing.assert_array_equal(motions[0][:count], motions[1][:count])


def test_paced_it_runs_by_the_machines_clock() -> None:
    scenario, parts = planar_scenario()
    with MuJoCo(scenario, hold=500) as driver:
        assert driver.description.real_time
        begin = time.monotonic()
        report = ss.run(parts.mover, driver, until=None, duration=0.3, settings=PATIENT)
        assert time.monotonic() - begin >= 0.3
    assert report.end == RunEnd.duration
    assert driver.report["simulated_s"] >= 0.3


def test_a_simulator_that_is_killed_ends_the_run() -> None:
    scenario, parts = planar_scenario()
    with MuJoCo(scenario, speed=0.0) as driver:
        # A busy system takes its time to close what a killed program held, and nothing comes until then.
        loop = Loop(parts.mover, driver, PATIENT)
        loop.start()
        time.sleep(0.05)
        os.kill(driver.pid, signal.SIGKILL)
        report = loop.finish()
    assert report.end == RunEnd.state_lost
    assert report.why.startswith("the connection to the robot is gone: ")
    assert driver.report == {}


def test_it_does_not_outlive_a_program_that_is_killed() -> None:
    code = (
        "import os, signal, sidestep as ss\n"
        "driver = ss.drivers.MuJoCo('planar-one-obstacle')\n"
        "print(driver.pid, flush=True)\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    killed = subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE, check=False)
    assert killed.returncode == -signal.SIGKILL
    assert has_ended(int(killed.stdout))


def test_several_run_side_by_side() -> None:
    with MuJoCo("planar2") as one, MuJoCo("planar-one-obstacle") as two:
        assert one.pid != two.pid
        assert one.description.name == two.description.name
    assert one.report["address"] != two.report["address"]


def test_what_it_cannot_simulate_is_said() -> None:
    with pytest.raises(RuntimeError, match="did not start: error: 'nothing' is no file, no shipped scenario"):
        MuJoCo("nothing")


def test_a_port_refuses_what_is_not_allowed(tmp_path: Path) -> None:
    robot = ss.Robot.named("planar2")
    words = {"name": "planar2", "joints": list(robot.coordinate_names), "limits": robot.limits}
    address = f"unix:{tmp_path / 'robot'}"
    with pytest.raises(ValueError, match="period is 0"):
        RobotPort(address, **words, outputs=["torque"], period=0.0)
    with pytest.raises(ValueError, match="no address of this machine's loopback"):
        RobotPort("tcp:192.0.2.1:5000", **words, outputs=["torque"], period=0.001)
    port = RobotPort(address, **words, outputs=["torque"], period=0.001)
    with pytest.raises(OSError, match="already in use"):
        RobotPort(address, **words, outputs=["torque"], period=0.001)
    assert port.receive(0.0) is None
    assert port.num_connections == 0
    with pytest.raises(ValueError, match="v"):
        port.send_state(0, 0.0, q=[0.0, 0.0], v=[0.0])
