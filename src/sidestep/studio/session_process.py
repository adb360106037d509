"""The session in a process of its own, so that nothing the page does can hold the loop up.

python -m sidestep.studio.session_process ADDRESS      (started by `SessionProcess`; the key comes on stdin)
"""

from __future__ import annotations

import contextlib
import gc
import logging
import subprocess
import sys
import threading
import time as clock
from collections.abc import Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep.arm import Arm
from sidestep.body import Body
from sidestep.extras import MissingExtraError
from sidestep.robot import Robot
from sidestep.scenario import Scenario
from sidestep.studio import messages as m
from sidestep.studio.command_queue import CommandQueue, add
from sidestep.studio.prepared_bodies import in_words
from sidestep.studio.process_link import connect_to_parent, start_process
from sidestep.studio.served_session import ServedSession
from sidestep.studio.session import Session
from sidestep.studio.systems import Covering, Recipe, draft_arm, make_body

Array = npt.NDArray[np.float64]

FRAME = 1.0 / 30.0  # [s] between two snapshots
IDLE_FRAME = 0.2  # [s] the same while the loop is paused
UNSEEN = 2  # snapshots on their way at most; further ones are dropped until the page has taken one
BEHIND = (
    0.1  # [s] of simulated time that is made up for; more is let go, and the loop runs slower than real time
)
LONGEST_HOLD = 10.0  # [s] for which a scenario that was loaded waits for a page; there may be none
LEAST_WAIT = 2e-4  # [s] shorter waits are not worth a system call
SWITCH = 2e-4  # [s] for which another thread of the process, as that of a camera, may hold the loop up


@dataclass(frozen=True)
class Served:
    """An arm that another program serves: see `sidestep.connect`."""

    address: str | None = None
    token: str | None = None


@dataclass(frozen=True)
class Beginning:
    """What a loop starts with: see `Session`; ellipsoids: of a covering body per link, None: as it finds best.

    served: the arm of another program, in place of a simulation.
    """

    scenario: Scenario
    method: str
    numbers: Mapping[str, Mapping[str, Any]]
    ellipsoids: int | None = None
    goals: tuple[Array, ...] = ()
    served: Served | None = None


