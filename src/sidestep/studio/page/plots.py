"""Live plots of the last seconds."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sidestep.drawing import palette
from sidestep.studio.page import colours
from sidestep.studio.page.marks import GAP

if TYPE_CHECKING:
    import viser

    from sidestep.studio.messages import Snapshot

Array = npt.NDArray[np.float64]

SPAN = 12.0  # [s] that is shown
EVERY = 0.4  # [s] of the wall clock between two drawings
HEIGHT, TIMES = 53, 24  # [px] of a plot, and of the times below the last one

# name, title with unit, factor, decimals (no finer: an arm at rest has labels that can be read), colour, and up to
# where the axis reaches at least: it contains zero, and so much, that two of its labels can always be read
PLOTS = (
    ("clearance", "exact clearance [mm]", 1e3, 0, colours.NEAR, 100.0),
    ("speed", "fastest joint [% of its limit]", 1e2, 1, palette.BLACK, 100.0),
    ("torque", "largest torque [% of its limit]", 1e2, 1, palette.BLACK, 100.0),
    ("step", "time of a step, p99 [ms]", 1e-3, 2, palette.BLACK, 1.0),
)
NOTHING = (np.array([-SPAN, 0.0]), np.array([np.nan, np.nan]))  # a plot without a line


class Plots:
    """One small plot for each quantity, all over the same time axis."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._rows: deque[tuple[float, ...]] = deque()
        self._drawn, self._stale = 0.0, False
        self._handles: list[Any] = []
        for name, title, _, _, colour, least in PLOTS:
            last = name == PLOTS[-1][0]
            self._handles.append(
                server.gui.add_uplot(
                    NOTHING,
                    ({"label": "t"}, {"label": title, "stroke": colour, "width": 2}),
                    title=title,
                    scales={"x": {"time": False, "range": (-SPAN, 0.0)}, "y": {"range": range_to(least)}},
                    axes=({"show": last, "size": TIMES, "space": 30}, {"size": 62, "space": 18}),
                    legend={"show": False},
                    cursor={"show": False},
                    height=HEIGHT + TIMES * last,
                    padding=(6, 10, 0 if last else 6, 0),
                )
            )
        server.gui.add_html(
            '<div style="font-size:12px;text-align:center;margin-top:-8px">time before now [s]</div>'
        )

    def add(self, snapshot: Snapshot, clearance: float) -> tuple[float, ...] | None:
        """Takes what is plotted, and returns it; a time before the last one (a restart) begins anew."""
        if self._rows and snapshot.time < self._rows[-1][0]:
            self._rows.clear()
            for handle in self._handles:
                handle.data = NOTHING
        if not snapshot.status or (self._rows and snapshot.time == self._rows[-1][0]):
            return None  # there was no step yet, or none since
        self._rows.append(
            (
                snapshot.time,
                clearance if np.isfinite(clearance) else np.nan,
                snapshot.speed_share,
                snapshot.torque_share,
                snapshot.timing.p99,
            )
        )
        self._stale = True
        while self._rows[-1][0] - self._rows[0][0] > SPAN:
            self._rows.popleft()
        return self._rows[-1]

    def draw(self, now: float, *, at_once: bool = False, anew: bool = False) -> None:
        """Sends the plots if there is something new, or `anew`; not more often than `EVERY` unless `at_once`."""
        if (self._stale or anew) and (now - self._drawn >= EVERY or at_once):
            self._drawn, self._stale = now, False
            self._send(self.rows)

    def draw_past(self, now: float, rows: Sequence[tuple[float, ...]], time: float) -> None:
        """In place of the live plots: rows up to a time [s]."""
        if now - self._drawn >= EVERY:
            self._drawn = now
            self._send(np.array([row for row in rows if time - SPAN <= row[0] <= time]))

    def _send(self, rows: Array) -> None:
        if len(rows):  # what is before a gap is left out: viser's lines cannot be broken
            gaps = np.flatnonzero(np.diff(rows[:, 0]) > GAP)
            rows = rows[gaps[-1] + 1 :] if len(gaps) else rows
        if len(rows) < 2:
            for handle in self._handles:
                handle.data = NOTHING
            return
        columns = rows.T
        before_now = (
            columns[0] - columns[0, -1]
        )  # the scales stay as they are: changing them is slow in the browser
        for handle, values, (_, _, factor, decimals, _, _) in zip(
            self._handles, columns[1:], PLOTS, strict=True
        ):
            known = np.isfinite(values)  # a single unknown value would empty the plot
            shown = np.round(factor * values[known], decimals)
            handle.data = (before_now[known], shown) if known.sum() > 1 else NOTHING

    @property
    def rows(self) -> Array:
        """What is shown, (n, 5): time and the four quantities, in SI units (the step in microseconds)."""
        return np.array(self._rows).reshape(-1, 1 + len(PLOTS))


def range_to(least: float) -> dict[str, Any]:
    """The range of an axis, as uPlot has it: from 0 to `least`, and beyond where values are."""
    return {"min": {"pad": 0.1, "soft": 0.0, "mode": 1}, "max": {"pad": 0.1, "soft": least, "mode": 1}}
