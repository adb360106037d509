"""The driver of Franka's robots, against a stand-in of Franka's library that enforces the robot's rules."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import sidestep as ss
from sidestep.drivers import Franka, RobotStopped, franka
from support.franka_robot import START, CommandException, FrankaRobot, NetworkException, RobotMode

OUTPUTS = ("torque", "velocity", "position")
GOAL = START + np.array([0.6, 0.3, -0.4, 0.3, 0.3, 0.3, -0.3])
# As in docs/how-to/franka.md.
MARGIN = 0.2


@pytest.fixture
def robot(monkeypatch: pytest.MonkeyPatch) -> FrankaRobot:
    robot = FrankaRobot()
    monkeypatch.setattr(franka, "time", robot)  # the driver's clock is the robot's
    return robot


@pytest.fixture
def driver(robot: FrankaRobot) -> Iterator[Franka]:
    with Franka("robot", library=robot) as driver:
        yield driver


@pytest.fixture(scope="module")
def arm() -> ss.Arm:
    return ss.Arm.load("fr3")


def controller_for(arm: ss.Arm, output: str) -> ss.Controller:
    settings = ss.ControllerSettings(output=output, limit_margin=MARGIN, synchronous=True)
    controller = ss.Controller(arm, settings)
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(GOAL)
    return controller


def drive(
    driver: Franka, robot: FrankaRobot, controller: ss.Controller, *, delays: float = 0.0, seed: int = 0
) -> float:
    """Moves for 3 s; in a share `delays` of the cycles 2 to 10 ms late, before or after the step. The error [rad]."""
    rng, end = np.random.default_rng(seed), robot.now + 3.0
    while robot.now < end:
        if rng.random() < 0.5 * delays:
            robot.sleep(rng.uniform(0.002, 0.01))
        state = driver.read()
        for _ in range(1 + state.lost_cycles):
            command = controller.step(state.q, state.v)
        robot.sleep(0.0002)
        if rng.random() < 0.5 * delays:
            robot.sleep(rng.uniform(0.002, 0.01))
        driver.write(command)
    return float(np.abs(robot.q - GOAL).max())


@pytest.mark.parametrize("output", OUTPUTS)
def test_reaches_its_goal(output: str, driver: Franka, robot: FrankaRobot, arm: ss.Arm) -> None:
    driver.start(output)
    assert drive(driver, robot, controller_for(arm, output)) < 1e-3
    assert (robot.reflex, robot.lost, driver.late) == ("", 0, 0)
    driver.stop()
    assert robot.mode == RobotMode.Idle


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("output", OUTPUTS)
def test_goes_on_after_lost_cycles(
    output: str, seed: int, driver: Franka, robot: FrankaRobot, arm: ss.Arm
) -> None:
    driver.start(output)
    assert drive(driver, robot, controller_for(arm, output), delays=0.01, seed=seed) < 5e-3
    assert robot.reflex == ""
    assert robot.lost > 50  # of 3,000


def test_the_stand_in_refuses_what_does_not_go_on_from_there(
    driver: Franka, robot: FrankaRobot, arm: ss.Arm, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(driver, "_next", lambda command: command.position)
    driver.start("position")
    with pytest.raises(RobotStopped, match="discontinuity"):
        drive(driver, robot, controller_for(arm, "position"), delays=0.01)


def test_an_answer_that_would_come_late_is_not_sent(driver: Franka, robot: FrankaRobot, arm: ss.Arm) -> None:
    controller = controller_for(arm, "velocity")
    driver.start("velocity")
    for late in (False, False, True, False):
        state = driver.read()
        robot.sleep(0.0008 if late else 0.0002)
        driver.write(controller.step(state.q, state.v))
    assert driver.late == 1
    assert driver.read().lost_cycles == 0
    assert robot.lost == 1


def test_lost_cycles_are_counted_and_the_first_state_after_is_not_answered(
    driver: Franka, robot: FrankaRobot, arm: ss.Arm
) -> None:
    controller = controller_for(arm, "torque")
    driver.start("torque")
    lost = 0
    for pause in (0.0, 0.0, 0.0045, 0.0, 0.0):
        state = driver.read()
        lost += state.lost_cycles
        driver.write(controller.step(state.q, state.v))
        robot.sleep(pause)
    driver.read()
    assert lost == robot.lost == 4  # 3 that passed while it was away, and the first after them


@pytest.mark.parametrize("output", OUTPUTS)
def test_says_what_the_robot_goes_on_from(output: str, driver: Franka, robot: FrankaRobot) -> None:
    before = driver.read()
    np.testing.assert_allclose(before.q, START, atol=1e-6)  # single precision
    np.testing.assert_allclose(before.torque, robot.model.bias(START, np.zeros(7)), atol=1e-4)
    assert np.isnan(before.told_position).all()
    driver.start(output)
    state = driver.read()
    assert state.lost_cycles == 0
    assert state.time == pytest.approx(robot.now)
    if output == "position":
        np.testing.assert_allclose(state.told_position, START, atol=1e-6)
    else:
        assert np.isnan(state.told_position).all()
    if output != "torque":
        np.testing.assert_array_equal([state.told_velocity, state.told_acceleration], np.zeros((2, 7)))


def test_a_reflex_says_why_and_recovers_on_request(driver: Franka, robot: FrankaRobot, arm: ss.Arm) -> None:
    controller = controller_for(arm, "torque")
    driver.start("torque")
    state = driver.read()
    driver.write(controller.step(state.q, state.v))
    robot.sleep(0.025)
    with pytest.raises(RobotStopped, match="communication_constraints_violation"):
        driver.read()
    with pytest.raises(RobotStopped, match=r"not controlled"):
        driver.write(controller.command)
    driver.stop()
    with pytest.raises(RobotStopped, match=r"in mode Reflex; recover\(\) ends a reflex"):
        driver.start("torque")
    driver.recover()
    driver.start("torque")
    assert robot.mode == RobotMode.Move
    assert robot.recovered == 1


def test_a_lost_connection_is_no_reflex(driver: Franka, robot: FrankaRobot) -> None:
    driver.start("position")
    driver.read()
    robot.unplugged = True
    with pytest.raises(NetworkException, match="Timeout"):
        driver.read()
    driver.stop()
    driver.stop()


def test_stops_a_motion_that_is_under_way(driver: Franka, robot: FrankaRobot, arm: ss.Arm) -> None:
    controller = controller_for(arm, "velocity")
    driver.start("velocity")
    while robot.now < 0.3:
        state = driver.read()
        driver.write(controller.step(state.q, state.v))
    assert np.abs(state.v).max() > 0.1
    driver.stop()
    assert (robot.mode, robot.reflex) == (RobotMode.Idle, "")


def test_names_what_cannot_be(robot: FrankaRobot, driver: Franka) -> None:
    with pytest.raises(NetworkException, match="no robot at nowhere"):
        Franka("nowhere", library=robot)
    with pytest.raises(
        ValueError, match="output is 'acceleration', allowed: 'torque', 'velocity' or 'position'"
    ):
        driver.start("acceleration")  # type: ignore[arg-type]
    robot.mode = RobotMode.Move
    with pytest.raises(RobotStopped, match="mode Move"):
        driver.start("torque")
    robot.mode = RobotMode.Idle
    robot.start_torque_control = lambda: (_ for _ in ()).throw(CommandException("rejected"))  # type: ignore[method-assign]
    with pytest.raises(RobotStopped, match="rejected"):
        driver.start("torque")


def test_describes_the_robot(driver: Franka, arm: ss.Arm) -> None:
    description = driver.description
    assert list(description.joints) == list(arm.robot.coordinate_names)
    assert description.period == 0.001
    assert list(description.outputs) == list(OUTPUTS)
    # The arm's own limits are within what the robot enforces: its file rounds the velocities.
    assert (franka.LIMITS.velocity >= arm.limits.velocity - 1e-9).all()
    assert (franka.LIMITS.upper >= arm.limits.upper).all()
    assert (franka.LIMITS.lower <= arm.limits.lower).all()
