"""Tasks over processes, with a worker that each process makes once."""

from __future__ import annotations

import multiprocessing
import os
import platform
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol, TypeVar

Task_contra = TypeVar("Task_contra", contravariant=True)
Result_co = TypeVar("Result_co", covariant=True)

Progress = Callable[[int, int, str], None]  # how many are done, of all, and a word about the last one


class Worker(Protocol[Task_contra, Result_co]):
    """What does a task; made where it works."""

    def run(self, task: Task_contra) -> Result_co:
        """What came of a task."""


def run_tasks(
    make: Callable[[], Worker[Task_contra, Result_co]],
    tasks: Sequence[Task_contra],
    *,
    jobs: int,
    worker: Worker[Task_contra, Result_co] | None = None,
) -> Iterator[Result_co]:
    """What came of each task, in the order in which they end.

    Args:
        make: makes a worker in each process; must be picklable. tasks: likewise.
        jobs: processes; with one, `worker` (or one made here) does everything in this process.
        worker: one that is made already.
    """
    jobs = min(jobs, len(tasks))
    if jobs <= 1:
        yield from map((worker or make()).run, tasks)
        return
    context = multiprocessing.get_context("spawn")
    with context.Pool(jobs, initializer=_start, initargs=(make,)) as pool:
        yield from pool.imap_unordered(_run, tasks)


_worker: Worker[Any, Any] | None = None  # of this process


def _start(make: Callable[[], Worker[Any, Any]]) -> None:
    global _worker
    _worker = make()


def _run(task: Any) -> Any:
    assert _worker is not None
    return _worker.run(task)


def default_jobs() -> int:
    """The processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def cpu_name() -> str:
    """The model of the processor, or what the platform says of it."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    except OSError:
        models = []
    return models[0] if models else platform.processor() or platform.machine()
