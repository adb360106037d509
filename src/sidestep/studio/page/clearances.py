"""The clearances of the exact meshes, which are measured beside the loop."""

from __future__ import annotations

import html

import numpy as np

from sidestep.distance.clearance import Clearance
from sidestep.studio.scene_obstacle import SceneObstacle, thing_of


class Clearances:
    """What was measured last.

    Attributes:
        found: of the links, nearest first. time: they belong to [s]. least: of the motion so far [m].
        epoch: grows when clearances that were asked for before no longer count.
    """

    def __init__(self) -> None:
        self.found: tuple[Clearance, ...] = ()
        self.time = self.least = np.inf
        self.epoch = 0
        self.forget()

    @property
    def nearest(self) -> float:
        """[m]"""
        return self.found[0].distance if self.found else np.inf

    def forget(self) -> None:
        """What was measured is of other obstacles, or of another time."""
        self.epoch += 1
        self.found, self.time = (), np.nan

    def take(self, found: tuple[Clearance, ...], time: float, epoch: int, *, live: bool) -> None:
        """What was measured of a time [s], and the `epoch` in which it was asked for. live: not of a recording."""
        if epoch != self.epoch:
            return
        self.found, self.time = found, time
        if found and live:
            self.least = min(self.least, found[0].distance)

    def facts(self, things: tuple[SceneObstacle, ...], more: str = "") -> list[str]:
        """The nearest pair in words, as HTML."""
        if not self.found:
            return []
        first = self.found[0]
        pair = f"{html.escape(first.link)} – {html.escape(thing_of(first.obstacle, things))}"
        return [f"exact meshes: {pair} {1e3 * first.distance:.0f} mm{more}"]
