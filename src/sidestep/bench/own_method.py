"""A method of the user's own, from a Python file, on the same problems and under the same judge."""

from __future__ import annotations

import inspect
import runpy
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep.bench.motion import CHUNK, Columns, Motion, MotionSettings
from sidestep.bench.problem import Problem
from sidestep.robot import Robot

Array = npt.NDArray[np.float64]
Step = Callable[[float, Array, Array], Array]
FUNCTION = "method"  # what the file defines


@dataclass(frozen=True, eq=False)
class OwnMethodRunner:
    """Integrates the accelerations of a function of the user's: v += a T, q += v T.

    Args:
        robot: the arm.
        start: called as start(robot, problem) once a problem; gives step(time, q, v), called once a period, which
            gives the acceleration (nv,) [rad/s^2 | m/s^2].
        name: what errors call it.
    """

    robot: Robot
    start: Callable[[Robot, Problem], Step]
    name: str

    @classmethod
    def from_file(cls, path: Path, robot: Robot) -> OwnMethodRunner:
        """From a file that defines `method(robot, problem)`.

        Raises:
            FileNotFoundError: there is no such file.
            ValueError: it defines no such function, or one that takes other arguments.
        """
        if not path.is_file():
            raise FileNotFoundError(f"--method: there is no file '{path}'")
        start = runpy.run_path(str(path)).get(FUNCTION)
        if not callable(start):
            raise ValueError(f"--method: '{path}' defines no function {FUNCTION}(robot, problem)")
        try:
            inspect.signature(start).bind(robot, None)
        except TypeError as error:
            raise ValueError(f"--method: '{path}': {FUNCTION} must take (robot, problem): {error}") from error
        return cls(robot, start, path.name)

    def move(self, problem: Problem, settings: MotionSettings) -> Motion:
        """Runs one problem."""
        step = self.start(self.robot, problem)
        if not callable(step):
            raise ValueError(
                f"{self.name}: {FUNCTION}(robot, problem) gave {step!r}, must be step(time, q, v)"
            )
        columns = Columns(self.robot, problem, settings)
        q, v = problem.start, np.zeros_like(problem.start)
        while count := columns.next_steps(CHUNK):
            rows: list[tuple[Array, Array, Array]] = []
            seconds = np.zeros(count)
            for k in range(count):
                begin = time.perf_counter()
                given = step((columns.done + k) * settings.period, q.copy(), v.copy())
                seconds[k] = time.perf_counter() - begin
                a = self._checked(given, q, problem.index)
                rows.append((q, v, a))
                v = v + settings.period * a
                q = q + settings.period * v
            past, speeds, accelerations = (np.array(column) for column in zip(*rows, strict=True))
            columns.add(past, speeds, accelerations, seconds, columns.near(past))
        return columns.motion(problem)

    def _checked(self, given: Any, q: Array, index: int) -> Array:
        a = np.asarray(given, dtype=np.float64)
        if a.shape != q.shape or not np.isfinite(a).all():
            raise ValueError(
                f"{self.name}: step gave {given!r} in problem {index}, must be {len(q)} finite accelerations"
            )
        return a


OwnMover = OwnMethodRunner  # its name in 0.2
