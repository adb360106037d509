"""RealTimeRun: the loop by the machine's clock."""

import time

import numpy as np
import pytest

import sidestep as ss
from sidestep._core import QuadraticProgram

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


def test_a_second_run_and_a_step_beside_one_are_refused(robot):
    loop = loop_of(robot)
    run = run_of(robot, loop, 100_000)
    with pytest.raises(RuntimeError, match="the loop is in use: a RealTimeRun"):
        run_of(robot, loop, 10)
    with pytest.raises(RuntimeError, match="the loop is in use: a RealTimeRun"):
        loop.step(START, AT_REST, robot.mass_matrix(START), AT_REST)
    assert run.running
    run.stop()
    record = run.finish()
    assert len(record.late) == len(record.taken) < 100_000
    assert loop.step(START, AT_REST, robot.mass_matrix(START), AT_REST).status == ss.StepStatus.ok
    assert len(run_of(robot, loop, 3).finish().taken) == 3


def test_a_run_that_was_refused_leaves_the_loop_free(robot):
    loop = loop_of(robot)
    with pytest.raises(ValueError, match="must have the size of the arm and be finite"):
        run_of(robot, loop, 10, q=np.array([0.0, np.nan]))
    assert len(run_of(robot, loop, 3).finish().taken) == 3


def test_stop_ends_a_run_between_steps_that_are_far_apart(robot):
    loop = loop_of(robot)
    inputs = {"q": START, "v": AT_REST, "mass_matrix": robot.mass_matrix(START), "bias": AT_REST}
    run = ss.RealTimeRun(loop, **inputs, period=60.0, steps=100)
    run.stop()
    begin = time.monotonic()
    assert len(run.finish().taken) == 0
    assert time.monotonic() - begin < 20.0  # of a period of 60 s


def test_sizes_have_an_upper_bound(robot):
    with pytest.raises(ValueError, match=r"steps is 2147483647.*, must be from 1 to 100,000,000"):
        run_of(robot, loop_of(robot), 2**31 - 1)
    inputs = {"q": START, "v": AT_REST, "mass_matrix": robot.mass_matrix(START), "bias": AT_REST}
    with pytest.raises(ValueError, match=r"period is 60\.1.*, must be at most 60 s"):
        ss.RealTimeRun(loop_of(robot), **inputs, period=60.1)
    with pytest.raises(ValueError, match=r"max_rows is 100000.*, must be from 0 to 256"):
        ss.SafetySettings(max_rows=100_000)
    assert ss.SafetySettings(max_rows=256).max_rows == 256
    with pytest.raises(ValueError, match=r"max_nodes is 2147483647.*, must be from 2 to 1,000,000"):
        ss.PlannerSettings(max_nodes=2**31 - 1)
    with pytest.raises(ValueError, match="a size is 100000, must be at most 4096"):
        QuadraticProgram(100_000)
