"""`sidestep.run`: a driver in Python and the ideal one, and every way a run can end."""

from __future__ import annotations

import functools
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sidestep as ss
from sidestep.drivers import Ideal, RobotDescription, RobotState, RobotStopped
from sidestep.loop import Loop, LoopSettings, RunEnd
from support.busy_machine import PATIENT

run = functools.partial(ss.run, settings=PATIENT)
REST = 0.01  # [rad/s] below a tenth of the arrival speed, at which the loop lets go


class PythonRobot:
    """An ideal robot written in Python, which goes wrong as a test wants."""

    def __init__(self, arm: ss.Arm, *, period: float = 0.002) -> None:
        self.description = RobotDescription(
            "robot of the test",
            period=period,
            outputs=["position"],
            joints=list(arm.robot.coordinate_names),
            paced=False,
        )
        self.q, self.v = np.array(arm.neutral), np.zeros(arm.robot.num_coordinates)
        self.calls: list[str] = []
        self.fault: Callable[[int], None] = lambda read: None
        self.reads = 0

    def start(self, output: str) -> None:
        self.calls.append(f"start {output}")

    def read(self, timeout: float) -> RobotState | None:
        self.reads += 1
        self.fault(self.reads)
        return RobotState(self.q, self.v, time=time.monotonic())

    def write(self, command: ss.Command) -> None:
        self.v, self.q = command.velocity, command.position

    def stop(self) -> None:
        self.calls.append("stop")


@pytest.fixture(scope="module")
def arm() -> ss.Arm:
    return ss.Arm.load("planar3")


def controller_of(arm: ss.Arm, *, period: float = 0.002, output: str = "position") -> ss.Controller:
    controller = ss.Controller(arm, ss.ControllerSettings(output=output, period=period))
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(arm.neutral + 0.3)
    return controller


def test_a_driver_in_python_is_led_to_the_goal_and_back(arm: ss.Arm) -> None:
    controller, robot = controller_of(arm), PythonRobot(arm)
    report = run(controller, robot)
    assert report.end == RunEnd.arrived
    assert report.is_success
    assert report.at_rest
    assert robot.calls == ["start position", "stop"]
    assert np.abs(robot.q - arm.neutral - 0.3).max() < 0.01  # ArrivalSettings.joint
    assert len(report.late) == len(report.taken) == report.cycles > 100
    controller.set_goal(arm.neutral)
    assert run(controller, robot).end == RunEnd.arrived
    assert np.abs(robot.q - arm.neutral).max() < 0.01


def test_the_ideal_robot_runs_faster_than_real_time(arm: ss.Arm) -> None:
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True, output="acceleration"))
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(arm.neutral + 0.3)
    driver = Ideal(arm, real_time=False)
    begin = time.monotonic()
    report = run(controller, driver, until=None, duration=20.0)
    assert report.end == RunEnd.duration
    assert report.cycles >= 20_000
    assert time.monotonic() - begin < 15.0  # [s] for 20 s of motion, on a busy machine


def test_a_function_says_when_a_run_is_done(arm: ss.Arm) -> None:
    controller, robot = controller_of(arm), PythonRobot(arm)
    done: list[float] = []  # where it was when the function said so, which a busy machine asks late

    def until(state: RobotState) -> bool:
        if state.q[0] > arm.neutral[0] + 0.1:
            done.append(state.q[0])
        return bool(done)

    report = run(controller, robot, until=until)
    assert report.end == RunEnd.arrived
    assert report.why == "until says so"
    assert arm.neutral[0] + 0.1 < done[0] <= robot.q[0] < done[0] + 0.19
    assert np.abs(robot.v).max() < REST


def test_an_exception_comes_out_once_the_arm_is_at_rest(arm: ss.Arm) -> None:
    controller, robot = controller_of(arm), PythonRobot(arm)

    def until(state: RobotState) -> bool:
        if state.q[0] > arm.neutral[0] + 0.1:
            raise ZeroDivisionError("of the program around it")
        return False

    with pytest.raises(ZeroDivisionError, match="of the program around it"):
        run(controller, robot, until=until)
    assert robot.calls[-1] == "stop"
    assert np.abs(robot.v).max() < REST
    assert not controller.is_paused


