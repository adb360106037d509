"""Which links touch, on the exact meshes: measured beside the page, once the joints rest."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from sidestep.robot import Robot

Array = npt.NDArray[np.float64]
Pair = tuple[str, str]

REST = 0.3  # [s] without a new configuration, after which one is measured


@dataclass(frozen=True)
class Touching:
    """What touches at a configuration.

    Attributes:
        pairs: of links that touch, of those that are checked. left_out: pairs that are not checked, and why, see
            `SelfCollision`. reason: why nothing is measured, else empty.
    """

    pairs: tuple[Pair, ...] = ()
    left_out: dict[Pair, str] = field(default_factory=dict)
    reason: str = ""

    def to_document(self) -> dict[str, Any]:
        """As plain values."""
        return {
            "pairs": [list(pair) for pair in self.pairs],
            "left_out": [{"links": list(pair), "reason": why} for pair, why in self.left_out.items()],
            "reason": self.reason,
        }


class TouchCheck:
    """Measures which links of a robot touch; the first time prepares that, which may take seconds."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._check: Any = None

    def at(self, q: Array) -> Touching:
        """What touches at q (nv,)."""
        from sidestep.distance import SelfCollision

        if not any(link.geometries for link in self._robot.links):
            return Touching(reason="there are no meshes to measure on")
        try:
            if self._check is None:
                self._check = SelfCollision(self._robot, allowed=self._robot.allowed_pairs)
            return Touching(self._check.touching(q), dict(self._check.left_out))
        except (ValueError, OSError) as error:  # a mesh that cannot be read
            return Touching(reason=str(error))


class TouchMonitor:
    """A `TouchCheck` in a thread of its own: the latest configuration is measured, others are dropped.

    Args:
        robot: with meshes. tell: called with what touches, and the configuration (nv,) at which it does.
    """

    def __init__(self, robot: Robot, tell: Callable[[Touching, Array], None]) -> None:
        self._check, self._tell = TouchCheck(robot), tell
        self._wake = threading.Condition()
        self._next: Array | None = None
        self._stopping = False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def look(self, q: Array) -> None:
        """Asks what touches at q (nv,)."""
        with self._wake:
            self._next = np.array(q)
            self._wake.notify()

    def stop(self) -> None:
        """Ends the thread after what it measures now."""
        with self._wake:
            self._stopping = True
            self._wake.notify()
        self._thread.join(timeout=2.0)

    def _run(self) -> None:
        while (q := self._resting()) is not None:
            try:
                found = self._check.at(q)
            except Exception as error:  # the page goes on; it says so
                found = Touching(reason=f"{type(error).__name__}: {error}")
            with self._wake:
                stale = self._next is not None
            if not stale:
                self._tell(found, q)

    def _resting(self) -> Array | None:
        """Waits for a configuration that stays for a moment; None at the end."""
        with self._wake:
            self._wake.wait_for(lambda: self._next is not None or self._stopping)
            while not self._stopping:
                q = self._next
                if not self._wake.wait_for(lambda q=q: self._next is not q or self._stopping, timeout=REST):  # type: ignore[misc]
                    self._next = None
                    return q
            return None
