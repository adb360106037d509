"""The page of `sidestep show`: a server that is there at once, and a thread that brings the meshes."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING

from sidestep.studio.guarded_page import GuardedPage
from sidestep.studio.show.facts_panel import FactsPanel
from sidestep.studio.show.reading import Reading
from sidestep.studio.show.touching import TouchMonitor

if TYPE_CHECKING:
    from sidestep.studio.show.view import ShowView

PORT = 8891  # beside the studio's
ENDING = 10.0  # [s] at most until the loading of meshes ends
LOADED = 120.0  # [s] at most until the arm is on the page, for `wait_ready`


class Show(GuardedPage):
    """A robot on a page of this machine; stop it with `stop`, or use it as a context.

    The page and its websocket are refused without the token in `address`, as the studio's are.

    Args:
        reading: what is shown. port: where to listen; 0: any that is free.

    Raises:
        OSError: the port is taken.
        ModuleNotFoundError: viser is not installed; says what to install.
    """

    def __init__(self, reading: Reading, *, port: int = PORT) -> None:
        super().__init__(port)
        self.panel = FactsPanel(self.server, reading)
        self.view: ShowView | None = None
        self.error = ""
        self._reading = reading
        self._ready, self._stopping = threading.Event(), threading.Event()
        self._touch = TouchMonitor(reading.robot, lambda found, _: self.panel.show_touching(found))
        self._thread = threading.Thread(target=self._load, daemon=True)
        self._thread.start()

    def wait_ready(self, timeout: float = LOADED) -> ShowView:
        """The arm on the page.

        Raises:
            RuntimeError: it could not be drawn. TimeoutError: it takes longer than `timeout` [s].
        """
        if not self._ready.wait(timeout):
            raise TimeoutError(f"the arm is not on the page after {timeout:.0f} s")
        if self.view is None:
            raise RuntimeError(self.error)
        return self.view

    def wait(self) -> None:
        """Returns when the page is stopped."""
        while not self._stopping.wait(0.2):
            pass

    def stop(self) -> None:
        """Ends threads and server."""
        self._stopping.set()
        self._touch.stop()
        self._thread.join(timeout=ENDING)
        self.server.stop()

    def _load(self) -> None:
        try:
            from sidestep.studio.show.shapes import (
                drawable_shapes,  # loads meshes: seconds, and so does what it imports
            )
            from sidestep.studio.show.view import ShowView

            shapes = drawable_shapes(self._reading.robot, self._stopping.is_set)
            if self._stopping.is_set():
                return
            self.panel.add_warnings(shapes.warnings)
            self.view = ShowView(self.server, self._reading, shapes, self.panel, self._touch.look)
            self.panel.tell("")
        except Exception as error:  # the panel stays, and says it
            self.error = f"the arm cannot be drawn: {type(error).__name__}: {error}"
            logging.getLogger(__name__).error(self.error, exc_info=error)
            self.panel.tell(self.error)
        finally:
            self._ready.set()
