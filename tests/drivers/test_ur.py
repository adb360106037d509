"""The UR driver: the real ur-rtde against the stand-in, each a process of its own."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from types import SimpleNamespace

import numpy as np
import pytest

import sidestep as ss
from sidestep.drivers import UR, RobotState, RobotStopped
from sidestep.drivers.ur_stand_in.process import StandInProcess
from sidestep.loop import RunEnd
from support.programs import program

pytest.importorskip("rtde_control", reason="needs ur-rtde, which has no package for this system")

# An address of this machine for this process alone: the ports are always the same.
ADDRESS = f"127.{51 + os.getpid() // 65000 % 100}.{os.getpid() // 255 % 255}.{1 + os.getpid() % 250}"
UNLOCK_AFTER = 1.5  # [s]; a UR takes 5
REACHED = 0.005  # [rad]


PATIENT = ss.loop.LoopSettings(longest_gap=1.0, state_timeout=0.5)  # other tests keep the machine busy


@pytest.fixture(scope="module")
def process() -> Iterator[StandInProcess]:
    with StandInProcess("--address", ADDRESS, "--unlock-after", str(UNLOCK_AFTER), "--real-time") as process:
        yield process


@pytest.fixture
def robot(process: StandInProcess) -> StandInProcess:
    for line in ("hear", "stop program", "switch on"):
        process.say(line)
    process.tell()  # has done it
    return process


@pytest.fixture(scope="module")
def connected(process: StandInProcess) -> Iterator[UR]:
    with UR(ADDRESS, watchdog=1.0) as driver:  # other tests keep the machine busy
        yield driver


@pytest.fixture
def driver(robot: StandInProcess, connected: UR) -> Iterator[UR]:
    yield connected
    connected.stop()


def controller_of(driver: UR, output: str, move: float) -> tuple[ss.Controller, np.ndarray]:
    """A controller whose goal is so far [rad] from where the arm is, and the goal."""
    state = driver.read(1.0)
    assert state is not None
    goal = state.q + np.array([move, 0.0, 0.0, 0.0, 0.0, move])
    settings = ss.ControllerSettings(output=output, period=driver.description.period, limit_margin=0.1)
    controller = ss.Controller(ss.Arm.load("ur10"), settings)
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(goal)
    return controller, goal


def run(
    controller: ss.Controller, driver: UR, until: Callable[[RobotState], bool] | None = None
) -> ss.loop.RunReport:
    """A run; another one where other tests held up this one for longer than the watchdog."""
    for _ in range(3):
        report = ss.run(controller, driver, until=until or ss.arrived, duration=10.0, settings=PATIENT)
        if report.end != RunEnd.late:
            break
    return report


def when_it_moves(robot: StandInProcess, line: str) -> Callable[[RobotState], bool]:
    """Types a line, once, as soon as a joint is faster than 0.2 rad/s; never ends the run."""
    typed: list[str] = []

    def look(state: RobotState) -> bool:
        if not typed and np.abs(state.v).max() > 0.2:
            typed.append(line)
            robot.say(line)
        return False

    return look


def test_it_says_what_the_robot_is(driver: UR) -> None:
    said = driver.description
    assert said.name == "UR10 (PolyScope 5.12.0.1101319)"
    assert said.joints == ss.Arm.load("ur10").robot.coordinate_names
    assert said.period == 0.002
    assert said.paced
    assert "its watchdog stops the program" in said.when_silent


def test_states_are_timed_and_whole(driver: UR) -> None:
    begin = time.monotonic()
    states = [driver.read(1.0) for _ in range(50)]
    assert None not in states
    times = np.array([state.time for state in states if state is not None])
    assert begin < times[-1] <= time.monotonic()
    periods = np.diff(times) / 0.002 - [state.lost_cycles for state in states[1:] if state is not None]
    assert np.median(periods) == pytest.approx(
        1.0, abs=0.01
    )  # the others are those at which the offset became better
    state = states[-1]
    assert state is not None
    np.testing.assert_allclose(state.told_position, state.q, atol=1e-6)  # at rest
    assert np.isnan(state.torque).all()  # a UR says currents
    assert None in [driver.read(0.0) for _ in range(20)]  # at once: 20 that waited would be 20 states


@pytest.mark.parametrize("output", ["position", "velocity"])
def test_the_arm_reaches_its_goal(robot: StandInProcess, driver: UR, output: str) -> None:
    controller, goal = controller_of(driver, output, 0.4)
    report = run(controller, driver)
    assert report.end == RunEnd.arrived, report.why
    time.sleep(0.2)  # the brake
    told = robot.tell()
    np.testing.assert_allclose(told["position"], goal, atol=REACHED)
    assert not told["playing"]
    assert told["protective stops"] == told["program errors"] == 0


def test_a_command_that_jumps_is_followed_within_the_acceleration(robot: StandInProcess, driver: UR) -> None:
    driver.start("position")
    goal = (
        np.array(robot.tell()["position"]) - 0.2
    )  # sent as it is: 60 rad/s², for which the robot would stop
    command = SimpleNamespace(position=goal, velocity=np.zeros(6), acceleration=np.zeros(6))
    end = time.monotonic() + 1.5
    while time.monotonic() < end:
        driver.read(0.1)
        driver.write(command)  # type: ignore[arg-type]
    told = robot.tell()
    np.testing.assert_allclose(told["position"], goal, atol=1e-4)  # 20 time constants of servoJ
    assert told["protective stops"] == 0


def test_a_protective_stop_ends_a_run_and_another_goes_on(robot: StandInProcess, driver: UR) -> None:
    controller, goal = controller_of(driver, "position", -0.8)
    begin = robot.tell()["time"]
    report = run(controller, driver, when_it_moves(robot, "protective stop"))
    assert report.end == RunEnd.robot_stopped
    assert "PROTECTIVE_STOP; find out why, then call recover()" in report.why
    with pytest.raises(RobotStopped, match="safety mode 3"):
        driver.start("position")
    driver.recover()
    assert robot.tell()["time"] - begin > UNLOCK_AFTER  # since the stop, which was later than the begin
    report = run(controller, driver)
    assert report.end == RunEnd.arrived, report.why
    time.sleep(0.2)
    np.testing.assert_allclose(robot.tell()["position"], goal, atol=REACHED)


def test_a_robot_that_does_not_unlock_says_why(robot: StandInProcess, driver: UR) -> None:
    robot.say("protective stop")
    with pytest.raises(
        RobotStopped, match=r"did not recover in 0.2 s.*Cannot unlock protective stop until 1.5s after"
    ):
        driver.recover(timeout=0.2)
    driver.recover()
    driver.recover()  # nothing to do


def test_an_emergency_stop_ends_elsewhere(robot: StandInProcess, driver: UR) -> None:
    driver.start("position")
    robot.say("emergency stop")
    with pytest.raises(RobotStopped, match="ROBOT_EMERGENCY_STOP; release it"):
        wait(driver)
    with pytest.raises(RobotStopped, match="ROBOT_EMERGENCY_STOP"):
        driver.recover()
    robot.say("release")
    time.sleep(0.1)
    with pytest.raises(RobotStopped, match="robot mode 3: POWER_OFF; switch on and release the brakes"):
        driver.start("position")
    robot.say("switch on")
    time.sleep(0.1)
    driver.start("position")


@pytest.mark.parametrize(
    ("typed", "words"),
    [
        ("stop program", "its program has ended: on the pendant"),
        ("freedrive", "the freedrive button is pressed"),
    ],
)
def test_what_happens_on_the_pendant_ends_the_control(
    robot: StandInProcess, driver: UR, typed: str, words: str
) -> None:
    driver.start("velocity")
    robot.say(typed)
    with pytest.raises(RobotStopped, match=words):
        wait(driver)
    robot.say("freedrive end")
    time.sleep(0.1)
    driver.start("velocity")


def wait(driver: UR) -> None:
    """Reads until the driver has something to say."""
    for _ in range(500):
        driver.read(0.1)
    pytest.fail("the driver says nothing")


CLIENT = """
import sys, numpy as np
from types import SimpleNamespace
from sidestep.drivers import UR
driver = UR(sys.argv[1], watchdog=0.1)
driver.start("velocity")
print("moves", flush=True)
while True:
    driver.read(0.1)
    driver.write(SimpleNamespace(velocity=np.array([0.5, 0, 0, 0, 0, 0])))
