"""The panel of what was read, which is there before the meshes are."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

from sidestep.studio.page.words import stamped
from sidestep.studio.show.document import document
from sidestep.studio.show.facts import joints_html, links_html, robot_html
from sidestep.studio.show.reading import Reading
from sidestep.studio.show.touching import Touching

if TYPE_CHECKING:
    import viser

WIDTH = 350  # [px]


class FactsPanel:
    """Three tabs at the left: the robot with warnings and what touches, its joints, its links."""

    def __init__(self, server: viser.ViserServer, reading: Reading) -> None:
        self.document = document(reading)
        self._lock = threading.Lock()
        self._warnings = reading.warnings
        self._touching: Touching | None = None
        self._state, self._stamp = "", 0
        gui = server.gui
        panel = gui.add_panel()
        with panel.add_tab("Robot"):
            self._robot: Any = gui.add_html("")
        with panel.add_tab("Joints"):
            gui.add_html(joints_html(self.document))
        with panel.add_tab("Links"):
            gui.add_html(links_html(self.document))
        panel.dock_left()
        panel.set_width(WIDTH)
        self.tell("loading meshes …")

    @property
    def text(self) -> str:
        """The HTML of the first tab."""
        return str(self._robot.content)

    def tell(self, state: str) -> None:
        """What the page does now; empty when it is done."""
        with self._lock:
            self._state = state
            self._draw()

    def add_warnings(self, warnings: tuple[str, ...]) -> None:
        """More of them."""
        with self._lock:
            self._warnings = tuple(dict.fromkeys((*self._warnings, *warnings)))
            self._draw()

    def show_touching(self, touching: Touching | None) -> None:
        """What touches; None while it is measured."""
        with self._lock:
            if touching != self._touching:
                self._touching = touching
                self._draw()

    def stamp(self) -> int:
        """A number: a browser that has it has all that was sent before."""
        with self._lock:
            self._stamp += 1
            self._draw()
            return self._stamp

    def _draw(self) -> None:
        text = robot_html(self.document, self._warnings, self._touching, self._state)
        self._robot.content = stamped(text, self._stamp)
