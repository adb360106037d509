"""`Loop`: what may be asked beside it, and what is refused."""

from __future__ import annotations

import time
import typing

import numpy as np
import pytest

import sidestep as ss
from sidestep.loop import Loop, LoopSettings, ModelLoop, RunEnd, clock_lateness
from support.busy_machine import PATIENT

START, GOAL = np.array([0.2, 0.3]), np.array([0.8, -0.4])
PERIOD = 0.002


@pytest.fixture(scope="module")
def arm() -> ss.Arm:
    return ss.Arm.load("planar2")


def controller_of(
    arm: ss.Arm, goal: np.ndarray = GOAL, *, period: float = PERIOD, synchronous: bool = True
) -> ss.Controller:
    controller = ss.Controller(arm, ss.ControllerSettings(period=period, synchronous=synchronous))
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(goal)
    return controller


def test_it_keeps_the_machines_time(arm: ss.Arm) -> None:
    controller = controller_of(arm)
    begin = time.monotonic()
    loop = Loop(controller, ss.drivers.Ideal(arm, START, period=PERIOD), PATIENT, duration=0.3)
    loop.start()
    report = loop.finish()
    assert time.monotonic() - begin >= 0.3  # by the clock, never ahead of it
    assert not loop.is_running
    assert report.end == RunEnd.duration
    assert len(report.late) == len(report.taken) == report.cycles >= 150
    assert np.all(report.late >= 0.0)
    assert np.all(report.taken > 0.0)
    assert (
        report.missed <= np.sum((report.late > PERIOD) | (report.taken > 0.5 * PERIOD)) + report.cycles // 10
    )
    assert np.abs(loop.state().q - START).max() > 0.02


def test_only_the_times_of_the_last_cycles_are_kept(arm: ss.Arm) -> None:
    loop = Loop(
        controller_of(arm, period=0.001),
        ss.drivers.Ideal(arm, START, real_time=False),
        LoopSettings(kept_times=100, duration=2.0),
    )
    loop.start()
    report = loop.finish()
    assert report.cycles >= 2000
    assert len(report.late) == len(report.taken) == 100


@pytest.mark.parametrize("synchronous", [True, False])
def test_a_goal_may_be_replaced_meanwhile_and_a_run_be_left(arm: ss.Arm, synchronous: bool) -> None:
    controller = controller_of(arm, START, synchronous=synchronous)
    loop = Loop(controller, ss.drivers.Ideal(arm, START, period=PERIOD), PATIENT)
    loop.start()
    controller.set_goal(GOAL)
    for _ in range(1000):
        controller.set_obstacles(ss.Obstacles([[0.0, 0.0, 2.0]], 0.01))
        time.sleep(0.005)
        if np.abs(loop.state().q - START).max() > 0.05:
            break
    else:
        raise AssertionError("it did not go to the other goal")
    assert loop.is_running
    begin = time.monotonic()
    del loop  # stops the arm
    assert time.monotonic() - begin < 10.0
    left = controller.command  # usable, from where it has been left
    command = controller.step(left.position, left.velocity)
    assert command.status in (ss.SafetyStatus.ok, ss.SafetyStatus.limited)


def test_a_second_run_and_what_is_for_the_loop_are_refused_beside_one(arm: ss.Arm) -> None:
    controller, at_rest = controller_of(arm, START), np.zeros(2)
    controller.step(START, at_rest)
    loop = Loop(controller, ss.drivers.Ideal(arm, START, period=PERIOD), PATIENT)
    loop.start()
    for refused in (
        lambda: Loop(controller, ss.drivers.Ideal(arm, START, period=PERIOD)),
        lambda: controller.step(START, at_rest),
        lambda: controller.continue_from(START, at_rest, at_rest),
        lambda: ss.integrate(controller, START, at_rest, steps=1),
        controller.explain,
        lambda: controller.command,
        lambda: controller.values,
        lambda: controller.geometric_step,
    ):
        with pytest.raises(RuntimeError, match="the controller is in use: a Loop or another thread"):
            refused()
    assert loop.is_running
    loop.stop()
    assert loop.finish().end == RunEnd.stopped
    assert controller.step(START, at_rest).status == ss.SafetyStatus.ok