class SessionProcess:
    """The page's end: sends commands, has the latest snapshot.

    Args:
        beginning: what to run.

    Raises:
        RuntimeError: the process did not start.
    """

    def __init__(self, beginning: Beginning) -> None:
        self._process, self._connection = start_process(__name__)
        self._fresh = threading.Condition()
        self._snapshot: m.Snapshot | None = None
        self._notes: list[m.Preparing | m.Failed] = []
        self._rows: list[m.Row] = []
        self.ended = False
        self._connection.send(beginning)
        self._queue = CommandQueue(self._connection)
        self._thread = threading.Thread(target=self._receive, daemon=True)
        self._thread.start()

    def send(self, command: m.Command) -> None:
        """Hands a command to the loop and never waits; of a loop that has ended nothing is heard."""
        self._queue.put(command)

    def wait(self, timeout: float) -> m.Snapshot | None:
        """The next snapshot, or None when there was none within `timeout` [s]."""
        with self._fresh:
            if self._snapshot is None and not self._notes and not self.ended:
                self._fresh.wait(timeout)
            snapshot, self._snapshot = self._snapshot, None
        return snapshot

    def take_notes(self) -> list[m.Preparing | m.Failed]:
        """What the loop said since the last call."""
        with self._fresh:
            notes, self._notes = self._notes, []
        return notes

    def take_rows(self) -> list[m.Row]:
        """What was recorded since the last call; nothing of it is dropped."""
        with self._fresh:
            rows, self._rows = self._rows, []
        return rows

    def stop(self) -> None:
        """Ends the process."""
        self._queue.stop()
        self._queue.join(timeout=0.2)  # longer where the loop is busy and the connection full
        with contextlib.suppress(OSError):
            self._connection.close()
        try:
            self._process.wait(timeout=2.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._queue.join(timeout=2.0)
        if self._process.stdin is not None:
            self._process.stdin.close()

    def _receive(self) -> None:
        while True:
            try:
                message = self._connection.recv()
            except (EOFError, OSError, TypeError):  # TypeError: closed while it waits
                break
            with self._fresh:
                if isinstance(message, m.Snapshot):
                    self._snapshot = message
                    self._rows.extend(message.rows)
                else:
                    self._notes.append(message)
                self._fresh.notify_all()
            if isinstance(message, m.Snapshot):
                self.send(m.Seen())
        with self._fresh:
            self.ended = True
            self._fresh.notify_all()


def serve(connection: Connection[Any, Any]) -> None:
    """Runs a session in real time until the other end hangs up."""
    beginning: Beginning = connection.recv()

    def prepare(robot: Robot, recipe: Recipe) -> Body:
        doing = "covering" if isinstance(recipe, Covering) else "fitting"

        def progress(link: str, done: int, total: int) -> None:
            connection.send(m.Preparing(f"{doing} {link} ({done} of {total})"))

        return make_body(robot, recipe, progress)

    def draft(scenario: Scenario) -> Arm:
        def progress(stage: str, item: str, done: int, total: int) -> None:
            connection.send(m.Preparing(in_words(stage, item, done, total)))

        return draft_arm(scenario, progress)

    connection.send(m.Preparing("loading robot and scene"))
    session: Session | ServedSession
    try:
        if beginning.served is not None:
            session = ServedSession(beginning.scenario, beginning.served.address, beginning.served.token)
        else:
            session = Session(
                beginning.scenario,
                method=beginning.method,
                numbers=beginning.numbers,
                goals=beginning.goals,
                ellipsoids=beginning.ellipsoids,
                prepare=prepare,
                draft=draft,
            )
    except (ValueError, OSError, MissingExtraError) as error:
        connection.send(m.Failed(str(error), fatal=True))
        return
    gc.collect()
    gc.freeze()  # what lives as long as the process is not looked through again
    try:
        _Pacer(session, connection).run()
    finally:
        session.stop()
        gc.unfreeze()  # else the core says at the end of the process that its objects were left


class _Pacer:
    """Keeps simulated time with the clock, answers commands between steps, and sends snapshots."""

    def __init__(self, session: Session | ServedSession, connection: Connection[Any, Any]) -> None:
        self._session, self._connection = session, connection
        self._unseen = 0
        self._sent, self._next_frame = -FRAME, 0.0
        self._said = ""
        self._awaited, self._hold_end = 0, 0.0  # edition that the page has to draw before the time goes on
        self._marks: list[tuple[float, float]] = []

    def run(self) -> None:
        session = self._session
        due = clock.perf_counter()
        while True:
            if self._connection.poll():
                self._answer()
                due = max(due, clock.perf_counter() - BEHIND)
            now = clock.perf_counter()
            going = session.running and not self._awaits_page(now)
            if going:
                due = max(due, now - BEHIND)
                until = now + FRAME / 2.0
                while due <= now < until:
                    self._step()
                    due += session.period
                    now = clock.perf_counter()
                    if not session.running:
                        break
            else:
                due = now
            if now >= self._next_frame and self._unseen < UNSEEN:
                self._send(now)
            wait = (min(due, self._next_frame) if going else self._next_frame) - clock.perf_counter()
            self._connection.poll(wait if wait > LEAST_WAIT else 0.0)

    def _awaits_page(self, now: float) -> bool:
        """Whether the page, which may load meshes for seconds, does not show yet what was loaded: nothing of the
        motion is to be missed."""
        if now >= self._hold_end:
            self._awaited = 0
        return self._awaited > 0

    def _step(self) -> None:
        try:
            self._session.step()
        except Exception as error:  # the arm stays where it is, until somebody lets it run again
            self._hold(f"the step at {self._session.time:.3f} s failed, the loop is paused", error)

    def _answer(self) -> None:
        """Does the commands that have arrived, of a stream of places only the latest."""
        commands: list[m.Command] = []
        while self._connection.poll():
            add(commands, self._connection.recv())
        for command in commands:
            if isinstance(command, m.Seen):
                self._unseen -= 1
                continue
            if isinstance(command, m.Drawn):
                if command.edition >= self._awaited:
                    self._awaited = 0
                continue
            try:
                self._session.handle(command)
                if isinstance(command, m.Load):
                    self._awaited = self._session.edition
                    self._hold_end = clock.perf_counter() + LONGEST_HOLD
                self._said = ""
            except (ValueError, OSError, MissingExtraError) as error:
                self._connection.send(m.Failed(str(error), refused=command))
            except Exception as error:
                self._hold(f"{type(command).__name__} failed, the loop is paused", error)
            self._next_frame = min(self._next_frame, self._sent + FRAME)  # shown as soon as may be

    def _send(self, now: float) -> None:
        self._marks.append((now, self._session.time))
        self._marks = [mark for mark in self._marks if mark[0] > now - 1.0]
        (t0, s0), (t1, s1) = self._marks[0], self._marks[-1]
        ratio = (s1 - s0) / (t1 - t0) if t1 > t0 and s1 >= s0 else 0.0
        self._sent, self._next_frame = now, now + (FRAME if self._session.running else IDLE_FRAME)
        try:
            snapshot = self._session.snapshot(real_time=ratio)
        except Exception as error:
            self._hold("the state cannot be shown, the loop is paused", error)
            return
        self._connection.send(snapshot)
        self._unseen += 1

    def _hold(self, what: str, error: Exception) -> None:
        """Stops the time, in which the arm moves, and says why; the same not twice in a row."""
        self._session.running = False
        text = f"{what}: {type(error).__name__}: {error}"
        if text != self._said:
            self._said = text
            logging.getLogger(__name__).error(text, exc_info=error)
            self._connection.send(m.Failed(text))


def main() -> None:
    """Entry point of the process."""
    sys.setswitchinterval(SWITCH)
    with contextlib.suppress(EOFError, BrokenPipeError, ConnectionResetError, KeyboardInterrupt):
        serve(connect_to_parent())


if __name__ == "__main__":
    main()
