"""Scheduling of threads that begin inside."""

import os
import threading

import pytest

from sidestep.drivers.real_time_threads import real_time_threads


def policy_of_a_thread() -> int:
    found: list[int] = []
    thread = threading.Thread(target=lambda: found.append(os.sched_getscheduler(0)))
    thread.start()
    thread.join()
    return found[0]


def is_permitted() -> bool:
    if not hasattr(os, "sched_setscheduler"):
        return False
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except PermissionError:
        return False
    os.sched_setscheduler(0, *before)
    return True


def test_they_inherit_it_and_this_one_gets_its_own_back() -> None:
    if not is_permitted():
        pytest.skip("real-time scheduling is not permitted here")
    before = os.sched_getscheduler(0)
    with real_time_threads(10):
        assert policy_of_a_thread() == os.SCHED_FIFO
    assert os.sched_getscheduler(0) == before
    assert policy_of_a_thread() == before


def test_nothing_happens_where_it_is_not_permitted(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    before = os.sched_getscheduler(0)
    with real_time_threads(10):
        assert policy_of_a_thread() == before
