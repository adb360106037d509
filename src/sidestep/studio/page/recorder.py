"""A recording of the motion, and its replay on the page."""

from __future__ import annotations

import io
import time as clock
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sidestep.studio import messages as m
from sidestep.studio.page.loop_link import LoopLink
from sidestep.studio.page.note import add_note

if TYPE_CHECKING:
    import viser


Array = npt.NDArray[np.float64]


class Recorder:
    """Records rows while the loop runs, and shows them again in place of the live state.

    Attributes:
        rows: of the last recording. plotted: what the plots showed meanwhile.
    """

    def __init__(self, server: viser.ViserServer, loop: LoopLink) -> None:
        self._loop = loop
        self.rows: list[m.Row] = []
        self.plotted: list[tuple[float, ...]] = []
        self._replaying, self._since, self._of_this_arm = False, 0.0, True
        self._ran = False  # the loop, before the replay paused it
        gui = server.gui
        gui.add_button_group("record", ("Record", "Stop")).on_click(self._on_record)
        gui.add_button_group("replay", ("Play", "Live")).on_click(self._on_replay)
        self._slider: Any = gui.add_slider(
            "moment [s]", min=0.0, max=1.0, step=0.01, initial_value=0.0, disabled=True
        )
        self._slider.on_update(self._on_moment)
        gui.add_button("Download recording").on_click(self._on_save)
        self.state: Any = gui.add_markdown("nothing recorded")
        add_note(
            gui,
            "200 states a second (60 of an arm that another program moves); Restart and loading end a recording. Play "
            "shows it while the loop is paused, Live the loop, which goes on if it ran; an arm that another program "
            "moves goes on meanwhile. The download is NumPy's .npz: time [s], q [rad | m], "
            "poses and names of obstacles.",
        )

    @property
    def replaying(self) -> bool:
        """Whether the recording is shown in place of the live state."""
        return self._replaying

    @property
    def length(self) -> float:
        """Of the recording [s]."""
        return self.rows[-1].time - self.rows[0].time if self.rows else 0.0

    def take(self, rows: list[m.Row]) -> None:
        """Rows that the loop has recorded."""
        if rows:
            if self.rows and rows[0].time <= self.rows[-1].time:
                self._begin()  # of another recording
            self.rows += rows

    def show(self, recording: bool) -> None:
        """Says whether the loop records, and how much there is."""
        if self.rows or recording:
            text = f"{'recording' if recording else 'recorded'} {self.length:.1f} s"
            if not self._of_this_arm:
                text += " of another robot model"
            if text != self.state.content:
                self.state.content = text

    def current(self) -> int | None:
        """The index of the row that is shown now, None when the live state is."""
        if not self._replaying or not self.rows:
            return None
        if self._since > 0.0:
            moment = min(clock.monotonic() - self._since, self.length)
            self._slider.value = round(moment, 2)
            if moment >= self.length:
                self._since = 0.0
        times = [row.time for row in self.rows]
        index = int(np.searchsorted(times, times[0] + float(self._slider.value)))
        return min(index, len(self.rows) - 1)

    def leave_arm(self) -> None:
        """Another arm takes the stage: what there is can be downloaded, but not be shown with it."""
        self.show_live()
        self._of_this_arm = not self.rows

    def show_live(self) -> None:
        """Ends a replay."""
        self._replaying, self._slider.disabled = False, True

    def _begin(self) -> None:
        self.rows, self.plotted, self._of_this_arm = [], [], True
        self.show_live()

    def _set_running(self, running: bool) -> None:
        """Of a simulation; an arm that another program moves goes on as it does, and nobody takes the command."""
        if self._loop.last is not None and not self._loop.last.attached:
            self._loop.send(m.SetRunning(running))

    def _on_record(self, event: Any) -> None:
        recording = event.target.value == "Record"
        if recording:
            self._begin()
            self._set_running(True)
        self._loop.send(m.SetRecording(recording))

    def _on_replay(self, event: Any) -> None:
        if event.target.value == "Live":
            if self._replaying and self._ran:
                self._set_running(True)
            self.show_live()
            return
        with self._loop.telling(event.client):
            if not self._of_this_arm:
                raise ValueError("the recording is of another robot model; it can be downloaded")
            if len(self.rows) < 2:
                raise ValueError("nothing is recorded: press Record, then Stop")
            if not self._replaying:
                self._ran = self._loop.last is not None and self._loop.last.running
            self._loop.send(m.SetRecording(False))
            self._set_running(False)
            self._slider.max = max(round(self.length, 2), 0.01)
            self._slider.disabled = False
            self._replaying, self._since = True, clock.monotonic()

    def _on_moment(self, event: Any) -> None:
        if event.client is not None:
            self._since = 0.0

    def _on_save(self, event: Any) -> None:
        if self.rows and event.client is not None:
            event.client.send_file_download("recording.npz", as_npz(self.rows), save_immediately=True)


def as_npz(rows: list[m.Row]) -> bytes:
    """A recording as NumPy's .npz: time (T,), q (T, nv), poses (T, N, 4, 4) and names (N,) of the obstacles.

    Obstacles that came or went on the way have NaN where they were not there.
    """
    names = list(dict.fromkeys(thing.name for row in rows for thing in row.things))
    poses = np.full((len(rows), len(names), 4, 4), np.nan)
    for k, row in enumerate(rows):
        for thing, pose in zip(row.things, row.poses, strict=True):
            poses[k, names.index(thing.name)] = pose
    buffer = io.BytesIO()
    np.savez_compressed(
        buffer,
        time=np.array([row.time for row in rows]),
        q=np.array([row.q for row in rows]),
        poses=poses,
        names=np.array(names, dtype=str),
    )
    return buffer.getvalue()
