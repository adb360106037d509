"""RealTimeRun: the controller by the machine's clock."""

import time

import numpy as np
import pytest

import sidestep as ss

START, GOAL, AT_REST = np.array([0.2, 0.3]), np.array([0.8, -0.4]), np.zeros(2)
PERIOD = 0.002


@pytest.fixture(scope="module")
def arm():
    return ss.Arm.load("planar2")


def controller_of(arm, goal=GOAL, **change):
    settings = ss.ControllerSettings(**{"period": PERIOD, "synchronous": True} | change)
    controller = ss.Controller(arm, settings)
    controller.set_obstacles(ss.Obstacles.none())
    controller.set_goal(goal)
    return controller


def run_of(controller, steps, **change):
    return ss.RealTimeRun(controller, **{"q": START, "v": AT_REST} | change, steps=steps)


def test_it_moves_the_arm_as_steps_one_after_the_other_do(arm):
    steps = 150
    begin = time.monotonic()
    run = run_of(controller_of(arm), steps)
    record = run.finish()
    assert time.monotonic() - begin >= steps * PERIOD  # by the clock, never ahead of it
    assert not run.running
    assert len(record.late) == len(record.taken) == steps
    assert np.all(record.late >= 0.0)
    assert np.all(record.taken > 0.0)
    ended = PERIOD * np.arange(1, steps + 1) + record.late + record.taken
    assert record.missed == np.sum(ended > PERIOD * np.arange(2, steps + 2))
    controller, q, v = controller_of(arm), START, AT_REST
    for _ in range(steps):
        v = v + PERIOD * controller.step(q, v).acceleration
        q = q + PERIOD * v
    for found, expected in zip(run.state(), (q, v), strict=True):
        np.testing.assert_array_equal(found, expected)
    assert np.abs(q - START).max() > 0.05


@pytest.mark.parametrize("synchronous", [True, False])
def test_a_goal_may_be_replaced_meanwhile_and_a_run_be_left(arm, synchronous):
    controller = controller_of(arm, START, synchronous=synchronous)
    run = run_of(controller, 100_000)
    controller.set_goal(GOAL)
    for _ in range(1000):
        controller.set_obstacles(ss.Obstacles([[0.0, 0.0, 2.0]], 0.01))
        time.sleep(0.005)
        if np.abs(run.state()[0] - START).max() > 0.05:
            break
    else:
        raise AssertionError("it did not go to the other goal")
    assert run.running
    begin = time.monotonic()
    del run  # stops, in far less than the 200 s that it has left
    assert time.monotonic() - begin < 10.0
    left = controller.command  # usable, from where it has been left
    assert controller.step(left.position, left.velocity).status in (
        ss.SafetyStatus.ok,
        ss.SafetyStatus.limited,
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"q": np.array([0.0, np.nan])}, "q and v must have the size of the arm, 2, and be finite"),
        ({"v": np.array([np.inf, 0.0])}, "q and v must have the size of the arm, 2, and be finite"),
        ({"v": np.zeros(3)}, r"v has shape \(3,\), expected \(2,\)"),
    ],
)
def test_bad_input_is_named_and_leaves_the_controller_free(arm, change, message):
    controller = controller_of(arm)
    with pytest.raises(ValueError, match=message):
        run_of(controller, 10, **change)
    assert len(run_of(controller, 3).finish().taken) == 3


@pytest.mark.parametrize("steps", [0, -1, 100_000_001, 2**31 - 1, 10**12])
def test_steps_have_bounds(arm, steps):
    with pytest.raises(
        ValueError, match=rf"real-time run: steps is {steps}.*, must be from 1 to 100,000,000"
    ):
        run_of(controller_of(arm), steps)


def test_a_second_run_and_what_is_for_the_loop_are_refused_beside_one(arm):
    controller, other = controller_of(arm, START), controller_of(arm)
    controller.step(START, AT_REST)
    run = run_of(controller, 100_000)
    for refused in (
        lambda: run_of(controller, 10),
        lambda: controller.step(START, AT_REST),
        lambda: ss.integrate(controller, START, AT_REST, steps=1),
        controller.explain,
        lambda: controller.command,
        lambda: controller.values,
        lambda: controller.geometric_step,
    ):
        with pytest.raises(RuntimeError, match="the controller is in use: a RealTimeRun or another thread"):
            refused()
    assert len(run_of(other, 3).finish().taken) == 3  # each controller for itself
    assert run.running
    run.stop()
    record = run.finish()
    assert len(record.late) == len(record.taken) < 100_000
    assert controller.step(START, AT_REST).status == ss.SafetyStatus.ok
    assert len(run_of(controller, 3).finish().taken) == 3


def test_stop_ends_a_run_between_steps_that_are_far_apart(arm):
    run = run_of(controller_of(arm, period=0.1), 100_000)
    run.stop()
    begin = time.monotonic()
    assert len(run.finish().taken) <= 1
    assert time.monotonic() - begin < 20.0  # of 10,000 s
