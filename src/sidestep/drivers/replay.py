"""A robot that measures what a recording holds, whatever it is sent: to see what a controller would have done."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

import numpy as np

from sidestep._core import Command, RobotDescription, RobotState, RobotStopped, read_recorded_run

OUTPUTS = ("torque", "acceleration", "velocity", "position")


class Replay:
    """The states of a recording, one per cycle, on the recording's clock and as fast as the loop can.

    What is written moves nothing: another controller, or other settings, meet the same states. `sidestep replay`
    repeats the commands of the recorded controller bit for bit instead. The run ends as `robot_stopped` when the
    recording is over.

    Attributes:
        description: of the robot; its period is that of the recorded controller.
        cycle: number of states that were read.
    """

    def __init__(self, path: str | os.PathLike[str] | Sequence[str | os.PathLike[str]]) -> None:
        """Reads a recording, or the files of a black box in the order of time.

        Raises:
            OSError: it cannot be read. ValueError: it is no recording, or holds no step with a state.
        """
        paths = [Path(path)] if isinstance(path, str | os.PathLike) else [Path(one) for one in path]
        run = read_recorded_run(paths, scenes=False)
        known = np.isfinite(run.q).all(axis=1) & np.isfinite(run.v).all(axis=1)
        if not known.any():
            raise ValueError(f"replay: {paths[0]} holds no step with a state")
        self._time, self._q, self._v = run.time[known], run.q[known], run.v[known]
        robot = run.header.arm.robot
        self.description = RobotDescription(
            f"recording of {robot.name}",
            period=run.header.settings.period,
            outputs=list(OUTPUTS),
            joints=list(robot.coordinate_names),
            paced=True,
            real_time=False,
            when_silent="it is a recording",
        )
        self.cycle = 0

    def start(self, output: str) -> None:
        """Begins: any output is taken."""

    def read(self, timeout: float) -> RobotState:
        """The next recorded state.

        Raises:
            RobotStopped: the recording is over.
        """
        if self.cycle == len(self._time):
            raise RobotStopped("the recording is over")
        k, self.cycle = self.cycle, self.cycle + 1
        return RobotState(self._q[k], self._v[k], time=self._time[k])

    def write(self, command: Command) -> None:
        """Moves nothing."""

    def stop(self) -> None:
        """Nothing is to be stopped."""

    def __enter__(self) -> Replay:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
