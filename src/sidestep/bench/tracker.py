"""What a controller is told of something that comes: as it is, wrongly, late, or by a tracker that fails."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from sidestep._core import Controller, Obstacles
from sidestep.bench.encounters import PERIOD
from sidestep.bench.sensor_fault import SensorFault
from sidestep.distance import SceneObject
from sidestep.obstacles import Shape

Array = npt.NDArray[np.float64]

SEEN_EVERY = 33  # periods between two sets of obstacles: 30 Hz
OFF = 0.3  # share by which a wrong velocity is wrong
LATE = (0.05, 0.10)  # [s] by which positions are old
LOST = 0.3  # share of the sets that are lost
GONE = 1.0  # [s] for which sets are empty
VALID_FOR = 0.2  # [s] for which a set with a stamp is valid: six sets, and twice the oldest stamp


class Told(StrEnum):
    """What the controller is told of the velocity and of the time.

    Sets from `late_stamped` on are of the source "tracker", with a time and `VALID_FOR`.
    """

    exact = "exact"  #: position and velocity as they are
    wrong = "wrong"  #: the velocity is 30 % off, in size or direction
    untold = "untold"  #: no velocity
    late = "late"  #: the position is 50 to 100 ms old without saying so, the velocity is right
    late_stamped = "late_stamped"  #: the same, with the time of capture
    arrival = "arrival"  #: the same, with the time of arrival in place of that of capture
    lost30 = "lost30"  #: 30 % of the sets are lost
    frozen = "frozen"  #: from some moment on the last set comes again and again, with new stamps
    vanished = "vanished"  #: the sets are empty for 1 s
    vanished_untold = "vanished_untold"  #: the same without velocities
    dead = "dead"  #: from some moment on nothing comes
    dead_untold = "dead_untold"  #: the same without velocities

    @property
    def is_stamped(self) -> bool:
        """Sets have a source, a time and a time for which they are valid."""
        return self not in (Told.exact, Told.wrong, Told.untold, Told.late)

    @property
    def is_late(self) -> bool:
        """Positions are old when they come."""
        return self in (Told.late, Told.late_stamped, Told.arrival)

    @property
    def fails(self) -> bool:
        """The tracker fails at some moment."""
        return self in (Told.frozen, Told.vanished, Told.vanished_untold, Told.dead, Told.dead_untold)

    @property
    def has_velocity(self) -> bool:
        """The controller is told of a velocity."""
        return self not in (Told.untold, Told.vanished_untold, Told.dead_untold)

    def fault_at(self, time: float) -> SensorFault:
        """Of a tracker that fails at a time [s]."""
        vanishes = self in (Told.vanished, Told.vanished_untold)
        return SensorFault(time, time + GONE if vanishes else math.inf, VALID_FOR)


class After(StrEnum):
    """What the obstacle does when its tracker fails."""

    stands = "stands"  #: it stands still from that moment on
    goes_on = "goes_on"  #: it goes on


@dataclass(frozen=True, eq=False)
class Tracker:
    """What tells a controller of one solid at 30 Hz.

    Attributes:
        solid: as it is. told: what is wrong. velocity: (3,) that is told while it moves [m/s].
        lag: by which positions are old [s], where they are late. lost: by the number of a set, where some are.
        fault: of one that fails.
    """

    solid: SceneObject
    told: Told
    velocity: Array
    lag: float
    lost: npt.NDArray[np.bool_]
    fault: SensorFault | None

    def tell(self, controller: Controller, step: int) -> None:
        """Hands over what comes before a step, if anything does."""
        if step % SEEN_EVERY:
            return
        now = step * PERIOD
        captured = now - self.lag if self.told.is_late else now
        if not self.told.is_stamped:
            controller.set_obstacles(self._seen_at(max(0.0, captured)))
        elif self._arrives(step, captured):
            captured = max(0.0, captured)
            stamp = captured if self.told is Told.late_stamped else now
            controller.set_obstacles(self._set(now, captured), "tracker", time=stamp, valid_for=VALID_FOR)

    def _arrives(self, step: int, captured: float) -> bool:
        if self.told is Told.lost30:
            return not self.lost[step // SEEN_EVERY]
        dead = self.told in (Told.dead, Told.dead_untold) and self._fails(step * PERIOD)
        return not dead and (captured >= 0.0 or step == 0)

    def _fails(self, now: float) -> bool:
        return self.fault is not None and self.fault.is_on(now)

    def _set(self, now: float, captured: float) -> Shape | Obstacles:
        if not self._fails(now):
            return self._seen_at(captured)
        assert self.fault is not None
        return self._seen_at(self.fault.begins) if self.told is Told.frozen else Obstacles.none()

    def _seen_at(self, time: float) -> Shape:
        pose = self.solid.pose_at(time)
        velocity = self.velocity if time <= self.solid.moves_during[1] else np.zeros(3)
        return replace(self.solid.shape, pose=pose, velocity=velocity, name=self.solid.name)  # type: ignore[type-var]
