"""Live plots of the last seconds."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sidestep.drawing import palette
from sidestep.studio.page import colours

if TYPE_CHECKING:
    import viser

    from sidestep.studio.messages import Snapshot

Array = npt.NDArray[np.float64]

SPAN = 12.0  # [s] that is shown
EVERY = 0.2  # [s] of the wall clock between two drawings
HEIGHT = 78  # [px]

# name, title with unit, factor, colour, lowest upper end of the axis
PLOTS = (
    ("clearance", "exact clearance [mm]", 1e3, colours.NEAR, 50.0),
    ("psi", "height of the embedding |ψ|", 1.0, palette.BLACK, 0.1),
    ("speed", "fastest joint [% of its limit]", 1e2, palette.BLACK, 10.0),
    ("torque", "largest torque [% of its limit]", 1e2, palette.BLACK, 10.0),
    ("step", "time of a step, p99 [µs]", 1.0, palette.BLACK, 200.0),
)


class Plots:
    """One small plot for each quantity, all over the same time axis."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._rows: deque[tuple[float, ...]] = deque()
        self._drawn = 0.0
        self._handles: list[Any] = []
        start = np.array([0.0, 1.0])
        for _, title, _, colour, top in PLOTS:
            self._handles.append(
                server.gui.add_uplot(
                    (start, np.zeros(2)),
                    ({"label": "t"}, {"label": title, "stroke": colour, "width": 2}),
                    title=title,
                    scales={"x": {"time": False, "range": (0.0, SPAN)}, "y": {"range": (0.0, top)}},
                    axes=({"show": False}, {"size": 46, "space": 24}),
                    legend={"show": False},
                    cursor={"show": False},
                    height=HEIGHT,
                    padding=(4, 10, 0, 0),
                )
            )

    def add(self, snapshot: Snapshot, clearance: float) -> None:
        """Takes what is plotted; a time before the last one (a restart) begins anew."""
        if self._rows and snapshot.time < self._rows[-1][0]:
            self._rows.clear()
        if self._rows and snapshot.time == self._rows[-1][0]:
            return
        height = float(np.linalg.norm(snapshot.values))
        self._rows.append(
            (
                snapshot.time,
                clearance if np.isfinite(clearance) else np.nan,
                height,
                snapshot.speed_share,
                snapshot.torque_share,
                snapshot.timing.p99,
            )
        )
        while self._rows[-1][0] - self._rows[0][0] > SPAN:
            self._rows.popleft()

    def draw(self, now: float) -> None:
        """Sends the plots, not more often than `EVERY`."""
        if now - self._drawn < EVERY or len(self._rows) < 2:
            return
        self._drawn = now
        columns = np.array(self._rows).T
        end = max(SPAN, float(columns[0, -1]))
        for handle, values, (_, _, factor, _, top) in zip(self._handles, columns[1:], PLOTS, strict=True):
            scaled = factor * values
            highest = np.nanmax(scaled) if np.isfinite(scaled).any() else top
            lowest = min(0.0, float(np.nanmin(scaled))) if np.isfinite(scaled).any() else 0.0
            handle.scales = {
                "x": {"time": False, "range": (end - SPAN, end)},
                "y": {"range": (1.1 * lowest, max(top, 1.1 * float(highest)))},
            }
            handle.data = (columns[0], scaled)

    @property
    def rows(self) -> Array:
        """What is shown, (n, 6): time and the five quantities, in SI units (the step in microseconds)."""
        return np.array(self._rows).reshape(-1, 1 + len(PLOTS))