"""


def test_a_client_that_is_killed_leaves_an_arm_that_brakes(robot: StandInProcess) -> None:
    said = len(robot.log)
    with program([sys.executable, "-c", CLIENT, ADDRESS]) as client:
        assert client.stdout is not None
        assert client.stdout.readline() == "moves\n"
        time.sleep(0.3)
        told = robot.tell()
    assert told["velocity"][0] == pytest.approx(0.5, abs=0.01)
    killed = robot.tell()
    end = time.monotonic() + 10.0
    while (after := robot.tell())["playing"] or np.abs(after["velocity"]).max() > 1e-4:
        assert time.monotonic() < end, after
        time.sleep(0.01)
    assert any("the watchdog ended the program" in line for line in robot.log[said:])
    # At most the watchdog, the brake, and what was sent and not yet read (0.1 s), at 0.5 rad/s.
    assert after["position"][0] - killed["position"][0] < 0.5 * (0.1 + 0.025 + 0.1)


def test_a_silent_robot_is_braked_and_let_go(robot: StandInProcess, driver: UR) -> None:
    controller, _ = controller_of(driver, "position", 0.8)
    begin = time.monotonic()
    report = run(controller, driver, when_it_moves(robot, "deaf"))
    assert report.end == RunEnd.state_lost
    assert time.monotonic() - begin < 5.0
    time.sleep(0.5)
    robot.say("hear")
    told = robot.tell()
    np.testing.assert_allclose(told["velocity"], 0.0, atol=1e-4)
    assert told["protective stops"] == 2  # of the tests before


def test_an_upload_that_fails_says_why(
    robot: StandInProcess, driver: UR, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse() -> None:
        raise RuntimeError("the script port is closed")

    control = SimpleNamespace(reuploadScript=refuse, isProgramRunning=lambda: False)
    monkeypatch.setattr(driver, "_control", control)
    with pytest.raises(RobotStopped, match="did not take the control program: the script port is closed"):
        driver.start("position")


def test_a_stop_that_the_robot_does_not_take_is_no_error(
    robot: StandInProcess, driver: UR, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def refuse(deceleration: float) -> None:
        asked.append(deceleration)
        raise RuntimeError("the connection was reset")

    driver.start("position")
    control = SimpleNamespace(servoStop=refuse, isConnected=lambda: True)
    with monkeypatch.context() as patch:
        patch.setattr(driver, "_control", control)
        driver.stop()
    assert asked == [10.0]


def test_another_arm_is_refused(robot: StandInProcess) -> None:
    with UR(ADDRESS, arm="ur5") as driver:
        with pytest.raises(
            ValueError, match=r"the robot has its flange at .* the arm 'ur5' at .* it is another arm"
        ):
            driver.start("position")
        assert not robot.tell()["playing"]  # nobody writes: its watchdog has not begun
    with pytest.raises(
        ValueError, match="the joints of the arm are joint1, joint2, joint3; those of a UR shoulder_pan_joint"
    ):
        UR(ADDRESS, arm="planar3")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"frequency": 250}, "frequency is 250, allowed are 125, 500"),
        ({"lookahead": 0.02}, "lookahead is 0.02, must be 0.03 to 0.2"),
        ({"gain": 3000.0}, "gain is 3000.0, must be 100 to 2000"),
        ({"acceleration": 0.0}, "acceleration is 0.0, must be 0.01 to 40"),
        ({"watchdog": 2.0}, "watchdog is 2.0, must be 0.02 to 1"),
    ],
)
def test_arguments_are_checked(arguments: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        UR("127.0.0.1", **arguments)  # type: ignore[arg-type]


def test_an_output_that_a_ur_does_not_take_is_refused(driver: UR) -> None:
    with pytest.raises(ValueError, match="a UR takes position or velocity, not 'torque'"):
        driver.start("torque")


def test_nobody_at_the_address() -> None:
    with pytest.raises(ConnectionError, match=r"no UR answers at 127\.0\.0\.9"):
        UR("127.0.0.9")


def test_a_box_whose_power_fails_ends_the_run() -> None:
    """Last: the stand-in is another one, and ends."""
    address = ADDRESS.rpartition(".")[0] + ".254"
    with StandInProcess("--address", address, "--real-time") as robot, UR(address, watchdog=1.0) as driver:
        controller, _ = controller_of(driver, "velocity", 0.8)
        report = run(controller, driver, when_it_moves(robot, "fail"))
        assert report.end == RunEnd.state_lost
        assert "the connection to the robot is gone" in report.why
        with pytest.raises(ConnectionError, match="closed the connection"):
            driver.read(0.1)
