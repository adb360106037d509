"""Threads of other packages, under the scheduling that a robot needs."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def real_time_threads(priority: int) -> Iterator[None]:
    """Threads that begin inside run under SCHED_FIFO, where the machine permits it: they inherit it from this one.

    Args:
        priority: 1 to 99.
    """
    if not hasattr(os, "sched_setscheduler"):
        yield
        return
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except PermissionError:
        yield
        return
    try:
        yield
    finally:
        os.sched_setscheduler(0, *before)
