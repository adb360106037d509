"""Why the arm moves as it does, and what has happened: taken from the controller's last step."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from sidestep._core import Activity, Controller, CoordinateKind, Limit, Obstacles, SafetyStatus

Array = npt.NDArray[np.float64]

EVENTS = 6  # that are kept
AGAIN = 1.0  # [s] after which the same event is told once more
SAME = 1e-3  # [rad | m] between the end of a path and the goal it belongs to
NO_PATH: Array = np.zeros((0, 0))
ACTIVITIES = {
    Activity.waiting: "waiting",
    Activity.arrived: "arrived",
    Activity.blocked: "no way to the goal",
    Activity.stale: "stops: obstacles are too old",
}
STATUSES = {  # `stale` is told as an activity
    SafetyStatus.relaxed: "limits gave way to clearances",
    SafetyStatus.margin_lost: "a safety margin is lost",
    SafetyStatus.tracking_lost: "the arm is not where it was commanded",
    SafetyStatus.stopping: "stopping",
    SafetyStatus.clearance_lost: "clearance lost",
}
LIMITS = {  # that are worth an event
    "torque": Limit.torque_lower | Limit.torque_upper,
    "position": Limit.position_lower | Limit.position_upper,
    "speed": Limit.velocity_lower | Limit.velocity_upper,
}
LASTING_LIMIT = 0.15  # [s] the same of a limit of a joint
LASTING = 0.05  # [s] that something keeps bending the motion before it counts as an event


@dataclass(frozen=True, eq=False)
class Reason:
    """What draws the arm, and what holds it back.

    Attributes:
        path: waypoints (W, nv) from about where the arm is to its goal, straight between them; none where it follows
            no path of the planner.
        pull: (nv,) [rad/s^2 | m/s^2] attraction by goal or path, before obstacles bend it.
        link: whose clearance bends the motion most; "": none. obstacle: to which obstacle; "": to another link or a
            joint limit. point: (3,) [m] the obstacle's point that counts, and its radius [m].
        stepping_aside: whether a trajectory out of the way of what moves is followed.
    """

    path: Array = field(default_factory=lambda: NO_PATH)
    pull: Array = field(default_factory=lambda: np.zeros(0))
    link: str = ""
    obstacle: str = ""
    point: Array | None = None
    radius: float = 0.0
    stepping_aside: bool = False


def reason_of(controller: Controller, obstacles: Obstacles, q: Array) -> Reason:
    """Of the last step of a controller among obstacles, at q (nv,)."""
    command = controller.command
    link, obstacle, index = binding(controller, obstacles)
    return Reason(
        path_from(q, np.array(controller.plan.path), controller.target) if command.on_path else NO_PATH,
        -controller.geometric_step.goal_gradient,
        link,
        obstacle,
        obstacles.points[index] if index >= 0 else None,
        float(obstacles.radii[index]) if index >= 0 else 0.0,
        command.avoiding,
    )


def path_from(q: Array, found: Array, target: Array | None) -> Array:
    """What is left of a path that was found, from q (nv,) on; straight to the target where it leads elsewhere.

    A goal that can be reached in a straight line has no search, and what was found last belongs to an earlier goal.
    """
    if target is None:
        return NO_PATH
    if len(found) < 2 or np.abs(found[-1] - target).max() > SAME:
        return np.array([q, target])
    along, begin = np.diff(found, axis=0), found[:-1]
    squared = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    shares = np.clip(((q - begin) * along).sum(axis=1) / squared, 0.0, 1.0)
    nearest = int(np.linalg.norm(begin + shares[:, None] * along - q, axis=1).argmin())
    return np.vstack([q, found[nearest + 1 :]])


def binding(controller: Controller, obstacles: Obstacles) -> tuple[str, str, int]:
    """Whose clearance bends the motion of the last step most: link, obstacle and the index of its point, else -1."""
    command = controller.command
    if command.bound_by < 0:
        return "", "", -1
    label = controller.labels[command.bound_by]
    if label.kind == CoordinateKind.effort:
        return "", "", -1
    if label.kind != CoordinateKind.obstacle:
        return label.name, "", -1
    index = controller.geometric_step.clearances.nearest[command.bound_by]
    if not 0 <= index < len(obstacles):
        return label.name, "", -1
    return label.name, obstacles.name_of(index) or "", index


@dataclass(frozen=True)
class EventRecord:
    """What events are changes of.

    Attributes:
        activity: of the command. stepping_aside: see `Reason`. searches: paths that were looked for.
        link, obstacle: see `Reason`. status: of the command. limit: that holds a joint back, in words; "": none.
    """

    activity: Activity
    stepping_aside: bool
    searches: int
    link: str
    obstacle: str
    status: SafetyStatus = SafetyStatus.ok
    limit: str = ""


def limit_in_words(limits: Sequence[Limit], names: Sequence[str]) -> str:
    """The first joint that torque, speed or position limit hold back, such as "torque of joint2"; "" without one."""
    for what, flags in LIMITS.items():
        for name, limit in zip(names, limits, strict=True):
            if limit & flags:
                return f"{what} of {name}"
    return ""


class Events:
    """The last things that happened, told as changes from one moment to the next."""

    def __init__(self) -> None:
        self._told: deque[tuple[float, str]] = deque(maxlen=EVENTS)
        self._last: EventRecord | None = None
        self._lasting: dict[
            str, tuple[str, float]
        ] = {}  # what is the case, and since when [s]; inf: it was told

    @property
    def told(self) -> tuple[tuple[float, str], ...]:
        """Simulated times [s] and words, oldest first."""
        return tuple(self._told)

    def tell(self, time: float, words: str) -> None:
        """Adds an event, unless it was told within the last second."""
        if not any(words == known and time - then < AGAIN for then, known in self._told):
            self._told.append((time, words))

    def take(self, time: float, now: EventRecord) -> None:
        """Tells what has changed since the moment before."""
        before = self._last
        self._last = now
        if before is None:
            return
        if now.activity != before.activity and now.activity in ACTIVITIES:
            self.tell(time, ACTIVITIES[now.activity])
        if now.searches > before.searches:
            self.tell(time, "path planned" if before.searches == 0 else "planned anew")
        if now.stepping_aside and not before.stepping_aside:
            self.tell(time, f"stepped aside from {now.obstacle}" if now.obstacle else "stepped aside")
        if now.status != before.status and now.status in STATUSES:
            self.tell(time, STATUSES[now.status])
        what = now.obstacle or "a limit or another link"
        self._tell_if_it_lasts(time, "bound", f"{now.link} keeps off {what}" if now.link else "", LASTING)
        self._tell_if_it_lasts(time, "limit", f"limited by {now.limit}" if now.limit else "", LASTING_LIMIT)

    def _tell_if_it_lasts(self, time: float, about: str, words: str, long: float) -> None:
        """Tells once what has been the case for so long [s]."""
        known, since = self._lasting.get(about, ("", time))
        if words != known:
            self._lasting[about] = words, time
        elif words and time - since >= long:
            self._lasting[about] = words, np.inf
            self.tell(time, words)
