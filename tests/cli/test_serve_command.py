"""`sidestep serve`: serves until Ctrl-C, and goes on after a run that a client has ended."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import sidestep as ss
from sidestep._core import RobotPort
from sidestep.cli.serve_command import loop_settings, open_driver, output_for, perception_of, serve_runs
from sidestep.drivers import RobotDescription, RobotState
from sidestep.link import Server
from sidestep.loop.child_process import hearing_ctrl_c
from sidestep.perception.camera_file import write_camera
from sidestep.perception.camera_record import CameraRecord
from support.programs import program

GOAL = [0.4, 0.5, -0.3]


@pytest.fixture
def address(tmp_path: Path) -> str:
    return str(tmp_path / "arm.sock")


@pytest.fixture
def serving(address: str) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "sidestep", "serve", "planar3", "--address", address]
    command += ["--output", "position", "--free", "--longest-gap", "10"]
    with program(hearing_ctrl_c(command)) as process:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert line.startswith(f"serving 'planar3' at unix:{address}; token: "), line
        yield process


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_moves_the_arm_and_ends_with_the_arm_at_rest(
    serving: subprocess.Popen[str], address: str, number: signal.Signals
) -> None:
    with ss.connect(address) as client:
        client.take_command()
        client.set_goal(GOAL)
        assert client.wait(ss.arrived, timeout=20.0)
        client.set_goal([-1.0, 0.5, -0.3])
        assert client.wait(lambda state: bool(abs(state.v).max() > 0.1), timeout=10.0)
        serving.send_signal(number)
        with pytest.raises((RuntimeError, ConnectionError)):
            client.wait(lambda state: False, timeout=10.0)
    said, _ = serving.communicate(timeout=10.0)
    assert "the run has ended (interrupted): Ctrl-C; the arm was at rest after" in said
    assert serving.returncode == 0


@pytest.mark.slow
def test_a_run_that_a_client_has_stopped_goes_on_when_it_resumes(
    serving: subprocess.Popen[str], address: str
) -> None:
    with ss.connect(address, name="tester") as client:
        client.take_command()
        client.set_goal(GOAL)
        client.stop_run("a look at the gripper")
        with pytest.raises(RuntimeError, match="tester asked for it: a look at the gripper"):
            client.wait(lambda state: False, timeout=10.0)
        client.resume()
        until = 50
        while "a run has begun" not in client.notices() and until > 0:
            client.next_cycle(after=client.cycle().number, timeout=0.2)
            until -= 1
        assert client.wait(ss.arrived, timeout=20.0)


@pytest.mark.slow
def test_a_stop_that_is_asked_for_twice_ends_one_run(serving: subprocess.Popen[str], address: str) -> None:
    with ss.connect(address) as client:
        client.take_command()
        client.set_goal(GOAL)
        client.stop_run("once")
        with pytest.raises(RuntimeError, match="asked for it: once"):
            client.wait(lambda state: False, timeout=10.0)
        client.stop_run("twice")
        client.resume()
        assert comes_true(lambda: "a run has begun" in client.notices())
        assert client.wait(ss.arrived, timeout=20.0)


class Robot:
    """An ideal robot in Python, in whose place a test puts its own steps."""

    def __init__(self, arm: ss.Arm) -> None:
        joints = list(arm.robot.coordinate_names)
        self.description = RobotDescription(
            "robot of the test", period=0.002, outputs=["position"], joints=joints, paced=False
        )
        self.q, self.v = np.array(arm.neutral), np.zeros(arm.robot.num_coordinates)
        self.rolls = 0.0  # [rad/s] which it says beside its own speed
        self.on_start: Callable[[], None] = lambda: None
        self.on_stop: Callable[[], None] = lambda: None

    def start(self, output: str) -> None:
        self.on_start()

    def read(self, timeout: float) -> RobotState | None:
        return RobotState(self.q, self.v + self.rolls, time=time.monotonic())

    def write(self, command: ss.Command) -> None:
        self.v, self.q = command.velocity, command.position

    def stop(self) -> None:
        self.on_stop()


@dataclass
class Ready:
    """What `serve_runs` needs, and what it says."""

    controller: ss.Controller
    robot: Robot
    server: Server
    said: io.StringIO

    def serve(self) -> bool:
        settings = loop_settings(10.0)
        settings.priority, settings.lock_memory, settings.stop_timeout = 0, False, 0.5
        return serve_runs(self.controller, self.robot, self.server, None, settings, Console(file=self.said))


@pytest.fixture
def ready(address: str) -> Iterator[Ready]:
    arm = ss.Arm.load("planar3")
    controller = ss.Controller(arm, ss.ControllerSettings(output="position", period=0.002))
    controller.set_obstacles(ss.Obstacles.none())
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield Ready(controller, Robot(arm), Server(controller, address), io.StringIO())
    signal.signal(signal.SIGINT, before)


def interrupt() -> None:
    """Ctrl-C for this program."""
    os.kill(os.getpid(), signal.SIGINT)


def comes_true(condition: Callable[[], bool], *, within: float = 10.0) -> bool:
    """Whether a condition holds within so long [s]."""
    until = time.monotonic() + within
    while not (holds := condition()) and time.monotonic() < until:
        time.sleep(0.005)
    return holds


@contextmanager
def beside(work: Callable[[], None]) -> Iterator[None]:
    """Does something in another thread; raises what it raised."""
    with ThreadPoolExecutor(1) as pool:
        done = pool.submit(work)
        yield
        done.result(20.0)


def test_a_robot_that_does_not_start_is_tried_once_a_second(ready: Ready) -> None:
    tries: list[float] = []

    def refuse() -> None:
        tries.append(time.monotonic())
        raise RuntimeError("the brakes are on")

    def end() -> None:
        assert comes_true(lambda: len(tries) >= 2)
        interrupt()

    ready.robot.on_start = refuse
    with beside(end):
        assert ready.serve()  # it has not moved
    assert len(tries) == 2
    assert tries[1] - tries[0] > 0.9  # [s] START_TIMEOUT, less what rounding takes
    assert ready.said.getvalue().count("waiting: the brakes are on") == 1


@pytest.mark.parametrize("rolls", [0.0, 1.0])
def test_a_second_interrupt_does_not_hide_whether_the_arm_rests(ready: Ready, rolls: float) -> None:
    def press_twice() -> None:
        assert comes_true(lambda: bool(abs(ready.robot.v).max() > 0.1))
        ready.robot.rolls = rolls
        interrupt()
        time.sleep(0.03)
        interrupt()

    ready.controller.set_goal(GOAL)
    with beside(press_twice):
        assert ready.serve() == (rolls == 0.0)
    rest = "at rest after" if rolls == 0.0 else "not at rest"
    assert "the run has ended (interrupted): Ctrl-C; the arm was " + rest in ready.said.getvalue()


def test_an_interrupt_while_the_robot_starts_is_no_error_of_it(ready: Ready) -> None:
    ready.robot.on_start = interrupt
    assert ready.serve()
    assert "the run has ended (interrupted): Ctrl-C; the arm was at rest" in ready.said.getvalue()


def test_a_stop_as_the_run_ends_is_of_that_run(ready: Ready, address: str) -> None:
    with ss.connect(address) as client:

        def ask_once_more() -> None:
            ready.robot.on_stop = lambda: None
            client.stop_run("twice")

        def lead() -> None:
            try:
                client.take_command()
                client.set_goal(GOAL)
                assert comes_true(lambda: bool(abs(ready.robot.v).max() > 0.1))
                client.stop_run("once")
                with pytest.raises(RuntimeError, match="asked for it: once"):
                    client.wait(lambda state: False, timeout=10.0)
                client.resume()
                assert comes_true(lambda: "a run has begun" in client.notices())
                assert client.wait(ss.arrived, timeout=20.0)
            finally:
                interrupt()

        ready.robot.on_stop = ask_once_more
        with beside(lead):
            assert ready.serve()
    assert "twice" not in ready.said.getvalue()


def test_a_run_that_went_wrong_counts_until_the_next(ready: Ready, address: str) -> None:
    def fail() -> None:
        raise RuntimeError("the brakes are on")

    with ss.connect(address) as client:

        def lead() -> None:
            try:
                client.take_command()
                client.set_goal(GOAL)
                assert comes_true(lambda: bool(abs(ready.robot.v).max() > 0.1))
                ready.robot.rolls = 1.0
                client.stop_run()
                with pytest.raises(RuntimeError, match="asked for it"):
                    client.wait(lambda state: False, timeout=10.0)
                ready.robot.rolls, ready.robot.on_start = 0.0, fail
                client.resume()
                assert comes_true(lambda: "waiting: the brakes are on" in ready.said.getvalue())
            finally:
                interrupt()

        with beside(lead):
            assert not ready.serve()


def test_what_cannot_be_served_is_one_line() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "sidestep", "serve", "planar3", "--driver", "puppet"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "driver is 'puppet'; there are franka, ideal, mujoco, replay, simulator, ur" in done.stderr


def test_a_driver_is_opened_by_its_name() -> None:
    arm = ss.Arm.load("planar3")
    with open_driver("Ideal", arm, None, period=0.002) as driver:
        assert driver.description.period == 0.002
    with (
        pytest.raises(ValueError, match="the driver ur needs --robot"),
        open_driver("ur", arm, None, period=None),
    ):
        pass


@pytest.mark.parametrize("name", ["simulator", "mujoco"])
def test_a_simulator_that_runs_is_driven(tmp_path: Path, name: str) -> None:
    arm = ss.Arm.load("planar3")
    robot = f"unix:{tmp_path / 'robot.sock'}"
    joints = arm.robot.coordinate_names
    port = RobotPort(
        robot, name="planar", joints=joints, limits=arm.robot.limits, outputs=["torque"], period=0.002
    )

    def answer() -> None:
        assert comes_true(lambda: port.receive(0.01) is None and port.num_connections > 0)

    with (
        beside(answer),
        open_driver(name, arm, robot, period=None) as driver,
    ):
        assert driver.description.name == "planar"
        assert driver.description.joints == joints


def test_without_torque_the_robots_first_output_is_sent() -> None:
    assert output_for("automatic", ["torque", "position"]) == "automatic"
    assert output_for("automatic", ["position", "velocity"]) == "position"
    assert output_for("velocity", ["position", "velocity"]) == "velocity"


def test_images_of_the_cameras_in_files_are_taken(tmp_path: Path) -> None:
    controller = ss.Controller(ss.Arm.load("planar3"))
    assert perception_of(controller, []) is None
    write_camera(tmp_path / "camera.json", CameraRecord("front", 4, 3, 4.0, 4.0, 1.5, 1.0, pose=np.eye(4)))
    perception = perception_of(controller, [tmp_path / "camera.json"])
    assert perception is not None
    assert [camera.name for camera in perception.cameras] == ["front"]