def test_stop_ends_a_run_between_steps_that_are_far_apart(arm: ss.Arm) -> None:
    robot = ss.drivers.Ideal(arm, START, period=0.1)
    loop = Loop(controller_of(arm, START, period=0.1), robot, PATIENT, duration=1e4)
    loop.start()
    loop.stop()
    begin = time.monotonic()
    assert loop.finish().cycles <= 5
    assert time.monotonic() - begin < 20.0  # [s] of 10,000


def test_the_clock_alone_is_waited_for_turn_by_turn() -> None:
    begin = time.monotonic()
    late = clock_lateness(0.2, period=0.002, priority=0)
    assert late.shape == (100,)
    assert time.monotonic() - begin >= 0.2
    assert np.all(late >= 0.0)
    assert np.median(late) < 0.02  # [s] of a busy machine
    with pytest.raises(ValueError, match="turns is 0"):
        clock_lateness(0.0)


def test_a_model_that_the_caller_moves_is_led_and_brought_to_rest(arm: ss.Arm) -> None:
    stepped, controller = controller_of(arm), controller_of(arm)
    loop, q, v = ModelLoop(controller), START, np.zeros(2)
    for k in range(200):
        masses = {} if k % 2 else {"mass_matrix": 1.2 * arm.mass_matrix(q), "bias": arm.bias(q, v)}
        expected = stepped.step(q, v, **masses, time=PERIOD * k)
        command = loop.cycle(q, v, **masses, time=PERIOD * k)
        np.testing.assert_array_equal(command.acceleration, expected.acceleration)
        np.testing.assert_array_equal(command.torque, expected.torque)
        assert controller.command.status == command.status  # free between two cycles
        v = v + PERIOD * command.acceleration
        q = q + PERIOD * v
    assert np.abs(v).max() > 0.05
    loop.stop(why="enough")
    cycles = 0
    while not loop.is_over:  # the caller may be slow, and tell no time: the cycles are the time
        command = loop.cycle(q, v)
        v = v + PERIOD * command.acceleration
        q = q + PERIOD * v
        cycles += 1
    assert 0.05 <= PERIOD * cycles < 1.5  # braked, and at rest for a while; not the timeout of 3 s
    assert loop.report().stop_time == pytest.approx(PERIOD * (cycles - 1), abs=2 * PERIOD)
    assert (loop.report().end, loop.report().why, loop.report().at_rest) == (RunEnd.stopped, "enough", True)
    assert np.abs(v).max() < 0.01
    with pytest.raises(RuntimeError, match="the run is over: enough"):
        loop.cycle(q, v)
    with pytest.raises(ValueError, match="mass_matrix and bias go together"):
        ModelLoop(controller).cycle(q, v, arm.mass_matrix(q))
    with pytest.raises(ValueError, match=r"q has shape \(3,\), expected \(2,\)"):
        ModelLoop(controller).cycle(np.zeros(3), v)


def test_a_robot_that_says_its_dynamics_gets_the_torques_for_them(arm: ss.Arm) -> None:
    class Heavy:
        description = ss.drivers.RobotDescription(
            "heavy", period=PERIOD, outputs=["torque"], real_time=False, paced=False
        )
        told: typing.ClassVar[list[np.ndarray]] = []

        def start(self, output: str) -> None: ...

        def read(self, timeout: float) -> ss.drivers.RobotState:
            state = [START, np.zeros(2)]
            return ss.drivers.RobotState(
                *state, mass_matrix=3.0 * arm.mass_matrix(START), bias=3.0 * arm.bias(*state)
            )

        def write(self, command: ss.Command) -> None:
            self.told.append(np.array(command.torque))

        def stop(self) -> None: ...

    controller, robot = controller_of(arm), Heavy()
    ss.run(controller, robot, until=None, duration=0.1, black_box=False)
    alone = controller_of(arm)
    dynamics = 3.0 * arm.mass_matrix(START), 3.0 * arm.bias(START, np.zeros(2))
    alone.step(START, np.zeros(2), *dynamics)  # before the first motion
    expected = alone.step(START, np.zeros(2), *dynamics)
    np.testing.assert_array_equal(robot.told[0], expected.torque)
    with pytest.raises(ValueError, match="mass_matrix and bias go together"):
        ss.drivers.RobotState(START, np.zeros(2), bias=np.zeros(2))