@pytest.fixture
def hears_interrupts() -> Iterator[None]:
    """Ctrl-C is heard also where the tests' own processes are made deaf to it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("hears_interrupts")
def test_ctrl_c_brings_the_arm_to_rest(arm: ss.Arm) -> None:
    controller, robot = controller_of(arm), PythonRobot(arm)
    moving = threading.Event()

    def fault(read: int) -> None:
        if read == 150:
            moving.set()

    robot.fault = fault

    def press() -> None:
        moving.wait(10.0)
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=press)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        run(controller, robot)
    thread.join()
    assert robot.calls == ["start position", "stop"]
    assert np.abs(robot.v).max() < REST
    assert run(controller, robot).end == RunEnd.arrived  # the goal was kept


def test_an_interrupt_as_the_run_begins_brings_the_arm_to_rest(
    arm: ss.Arm, monkeypatch: pytest.MonkeyPatch
) -> None:
    class InterruptedAtStart:
        """A loop whose start hears Ctrl-C once the run has begun."""

        def __init__(self, *arguments: Any, **more: Any) -> None:
            self._loop = Loop(*arguments, **more)

        def start(self) -> None:
            self._loop.start()
            raise KeyboardInterrupt

        def __getattr__(self, name: str) -> Any:
            return getattr(self._loop, name)

    monkeypatch.setattr(sys.modules["sidestep.loop.run"], "Loop", InterruptedAtStart)
    controller, robot = controller_of(arm), PythonRobot(arm)
    with pytest.raises(KeyboardInterrupt):
        run(controller, robot)
    assert robot.calls == ["start position", "stop"]
    assert np.abs(robot.v).max() < REST
    assert np.abs(robot.q - arm.neutral).max() < 0.2  # [rad] the goal is 0.3 away


@pytest.mark.parametrize(
    ("error", "end", "words"),
    [
        (
            ConnectionResetError("the cable is out"),
            RunEnd.state_lost,
            "the connection to the robot is gone: the cable is out",
        ),
        (
            RobotStopped("a protective stop"),
            RunEnd.robot_stopped,
            "the robot has stopped itself: a protective stop",
        ),
    ],
)
def test_what_a_driver_raises_ends_the_run(arm: ss.Arm, error: Exception, end: RunEnd, words: str) -> None:
    controller, robot = controller_of(arm), PythonRobot(arm)

    def fault(read: int) -> None:
        if read == 50:
            raise error

    robot.fault = fault
    report = run(controller, robot)
    assert report.end == end
    assert report.why == words
    assert not report.is_success
    assert robot.calls == ["start position", "stop"]


def test_a_start_that_fails_is_raised_as_it_is(arm: ss.Arm) -> None:
    class Locked(PythonRobot):
        def start(self, output: str) -> None:
            raise PermissionError("the brakes are on")

    with pytest.raises(PermissionError, match="the brakes are on"):
        run(controller_of(arm), Locked(arm))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"outputs": ["torque"]}, "takes torque, the controller's output is position"),
        ({"period": 0.004}, "the controller's period is 0.002 s"),
        ({"joints": ["a", "b", "c"]}, "are a, b, c; those of arm 'planar3'"),
    ],
)
def test_what_does_not_fit_is_refused(arm: ss.Arm, change: dict[str, Any], words: str) -> None:
    robot = PythonRobot(arm)
    robot.description = RobotDescription(
        "other", **({"period": 0.002, "outputs": ["position"], "joints": robot.description.joints} | change)
    )
    with pytest.raises(ValueError, match=words):
        run(controller_of(arm), robot)
    assert robot.calls == []


def test_nobody_moves_among_obstacles_that_nobody_told(arm: ss.Arm) -> None:
    controller = ss.Controller(arm, ss.ControllerSettings(output="position", period=0.002))
    robot = PythonRobot(arm)
    with pytest.raises(RuntimeError, match="no obstacles are known"):
        run(controller, robot, settings=LoopSettings(start_timeout=0.05))
    assert robot.calls == []


def test_a_start_that_fails_leaves_the_controller_to_the_next_run(arm: ss.Arm, tmp_path: Path) -> None:
    controller = ss.Controller(arm, ss.ControllerSettings(output="position", period=0.002))
    impatient = LoopSettings(start_timeout=0.05)
    with pytest.raises(RuntimeError, match="no obstacles are known") as kept:  # its frames hold the loop
        run(controller, PythonRobot(arm), settings=impatient, record=tmp_path / "run.mcap")
    assert kept.value is not None
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(arm.neutral + 0.3)
    assert run(controller, PythonRobot(arm)).end == RunEnd.arrived


def test_what_is_no_driver_and_no_condition_is_named(arm: ss.Arm) -> None:
    with pytest.raises(TypeError, match="lacks 'description'"):
        run(controller_of(arm), object())
    with pytest.raises(TypeError, match="until is 'soon'"):
        run(controller_of(arm), PythonRobot(arm), until="soon")
    with pytest.raises(TypeError, match="supervisor is 'yes', must be a Supervisor, True or False"):
        run(controller_of(arm), PythonRobot(arm), supervisor="yes")
    with pytest.raises(ValueError, match=r"longest_gap is 0"):
        run(controller_of(arm), PythonRobot(arm), settings=LoopSettings(longest_gap=0.0))
    with pytest.raises(ValueError, match="outputs"):
        RobotDescription("robot", period=0.001, outputs=["force"])


def test_a_run_is_recorded_and_replayed(arm: ss.Arm, tmp_path: Any) -> None:
    path = tmp_path / "run.mcap"
    report = run(controller_of(arm), PythonRobot(arm), record=path)
    result = ss.replay(path)
    assert result.equal
    assert result.complete
    assert result.steps >= report.cycles


def test_the_last_half_minute_of_a_run_is_kept(
    arm: ss.Arm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path / "cache"))
    report = run(controller_of(arm), PythonRobot(arm))
    kept = ss.load_recording(tmp_path / "cache" / "black-box" / "planar3")
    assert abs(len(kept.time) - report.cycles) <= 5  # and those before the first motion
    np.testing.assert_allclose(kept.q[-1], arm.neutral + 0.3, atol=0.01)
    run(controller_of(arm), PythonRobot(arm), black_box=tmp_path / "box")
    assert list((tmp_path / "box").iterdir())
    run(controller_of(arm), PythonRobot(arm), black_box=False)
    with pytest.warns(RuntimeWarning, match="no black box of this run") as warned:
        run(controller_of(arm), PythonRobot(arm), black_box="/proc/nowhere")
    assert warned[0].filename == __file__


def test_a_controller_runs_on_one_robot_at_a_time(arm: ss.Arm) -> None:
    controller, robot = controller_of(arm), PythonRobot(arm)
    loop = Loop(controller, robot, PATIENT)
    with pytest.raises(RuntimeError, match="in use"):
        Loop(controller, PythonRobot(arm))
    loop.start()
    assert loop.is_running
    loop.stop()
    assert loop.finish().end == RunEnd.stopped
