"""RealTimeRun: the loop by the machine's clock."""

import time

import numpy as np
import pytest

import sidestep as ss

START, GOAL, AT_REST = np.array([0.2, 0.3]), np.array([0.8, -0.4]), np.zeros(2)
PERIOD = 0.002


@pytest.fixture(scope="module")
def robot():
    return ss.Robot.named("planar2")


def loop_of(robot, goal=GOAL):
    system = ss.GeometricSystem([], robot=robot, stiffness=4.0, damping=4.0)
    return ss.Loop(
        system, ss.TorqueController(robot, period=PERIOD), goal=goal, obstacles=ss.Obstacles.none()
    )


def run_of(robot, loop, steps, **change):
    inputs = {"q": START, "v": AT_REST, "mass_matrix": robot.mass_matrix(START), "bias": AT_REST} | change
    return ss.RealTimeRun(loop, **inputs, period=PERIOD, steps=steps)


def test_it_moves_the_arm_as_steps_one_after_the_other_do(robot):
    steps = 150
    begin = time.monotonic()
    run = run_of(robot, loop_of(robot), steps)
    record = run.finish()
    assert time.monotonic() - begin >= steps * PERIOD  # by the clock, never ahead of it
    assert not run.running
    assert len(record.late) == len(record.taken) == steps
    assert np.all(record.late >= 0.0)
    assert np.all(record.taken > 0.0)
    ended = PERIOD * np.arange(1, steps + 1) + record.late + record.taken
    assert record.missed == np.sum(ended > PERIOD * np.arange(2, steps + 2))
    loop, q, v = loop_of(robot), START, AT_REST
    for _ in range(steps):
        v = v + PERIOD * loop.step(q, v, robot.mass_matrix(START), AT_REST).solution.acceleration
        q = q + PERIOD * v
    for found, expected in zip(run.state(), (q, v), strict=True):
        np.testing.assert_array_equal(found, expected)
    assert np.abs(q - START).max() > 0.05


def test_a_goal_may_be_replaced_meanwhile_and_a_run_be_left(robot):
    loop = loop_of(robot, START)
    run = run_of(robot, loop, 100_000)
    loop.set_goal(GOAL)
    for _ in range(1000):
        time.sleep(0.005)
        if np.abs(run.state()[0] - START).max() > 0.05:
            break
    else:
        raise AssertionError("it did not go to the other goal")
    assert run.running
    begin = time.monotonic()
    del run  # stops, in far less than the 200 s that it has left
    assert time.monotonic() - begin < 10.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"q": np.array([0.0, np.nan])}, "must have the size of the arm and be finite"),
        ({"mass_matrix": np.full((2, 2), np.inf)}, "must have the size of the arm and be finite"),
        ({"v": np.zeros(3)}, r"v has shape \(3,\), expected \(2,\)"),
    ],
)
def test_bad_input_is_named(robot, change, message):
    with pytest.raises(ValueError, match=message):
        run_of(robot, loop_of(robot), 10, **change)


def test_bad_settings_are_named(robot):
    with pytest.raises(ValueError, match=r"real-time run: steps is 0.*, must be from 1 to 100,000,000"):
        run_of(robot, loop_of(robot), 0)
    inputs = (START, AT_REST, robot.mass_matrix(START), AT_REST)
    with pytest.raises(ValueError, match=r"real-time run: period is 0.*, must be finite and positive"):
        ss.RealTimeRun(loop_of(robot), *inputs, period=0.0)
