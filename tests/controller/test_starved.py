"""Threads that get too little processor time: how old their results are, and what an arm does then."""

import os
import subprocess
import sys
import time

import numpy as np
import pytest

import sidestep as ss
from sidestep.controller import LookAheadSettings
from sidestep.obstacles import pose_at

PERIOD = 1e-3
WAKE_UP = 0.02  # [s] from look to look of the planner's thread
FAR = np.array([2.4, 0.3, 0.0, -1.6, 0.0, 2.0, 0.785])  # more than 1.5 s away
# The threads wake up every 20 ms of the machine's clock. Steps as fast as they can be, of some 0.05 ms, make that
# 0.3 s or more of the steps' clock: far more than the ten delays after which an arm rests with this.
SHORT = {"period": 0.01, "delay": 0.01}


def look_ahead(**settings):
    chosen = LookAheadSettings()
    for name, value in settings.items():
        setattr(chosen, name, value)
    return chosen


def beside_a_ball(velocity=(0.0, 0.0, -0.001), **settings):
    """A ball that hardly moves, behind the arm and within the 10 cm that count as near."""
    arm = ss.Arm.load("fr3")
    controller = ss.Controller(arm, ss.ControllerSettings(output="acceleration", **settings))
    ball = ss.Sphere(0.05, pose_at([-0.25, 0.0, 0.35]), velocity=velocity)
    controller.set_obstacles(ball, valid_for=np.inf)
    return controller


def steps(controller, number, rate=None):
    """Commands and joint positions of an ideal arm, of steps as fast as they can be, or at a rate [1/s].

    Steps that do not wait are a simulation, which tells its time: a machine that is busy must not make it late.
    """
    q, v = ss.Arm.load("fr3").neutral.copy(), np.zeros(7)
    begin, made = time.perf_counter(), []
    for k in range(number):
        while rate is not None and time.perf_counter() - begin < k / rate:
            time.sleep(1e-4)
        command = controller.step(q, v, time=k * PERIOD if rate is None else None)
        made.append((command, q))
        v = v + PERIOD * command.acceleration
        q = q + PERIOD * v
    return made


def pace_of(age, settings):
    late = settings.rest_after * settings.delay - age
    return np.clip(late / ((settings.rest_after - settings.slow_after) * settings.delay), 0.0, 1.0)


def to_a_goal(controller):
    controller.set_goal(FAR)


def to_a_goal_that_moves(controller):
    q = ss.Arm.load("fr3").neutral
    controller.set_goal(ss.JointGoal(FAR, velocity=1e-6 * np.ones(len(q))))


def at_a_velocity(controller):
    controller.set_velocity(np.array([0.8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]))


def by_a_twist(controller):
    controller.set_twist("fr3_hand", [0.0, 0.3, 0.0, 0.0, 0.0, 0.0])


def along_a_trajectory(controller):
    q = ss.Arm.load("fr3").neutral
    controller.set_trajectory(np.array([q, FAR]), np.array([0.0, 4.0]))


@pytest.mark.parametrize(
    "told", [to_a_goal, to_a_goal_that_moves, at_a_velocity, by_a_twist, along_a_trajectory]
)
def test_an_old_look_ahead_slows_the_arm_beside_what_moves(told):
    travelled = {}
    for slowed in (False, True):
        late = {} if slowed else {"slow_after": 900.0, "rest_after": 9000.0}
        chosen = look_ahead(**SHORT, **late)
        controller = beside_a_ball(look_ahead=chosen, inputs=ss.controller.InputSettings(timeout=9.0))
        told(controller)
        made = steps(controller, 1500)
        travelled[slowed] = np.abs(made[-1][1] - made[0][1]).max()
        for command, _ in made[30:]:
            if not command.avoiding:  # rounding of a division
                assert command.pace == pytest.approx(pace_of(command.look_ahead_age, chosen), abs=1e-9)
            if command.pace < 1.0 and command.activity == ss.Activity.moving:
                assert command.status >= ss.SafetyStatus.limited
    assert made[-1][0].look_ahead_age > 0.0
    assert (
        travelled[True] < 0.5 * travelled[False]
    )  # 0.02 to 0.05 of it here; half of it is no luck of threads


