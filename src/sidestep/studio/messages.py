"""What the page and the loop tell each other: commands one way, snapshots the other. Plain values only."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from sidestep.scenario import Scenario
from sidestep.simulation.pose_target import IkSolution
from sidestep.studio.camera_choice import CameraChoice
from sidestep.studio.parameters import Numbers
from sidestep.studio.reason import Reason
from sidestep.studio.scene_obstacle import SceneObstacle
from sidestep.studio.sight import CameraState

Array = npt.NDArray[np.float64]
Course = Literal["file", "held", "left"]


@dataclass(frozen=True)
class SetJointGoal:
    """The configuration (nv,) to go to."""

    position: Array


@dataclass(frozen=True)
class SetPoseGoal:
    """The pose (4, 4) of the tip in the world to go to; thorough: of the thesis's methods, a posture for it is searched
    from everywhere, not only from the last one."""

    pose: Array
    thorough: bool = True


@dataclass(frozen=True)
class AddObstacle:
    """A new obstacle."""

    thing: SceneObstacle


@dataclass(frozen=True)
class ReplaceObstacle:
    """The obstacle of the same name becomes this one, where it is now."""

    thing: SceneObstacle


@dataclass(frozen=True)
class RemoveObstacle:
    """The obstacle called `name` goes away."""

    name: str


@dataclass(frozen=True)
class DragObstacle:
    """The obstacle called `name` is drawn to a pose (4, 4), or put there while the loop is paused; None lets go."""

    name: str
    pose: Array | None


@dataclass(frozen=True)
class ThrowObstacle:
    """The obstacle called `name` flies on with a velocity (3,) [m/s]."""

    name: str
    velocity: Array


@dataclass(frozen=True)
class SetMethod:
    """Another method, with its own numbers."""

    method: str


@dataclass(frozen=True)
class SetNumbers:
    """Other numbers for a method, by name; those that are not named stay as they are."""

    method: str
    numbers: Numbers


@dataclass(frozen=True)
class SetRunning:
    """Runs or pauses the loop; it pauses by itself at simulated time `until` [s]."""

    running: bool
    until: float = float("inf")


@dataclass(frozen=True)
class SetRecording:
    """Begins a recording, or ends it; `Restart` and `Load` end it as well."""

    recording: bool


@dataclass(frozen=True)
class Restart:
    """Back to the start: arm, obstacles and time; it pauses at simulated time `until` [s]."""

    until: float = float("inf")


@dataclass(frozen=True)
class Load:
    """Another scenario, perhaps with another robot, and the method to go on with; None: the one that is on.

    goals: configurations (nv,) that are visited in turn, see `VisitGoals`.
    """

    scenario: Scenario
    method: str | None = None
    goals: tuple[Array, ...] = ()


@dataclass(frozen=True)
class VisitGoals:
    """Goes to one configuration (nv,) after the other, round and round; none: stays with the goal there is."""

    goals: tuple[Array, ...]


@dataclass(frozen=True, eq=False)
class SetCamera:
    """Switches the depth camera on, or changes it; None: off."""

    choice: CameraChoice | None


@dataclass(frozen=True)
class Seen:
    """The page has taken a snapshot: it may have another."""


@dataclass(frozen=True)
class Drawn:
    """The page shows an edition: the loop, which holds the time after `Load` until then, may go on."""

    edition: int


Command: TypeAlias = (
    SetJointGoal
    | SetPoseGoal
    | AddObstacle
    | ReplaceObstacle
    | RemoveObstacle
    | DragObstacle
    | ThrowObstacle
    | SetMethod
    | SetNumbers
    | SetRunning
    | SetRecording
    | Restart
    | Load
    | VisitGoals
    | SetCamera
    | Seen
    | Drawn
)


@dataclass(frozen=True)
class Timing:
    """Times of the steps of the last two seconds [us] and how fast simulated time passes."""

    median: float = 0.0
    p99: float = 0.0
    worst: float = 0.0
    real_time: float = 0.0

    @classmethod
    def of(cls, seconds: Collection[float], real_time: float) -> Timing:
        """Of steps that took so many seconds."""
        if not seconds:
            return cls(real_time=real_time)
        median, p99, worst = 1e6 * np.percentile(np.array(seconds), [50.0, 99.0, 100.0])
        return cls(float(median), float(p99), float(worst), real_time)


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The state of the loop at one moment.

    Attributes:
        scenario: that was loaded last.
        edition: grows when obstacles come or go, or a scenario is loaded; `things` then changed.
        time: simulated [s]. q, v: (nv,). running: or paused.
        goal: (nv,) of a joint goal, else None; goal_pose: (4, 4) of a pose goal, else None, of the frame `tip`;
            posture: where the arm is led to, None where none is found yet. goal_written: it is that of the scenario.
        things: the obstacles; poses: (N, 4, 4) of them in the world; velocities: (N, 3) [m/s];
            courses: by what they move.
        method: its name; numbers: its parameters by method and name.
        draft: the body is coarse; refining: how far a finer one is.
        visited: the configurations that are visited in turn; none where the arm stays with its goal.
        words, status, activity, nearest, values, metric, activations, reason: see `StepRecord`; status is empty before
            the first step.
        events: what happened last, oldest first: simulated time [s] and words.
        torque_share, speed_share: largest of a joint over its limit.
        contacts: links that touch, each "link - obstacle"; touched: steps with contact since the start.
        timing: of the steps. rows: of a recording since the last snapshot. camera: what a depth camera sees.
        attached: another program moves the arm; running then is whether the page follows it.
    """

    scenario: Scenario
    edition: int
    time: float
    running: bool
    q: Array
    v: Array
    goal: Array | None
    goal_pose: Array | None
    posture: IkSolution | None
    goal_written: bool
    draft: bool
    refining: str
    visited: tuple[Array, ...]
    tip: str
    things: tuple[SceneObstacle, ...]
    poses: Array
    velocities: Array
    courses: tuple[Course, ...]
    method: str
    numbers: dict[str, Numbers]
    words: str
    status: str
    activity: str
    nearest: tuple[str, float]
    values: Array
    metric: Array
    activations: Array
    reason: Reason
    events: tuple[tuple[float, str], ...]
    torque_share: float
    speed_share: float
    contacts: tuple[str, ...]
    touched: int
    timing: Timing
    recording: bool
    camera: CameraState
    rows: tuple[Row, ...] = ()
    attached: bool = False


@dataclass(frozen=True, eq=False)
class Row:
    """One moment of a recording: time [s], q (nv,), the obstacles, their poses (N, 4, 4), the metric (nv, nv)."""

    time: float
    q: Array
    things: tuple[SceneObstacle, ...]
    poses: Array
    metric: Array


@dataclass(frozen=True)
class Preparing:
    """The loop does not run yet, or prepares something beside running: what, in words."""

    note: str


@dataclass(frozen=True)
class Failed:
    """A command was refused, or the loop ended, or holds the arm: why, in a sentence.

    refused: the command, which has changed nothing.
    """

    message: str
    fatal: bool = False
    refused: Command | None = None
