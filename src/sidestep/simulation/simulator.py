"""The loop of `sidestep simulate`: a simulated robot in its own time, and what it hears and says."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from typing import Any, Protocol, cast

import numpy as np
import numpy.typing as npt

from sidestep.simulation.channel import Channel
from sidestep.simulation.joint_drives import Output
from sidestep.simulation.link import Link
from sidestep.simulation.pace import Pace
from sidestep.simulation.simulated_robot import Mode, Sample, SimulatedRobot

Array = npt.NDArray[np.float64]

PATIENCE = 0.5  # [s] of the machine's clock for an answer, where the simulation waits for one
OBJECTS_EVERY = 10  # cycles between two messages with the poses of the objects: viewers need no more


class Request(Protocol):
    """Something that a driver says, as `RobotRequest` of the core."""

    @property
    def kind(self) -> str:
        """ "start", "command", "stop", or "gone" where the connection of the driver in control has ended."""

    @property
    def output(self) -> str:
        """Of start and command."""

    @property
    def sequence(self) -> int:
        """Number of the message."""

    @property
    def cycle(self) -> int:
        """Of the sample that a command answers."""

    @property
    def values(self) -> Array:
        """(nv,) of a command."""


class Port(Protocol):
    """Where drivers connect, as `RobotPort` of the core."""

    def receive(self, timeout: float) -> Request | None:
        """The next thing a driver says, waiting for at most so long [s]."""

    def send_state(
        self,
        cycle: int,
        time: float,
        *,
        q: Array,
        v: Array,
        torque: Array,
        mode: int,
        taken: int,
        taken_cycle: int,
        lost_cycles: int,
    ) -> None:
        """How the robot is, to all who are connected."""

    def send_objects(self, names: Sequence[str], poses: Array) -> None:
        """Where the objects are, (N, 7) position and quaternion (w, x, y, z), to all who are connected."""

    def stop(self, words: str) -> None:
        """The robot has stopped by itself, to the driver in control."""


class Simulator:
    """A robot that lives by the machine's clock, `speed` times as fast, and answers drivers at a port.

    In cycle k the sample of its beginning leaves, and the newest command that arrives before its end moves it. With
    `speed` 0 a cycle under control ends once the sample that it sent is answered: as fast as it is asked, but an
    answer that takes longer than `PATIENCE` counts as none.

    Args:
        robot: what is simulated. port: where drivers connect.
        link: how late and lossy the connection is, in the simulation's time. Start and stop always arrive at once.
        speed: simulated time per time of the machine; 0: see above.

    Attributes:
        was_controlled: some driver has started.
        clock_ahead: what the times in its messages are ahead of its own [s]; a change is a jump of the robot's clock.

    Raises:
        ValueError: a speed that is negative or not finite.
    """

    def __init__(
        self, robot: SimulatedRobot, port: Port, *, link: Link | None = None, speed: float = 1.0
    ) -> None:
        if not 0.0 <= speed < float("inf"):
            raise ValueError(f"speed is {speed}; allowed: 0 or more, finite")
        self.robot, self.port, self.speed = robot, port, speed
        link = Link() if link is None else link
        self._to_driver: Channel[Sample] = Channel(link, 0)
        self._to_robot: Channel[tuple[int, Array]] = Channel(link, 1)
        self._pace = Pace(robot.period / (speed or 1.0))
        self.was_controlled = False
        self.clock_ahead = 0.0
        self._names = [item.name for item in robot.objects]
        self._answered = -1  # cycle of the newest sample that was answered

    def run(self, goes_on: Callable[[], bool]) -> None:
        """Runs as long as `goes_on`, which is asked once a cycle.

        Raises:
            RuntimeError: the physics diverged.
        """
        self._pace.begin()
        while goes_on():
            self.cycle()

    def cycle(self) -> None:
        """One cycle: says how the robot is, listens until its end, and moves it."""
        sample = self.robot.sample()
        due: Sample | None = sample
        if sample.mode != Mode.waiting:  # else its time stands still, and nothing would arrive
            self._to_driver.send(sample, sample.time)
            due = self._to_driver.arrived(sample.time)
        if due is not None:
            self._send(due)
        if sample.cycle % OBJECTS_EVERY == 0 and self._names:
            self.port.send_objects(self._names, sample.object_poses)
        if self.speed == 0.0 and sample.mode == Mode.controlled:
            self._listen_for_answer(due)
            self._pace.begin()
        else:
            self._listen(self._pace.left)
            self._pace.next()
        command = self._to_robot.arrived(sample.time)
        if command is not None:
            self.robot.take(*command)
        was = self.robot.mode
        self.robot.advance()
        if self.robot.mode == Mode.stopped and was == Mode.controlled:
            self.port.stop(self.robot.trouble)

    def to_dict(self) -> dict[str, Any]:
        """What came of it, as plain values for JSON."""
        channels: dict[str, Channel[Any]] = {"to_driver": self._to_driver, "to_robot": self._to_robot}
        return {
            **self.robot.to_dict(),
            "late_cycles": self._pace.late,
            "slips": self._pace.slips,
            "messages": {
                name: {"sent": channel.sent, "lost": channel.lost, "overtaken": channel.overtaken}
                for name, channel in channels.items()
            },
        }

    def _send(self, sample: Sample) -> None:
        self.port.send_state(
            sample.cycle,
            sample.time + self.clock_ahead,
            q=sample.q,
            v=sample.v,
            torque=sample.torque,
            mode=sample.mode,
            taken=max(0, sample.taken),
            taken_cycle=sample.taken_cycle,
            lost_cycles=sample.lost,
        )

    def _listen(self, left: Callable[[], float]) -> None:
        """Takes what drivers say as long as there is time `left` [s], and in any case what they have said."""
        while True:
            span = left()
            request = self.port.receive(max(0.0, span))
            if request is not None:
                self._take(request)
            elif span <= 0.0:
                return

    def _listen_for_answer(self, due: Sample | None) -> None:
        """Listens until a sample that was sent is answered; for no time where none was."""
        until = clock.monotonic() + PATIENCE

        def left() -> float:
            waits = due is not None and due.mode == Mode.controlled == self.robot.mode
            return until - clock.monotonic() if waits and due and self._answered < due.cycle else 0.0

        self._listen(left)

    def _take(self, request: Request) -> None:
        match request.kind:
            case "start":
                self.was_controlled = True
                self._to_robot.clear()
                self._answered = self.robot.sample().cycle - 1
                self.robot.start(cast(Output, request.output))
            case "command":
                self._answered = max(self._answered, request.cycle)
                self._to_robot.send((request.sequence, request.values), self.robot.time)
            case _:  # stop, gone
                self.robot.stop()
