"""What happened in a recorded run, in words: when request, activity or status changed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sidestep._core import Activity, RecordedRun, SafetyStatus

SHORTEST = 0.1  # [s] of a status that is an event; worse ones always are
ALWAYS = SafetyStatus.margin_lost.value  # from this status on, however short


@dataclass(frozen=True)
class RecordedEvent:
    """A change in a run.

    Attributes:
        time: [s] on the clock of `step`. step: from 0.
        kind: "request", "activity" or "status". words: what it changed to, and why.
    """

    time: float
    step: int
    kind: str
    words: str


def events_of(run: RecordedRun) -> tuple[RecordedEvent, ...]:
    """Every change of request and activity, and of status where it lasts 0.1 s or is worse than `relaxed`."""
    if run.steps == 0:
        return ()
    found: list[RecordedEvent] = []

    def add(step: int, kind: str, words: str) -> None:
        found.append(RecordedEvent(float(run.time[step]), step, kind, words))

    requests, statuses = run.requests, list(SafetyStatus)
    activities = [one.name.replace("_", " ") for one in Activity]
    for step in _changes(run.request):
        if run.request[step] >= 0:
            add(int(step), "request", requests[run.request[step]])
    for step in _changes(run.activity):
        add(int(step), "activity", activities[run.activity[step]])
    begins = _changes(run.status)
    ends = [*begins[1:], run.steps]
    shown = None
    for begin, end in zip(begins, ends, strict=True):
        status = run.status[begin]
        lasts = run.time[end - 1] - run.time[begin] >= SHORTEST or end == run.steps
        if status != shown and (lasts or status >= ALWAYS):
            worst = _worst(run, int(begin), int(end))
            add(int(begin), "status", run.explain(worst) if status else statuses[status].name)
            shown = status
    order = {"request": 0, "activity": 1, "status": 2}
    return tuple(sorted(found, key=lambda event: (event.step, order[event.kind])))


def _changes(values: npt.NDArray[np.int32]) -> npt.NDArray[np.int64]:
    """Steps from which on there is another value; the first is one."""
    return np.concatenate([[0], 1 + np.flatnonzero(np.diff(values))])


def _worst(run: RecordedRun, begin: int, end: int) -> int:
    """The step with the least clearance; the first where none is near."""
    clearance = np.nan_to_num(run.clearance[begin:end], nan=np.inf)
    return begin + int(np.argmin(clearance))
