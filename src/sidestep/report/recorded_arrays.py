"""A run of one's own as arrays, as the core reads it from a recording or a black box."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from sidestep import _core
from sidestep.report.recorded_events import RecordedEvent, events_of

Array: TypeAlias = npt.NDArray[np.float64]
Words: TypeAlias = npt.NDArray[np.str_]


@dataclass(frozen=True, eq=False, repr=False)
class RecordedArrays:
    """A recorded run as arrays: row k is step k. Rows are read only; copy what you change.

    Attributes:
        core: of the core, with the numbers that the properties name.
        paths: files that it was read from.
        has_scenes: it was read with where the obstacles were.
    """

    core: _core.RecordedRun
    paths: tuple[Path, ...]
    has_scenes: bool

    def __len__(self) -> int:
        return self.core.steps

    def __repr__(self) -> str:
        return f"{type(self).__name__}('{self.arm.name}', {len(self)} steps, {self.duration:.3f} s)"

    @cached_property
    def arm(self) -> _core.Arm:
        """The arm (of the core), as it was recorded first."""
        return self.core.header.arm

    @cached_property
    def settings(self) -> _core.ControllerSettings:
        """Those of the controller."""
        return self.core.header.settings

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the coordinates (nv,)."""
        return tuple(self.arm.robot.coordinate_names)

    @property
    def whole(self) -> bool:
        """Whether it is from the first step on, so that `replay` can repeat it; else of a black box."""
        return self.core.header.whole

    @property
    def complete(self) -> bool:
        """Whether the recording was ended, not cut off."""
        return self.core.complete

    @property
    def lost(self) -> int:
        """Steps that were made and not recorded."""
        return self.core.lost

    @property
    def damage(self) -> str:
        """What is wrong with a file, the first; empty: nothing."""
        return self.core.damage

    @property
    def time(self) -> Array:
        """(steps,) on the clock of `step` [s]."""
        return self.core.time

    @property
    def duration(self) -> float:
        """From the first step to the last [s]."""
        return float(self.time[-1] - self.time[0]) if len(self) > 1 else 0.0

    @property
    def q(self) -> Array:
        """(steps, nv) as measured [rad | m]."""
        return self.core.q

    @property
    def v(self) -> Array:
        """(steps, nv) as measured [rad/s | m/s]."""
        return self.core.v

    @property
    def position(self) -> Array:
        """(steps, nv) as commanded [rad | m]; nan before a state was known."""
        return self.core.position

    @property
    def velocity(self) -> Array:
        """(steps, nv) as commanded [rad/s | m/s]."""
        return self.core.velocity

    @property
    def acceleration(self) -> Array:
        """(steps, nv) as commanded [rad/s² | m/s²]."""
        return self.core.acceleration

    @property
    def wanted(self) -> Array:
        """(steps, nv) acceleration before any limit [rad/s² | m/s²]."""
        return self.core.wanted

    @property
    def torque(self) -> Array:
        """(steps, nv) as commanded, gravity included [Nm | N]."""
        return self.core.torque

    @property
    def torque_without_gravity(self) -> Array:
        """(steps, nv) as commanded [Nm | N]."""
        return self.core.torque_without_gravity

    @cached_property
    def status(self) -> Words:
        """(steps,) names, for example "limited"."""
        return np.array([one.name for one in _core.SafetyStatus])[self.core.status]

    @cached_property
    def activity(self) -> Words:
        """(steps,) names, for example "moving"."""
        return np.array([one.name for one in _core.Activity])[self.core.activity]

    @property
    def clearance(self) -> Array:
        """(steps,) least of the covering body [m]; inf: far, nan: unknown."""
        return self.core.clearance

    @cached_property
    def link(self) -> Words:
        """(steps,) link with that clearance; empty where nothing is near."""
        return np.array([link for link, _ in self.core.parties] + [""])[self.core.nearest]  # -1: the last

    @cached_property
    def nearest(self) -> Words:
        """(steps,) what that clearance is of in words, "link 'hand' and 'ball'"; empty where nothing is near."""
        return self._parties[self.core.nearest]

    @cached_property
    def bound_by(self) -> Words:
        """(steps,) what changes the motion most, in the same words; empty: nothing."""
        return self._parties[self.core.bound_by]

    @property
    def distance(self) -> Array:
        """(steps,) to the nearest obstacle [m]; inf: farther than `speed_limits.far_distance`, or without these."""
        return self.core.distance

    @property
    def tracking_error(self) -> Array:
        """(steps,) of the farthest joint [rad | m]."""
        return self.core.tracking_error

    @property
    def speed(self) -> Array:
        """(steps,) of the fastest frame [m/s]."""
        return self.core.speed

    @property
    def speed_limit(self) -> Array:
        """(steps,) for every frame [m/s]; inf: none."""
        return self.core.speed_limit

    @cached_property
    def links(self) -> tuple[str, ...]:
        """Names of the links, and "the arm itself"."""
        return tuple(self.core.links)

    @property
    def link_time(self) -> Array:
        """(moments,) of `link_clearance` [s]."""
        return self.core.link_time

    @property
    def link_clearance(self) -> Array:
        """(moments, links) of each link to what is around, and of the arm to itself [m]; inf: farther than 0.5 m.

        The clearance query computes it from the recorded q and obstacles.
        """
        return self.core.link_clearance

    @cached_property
    def events(self) -> tuple[RecordedEvent, ...]:
        """When request, activity or status changed, in words."""
        return events_of(self.core)

    def explain(self, step: int) -> str:
        """How safe a step (from 0) was and why, in one sentence, from what was recorded.

        Raises:
            IndexError: there is no such step.
        """
        return self.core.explain(step)

    def scene(self, moment: int) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
        """Centres (N, 3) [m] and radii (N,) [m] of the obstacles at a moment of `link_time`.

        Raises:
            IndexError: there is no such moment, or it was read without scenes.
        """
        return self.core.scene(moment)

    @cached_property
    def _parties(self) -> Words:
        return np.array([words for _, words in self.core.parties] + [""])  # the last for -1
