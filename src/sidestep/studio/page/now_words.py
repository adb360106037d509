"""What the page says about the moment that it shows."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Any

from sidestep.studio import messages as m
from sidestep.studio.page.clearances import Clearances
from sidestep.studio.page.words import begun, in_box, stamped

if TYPE_CHECKING:
    import viser

WORDS_EVERY = 0.15  # [s] nobody reads faster


class NowWords:
    """A box with a sentence, facts and events."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._stamp, self._told = 0, 0.0
        self.text = in_box("preparing …")
        self._box: Any = server.gui.add_html(stamped(self.text, 0))

    def stamp(self) -> int:
        """Sends the text with a new number: a browser that has the number has all that was sent before it."""
        self._told = 0.0
        self._stamp += 1
        self._write(self.text)
        return self._stamp

    def say(self, words: str) -> None:
        """Shows these words, as HTML, at once."""
        self._write(in_box(words))

    def show(self, now: float, snapshot: m.Snapshot, clearances: Clearances) -> None:
        """Says what the loop does. now: of the machine's clock [s]."""
        touch = (
            f"touches: {html.escape(', '.join(snapshot.contacts))}"
            if snapshot.contacts
            else "touches nothing"
        )
        status = [f"status: {snapshot.status}"] if snapshot.status else []
        speed = f"{snapshot.timing.real_time:.2f} × real time" if snapshot.running else "paused"
        if snapshot.attached:
            speed = "another program moves it" if snapshot.running else "not followed until Run or Restart"
        state = f"{touch} · {snapshot.time:.1f} s · {speed}"
        coarse = (
            [f"coarse body; the fine one is made: {html.escape(snapshot.refining)}"] if snapshot.draft else []
        )
        least = f" (least so far {1e3 * clearances.least:.0f} mm)"
        facts = [*clearances.facts(snapshot.things, least), state, *status, *coarse]
        self._tell(now, begun(snapshot.words), facts, snapshot.events)

    def show_replay(self, now: float, row: m.Row, clearances: Clearances, *, attached: bool) -> None:
        """Says which moment of the recording is shown."""
        meanwhile = "the arm itself goes on" if attached else "the loop is paused"
        facts = [*clearances.facts(row.things), meanwhile]
        self._tell(now, f"Replay of {row.time:.2f} s", facts)

    def _tell(
        self, now: float, words: str, facts: list[str], events: tuple[tuple[float, str], ...] = ()
    ) -> None:
        if now - self._told >= WORDS_EVERY:
            self._told = now
            self._write(in_box(f"{html.escape(words)}.", "<br>".join(facts), events))

    def _write(self, text: str) -> None:
        self.text, content = text, stamped(text, self._stamp)
        if content != self._box.content:
            self._box.content = content