def test_what_slows_it_is_explained():
    controller = beside_a_ball(look_ahead=look_ahead(**SHORT))
    to_a_goal(controller)
    q, words = ss.Arm.load("fr3").neutral, ""
    for _ in range(3000):  # 0.15 s; the threads wake up seven times in it
        command = controller.step(q, np.zeros(7))
        if command.pace < 1.0 and command.activity == ss.Activity.moving:
            words = controller.explain()
            break
    assert f"the look-ahead is {command.look_ahead_age:.1f} s old; it gets too little processor time" in words
    assert f"slowed to {100 * command.pace:.0f} %" in words


def test_the_planner_says_how_old_its_look_is():
    controller = beside_a_ball(look_ahead=None)
    to_a_goal(controller)
    begin = time.perf_counter()
    made = [command for command, _ in steps(controller, 1500)]
    looks = (time.perf_counter() - begin) / WAKE_UP
    ages = np.array([command.planner_age for command in made])
    # From look to look the age grows by a period. A look begins with the age that it has by the clock.
    assert np.count_nonzero(np.abs(np.diff(ages) - PERIOD) >= 1e-9) <= looks + 2  # the first ones do not wait
    assert ages.max() > 0.1  # it wakes up every 20 ms, in which some hundred steps are made
    assert {command.look_ahead_age for command in made} == {0.0}


@pytest.mark.parametrize("part", ["nothing moves", "no look-ahead", "synchronous"])
def test_an_old_look_ahead_costs_nothing_where_it_has_nothing_to_say(part):
    chosen = None if part == "no look-ahead" else look_ahead(**SHORT)
    controller = beside_a_ball(
        velocity=(0.0, 0.0, 0.0) if part == "nothing moves" else (0.0, 0.0, -0.001),
        look_ahead=chosen,
        synchronous=part == "synchronous",
    )
    to_a_goal(controller)
    made = [command for command, _ in steps(controller, 300 if part == "synchronous" else 1500)]
    assert {command.pace for command in made} == {1.0}
    if part == "nothing moves":
        assert max(command.look_ahead_age for command in made) > 0.1
    else:
        assert {command.look_ahead_age for command in made} == {0.0}
    if part == "synchronous":
        assert {command.planner_age for command in made} == {0.0}


def test_an_age_at_which_the_arm_rests_is_more_than_that_from_which_it_is_slowed():
    with pytest.raises(ValueError, match=r"look_ahead: slow_after is 10\.0+, must be less than rest_after"):
        beside_a_ball(look_ahead=look_ahead(slow_after=10.0))


@pytest.mark.slow  # 4 s at the clock's rate
@pytest.mark.skipif(not hasattr(os, "SCHED_IDLE"), reason="threads are put behind others by Linux alone")
def test_threads_beside_busy_loops():
    before = set(os.listdir("/proc/self/task"))
    controller = beside_a_ball()  # as it comes: 0.3 s and 1 s
    threads = set(os.listdir("/proc/self/task")) - before
    cores = sorted(os.sched_getaffinity(0))
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(2)]
    try:
        for process in busy:
            os.sched_setaffinity(process.pid, {cores[0]})
        for thread in threads:  # the controller's alone; the loop stays as it is
            os.sched_setaffinity(int(thread), {cores[0]})
            os.sched_setscheduler(int(thread), os.SCHED_IDLE, os.sched_param(0))
        to_a_goal(controller)
        made = steps(controller, 4000, rate=1.0 / PERIOD)
    finally:
        for process in busy:
            process.kill()
            process.wait()
    old = [command for command, _ in made if command.look_ahead_age > 0.3 and not command.avoiding]
    assert old  # or else they were not starved
    for command in old:
        assert command.pace == pytest.approx(pace_of(command.look_ahead_age, LookAheadSettings()), abs=1e-9)
        assert command.pace < 1.0
        assert command.status >= ss.SafetyStatus.limited or command.activity != ss.Activity.moving
