"""One kill test under way: what is watched, and what is asked of it."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sidestep.arm import Arm
from sidestep.bench.kill_programs import READY, ROBOT, START, Programs, Watcher
from sidestep.link import Client

Array = npt.NDArray[np.float64]

GOAL = START * np.array([-1, 1, 1, 1, 1, 1, 1])
MOVING = 0.5  # [rad/s] of the fastest joint when something is killed
REST = 0.01  # [rad/s] that counts as rest
RESTS = 0.2  # [s] for which it must rest
LONGEST_REST = 5.0  # [s] until it does
LONGEST_WAY = 40.0  # [s] to the goal
SLACK = 1.02  # of limits: the simulated robot tracks with a small error
ENCODERS = 1e-3  # [rad] beyond a position limit that is rounding
NEAR = 0.02  # [rad] from the goal
#: What a server says where a busy machine has stopped the arm.
BUSY = (
    "the machine is too busy",
    "went without commands for too long",
    "age of the state",
    "time without a report of the loop",
)


class TrialError(RuntimeError):
    """The case did not come about."""


@dataclass
class KillOutcome:
    """What became of one case.

    Attributes:
        case, number: which.
        speed: of the fastest joint at the kill [rad/s].
        rest: time from the kill until the arm is at rest for good [s]; None: it is not.
        moved: largest way of a joint until then [rad].
        limits: positions and velocities stayed within the limits.
        why: what the server or the loop says. says_why: it says what has happened.
        resumed: the arm was led to its goal afterwards.
        lost: time before the kill that the recording lacks [s]; None: nothing was recorded.
        error: what went wrong with the test itself.
        busy: tries before this one, in which a busy machine had stopped the arm by itself.
    """

    case: str
    number: int
    speed: float = 0.0
    rest: float | None = None
    moved: float = 0.0
    limits: bool = False
    why: str = ""
    says_why: bool = False
    resumed: bool = False
    lost: float | None = None
    error: str = ""
    busy: int = 0

    @property
    def passed(self) -> bool:
        """The arm came to rest within its limits, said why, and went on; at most a second of the record is lost."""
        stopped = self.rest is not None and self.rest < LONGEST_REST and self.limits
        recorded = self.lost is None or self.lost <= 1.0
        return stopped and self.says_why and self.resumed and recorded and not self.error

    def was_disturbed(self, said: str) -> bool:
        """Whether a busy machine stopped the arm first, within its limits. said: what the server has printed."""
        harmless = self.limits or bool(self.error)
        return harmless and not self.says_why and any(words in said for words in BUSY)


@dataclass
class Trial:
    """One case under way."""

    outcome: KillOutcome
    programs: Programs
    seen: Watcher | None
    arm: Arm = field(default_factory=lambda: Arm.load(ROBOT))

    @property
    def watcher(self) -> Watcher:
        """What reads the simulator's states."""
        assert self.seen is not None
        return self.seen

    def lead(self, client: Client) -> None:
        """Sends the arm to the goal."""
        client.take_command(force=True)
        client.set_goal(GOAL)

    def wait_until_moving(self, client: Client | None = None) -> None:
        """Waits until the arm is at speed.

        client: the one in command, if it is here. It resumes each second: a busy machine may stop the arm first.
        """

        def fast(q: Array, v: Array) -> bool:
            return bool(np.abs(v).max() > MOVING)

        end = time.monotonic() + READY
        while time.monotonic() < end and self.programs.processes["simulator"].poll() is None:
            if self.watcher.look(1.0, fast):
                self.outcome.speed = float(np.abs(self.watcher.rows[-1][2]).max())
                return
            if client is not None:
                client.resume()
        said = " ".join(self.programs.said("server").split())[-300:]
        raise TrialError(f"the arm did not move; the server said: {said}")

    def watch_rest(self, killed: float) -> None:
        """Watches until the arm has been at rest for a while, and judges the way there."""
        since: list[float] = []

        def rests(q: Array, v: Array) -> bool:
            if np.abs(v).max() > REST:
                since.clear()
            elif not since:
                since.append(time.monotonic())
            return bool(since) and time.monotonic() - since[0] > RESTS

        if self.watcher.look(LONGEST_REST + RESTS, rests):
            self.outcome.rest = max(0.0, since[0] - killed)
        self.judge(killed)

    def judge(self, killed: float) -> None:
        """Whether positions and velocities of the motion since the kill are within the limits."""
        rows = [(q, v) for at, q, v in self.watcher.rows if at >= killed]
        if not rows:
            return
        q, v = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
        self.outcome.limits = self._is_within_limits(q, v)
        self.outcome.moved = float(np.abs(q - q[0]).max())

    def judge_motion(self) -> None:
        """Judges the motion that the simulator wrote: from its first fast moment to its first rest after that."""
        with np.load(self.programs.motion) as motion:
            t, q, v = motion["time"], motion["q"], motion["v"]
        speed = np.abs(v).max(axis=1)
        fast = np.flatnonzero(speed >= 0.9 * self.outcome.speed)
        at_rest = np.flatnonzero(speed < REST)
        after = at_rest[at_rest > fast[0]] if len(fast) else at_rest[:0]
        if len(after):
            last = fast[fast < after[0]][-1]
            self.outcome.rest = float(t[after[0]] - t[last])
            self.outcome.moved = float(np.abs(q[after[0]] - q[last]).max())
        self.outcome.limits = self._is_within_limits(q, v)

    def resume(self, client: Client) -> None:
        """Leads the arm to its goal after the event; whether it arrives."""
        self.lead(client)
        end = time.monotonic() + LONGEST_WAY

        def there(q: Array, v: Array) -> bool:
            return bool(np.abs(q - GOAL).max() < NEAR)

        while time.monotonic() < end:
            client.resume()  # as in `wait_until_moving`
            if self.watcher.look(1.0, there):
                self.outcome.resumed = True
                return

    def explain(self, text: str, *words: str) -> None:
        """Takes over what is said, which must name what happened."""
        self.outcome.why = " ".join(text.split())[-300:]
        self.outcome.says_why = any(word in text for word in words)

    def _is_within_limits(self, q: Array, v: Array) -> bool:
        limits = self.arm.limits
        inside = (q >= limits.lower - ENCODERS) & (q <= limits.upper + ENCODERS)
        return bool(inside.all() and (np.abs(v) <= SLACK * limits.velocity).all())


def unrecorded(path: Path, killed: float) -> float:
    """Time from the last recorded step to the kill [s], on the robot's clock; inf where the file cannot be read."""
    from sidestep.report import load_recording

    try:
        times = load_recording(path).time
    except (OSError, ValueError):
        return float("inf")
    return max(0.0, killed - float(times[-1])) if len(times) else float("inf")
