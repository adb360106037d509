"""One way of doing the work of a step, and how long it takes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np
import numpy.typing as npt

from sidestep._core import GeometricSystem, Obstacles, rollout

Array = npt.NDArray[np.float64]
Call = Callable[[Array, Array], Array]
States = list[tuple[Array, Array, Array]]  # q, v, and what to compare with

MOTION = 1_000  # steps; the states that every way is asked at
FEWEST = 3  # calls of a way, however long they take
WARM_UP = 10  # calls that do not count, if they take less than a tenth of the time


@dataclass(frozen=True)
class PeerSettings:
    """How long each way is measured.

    Attributes:
        seconds: for each way [s]. seed: of the balls. fabrics: an interpreter that can import `fabrics`, which needs an
            environment of its own; None leaves it out.

    Raises:
        ValueError: seconds is not positive.
    """

    seconds: float = 3.0
    seed: int = 0
    fabrics: str | None = None

    def __post_init__(self) -> None:
        if not self.seconds > 0.0:
            raise ValueError(f"seconds is {self.seconds}, must be positive")


@dataclass(frozen=True)
class Way:
    """One way of doing the work: what is called at a state, or microseconds that it measures itself, or why neither."""

    name: str
    work: str
    call: Call | None = None
    measured: Callable[[], Array] | None = None
    missing: str = ""
    check: bool = False  # whether the result is that of the first way


def optional(name: str, work: str, module: str, make: Callable[[], Call], *, check: bool = False) -> Way:
    if find_spec(module) is None:
        return Way(name, work, missing=f"{module} is not installed")
    return Way(name, work, make(), check=check)


def times_of(way: Way, states: States, seconds: float) -> Array:
    """Microseconds of calls at the states, which hold q, v and the acceleration to compare with."""
    assert way.call is not None
    begin = time.perf_counter()
    for q, v, expected in states[:WARM_UP]:
        found = way.call(q, v)
        if way.check and not np.allclose(found, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max()):
            raise RuntimeError(f"{way.name}: the acceleration is {found}, not {expected}")
        if time.perf_counter() - begin > 0.1 * seconds:
            break
    times: list[float] = []
    end = time.perf_counter() + seconds
    while len(times) < FEWEST or time.perf_counter() < end:
        q, v, _ = states[len(times) % len(states)]
        start = time.perf_counter_ns()
        way.call(q, v)
        times.append(1e-3 * (time.perf_counter_ns() - start))
    return np.array(times)


def steps_in_cpp(
    system: GeometricSystem,
    start: Array,
    goal: Array,
    obstacles: Obstacles,
    seconds: float,
) -> Array:
    """Microseconds of steps of the system in motions of it."""
    times: list[Array] = []
    end = time.perf_counter() + seconds
    while not times or time.perf_counter() < end:
        run = rollout(system, start, 0.0 * start, goal, obstacles, steps=MOTION, time_steps=True)
        times.append(1e6 * run.step_seconds)
    return np.concatenate(times)
