"""Several threads that step one controller are told so; handing a loop over is allowed."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

import sidestep as ss


def controller() -> ss.Controller:
    c = ss.Controller(ss.Arm.load("planar2"), ss.ControllerSettings(synchronous=True, planner=None))
    c.set_obstacles(ss.Obstacles.none())
    return c


def step(c: ss.Controller, times: int = 1) -> None:
    q = ss.Arm.load("planar2").neutral
    for _ in range(times):
        c.step(q, 0.0 * q)


def in_a_thread(action: object, *args: object) -> BaseException | None:
    raised: list[BaseException] = []

    def run() -> None:
        try:
            action(*args)  # type: ignore[operator]
        except BaseException as error:
            raised.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    return raised[0] if raised else None


def two_loops(c: ss.Controller) -> None:
    with ThreadPoolExecutor(1) as first, ThreadPoolExecutor(1) as second:
        for _ in range(5):
            first.submit(step, c).result()
            second.submit(step, c).result()


def test_two_loops_that_step_in_turn_are_told() -> None:
    c = controller()
    with pytest.warns(RuntimeWarning, match="several threads step this controller in turn"):
        two_loops(c)
    assert "several threads" in c.explain()
    with pytest.warns(RuntimeWarning, match="several threads"):
        step(c)  # a third thread
    step(c)  # the same one again: it is alone now
    assert "several threads" not in c.explain()


def test_a_loop_may_go_over_to_another_thread() -> None:
    c = controller()
    step(c, 3)
    assert in_a_thread(step, c, 5) is None
    step(c, 3)  # and back
    assert c.command.status.name == "ok"


def test_many_threads_one_after_the_other() -> None:
    """Each long enough for the one before not to count: more than 1,000 steps."""
    c = controller()
    for _ in range(4):
        assert in_a_thread(step, c, 1100) is None
