"""The studio: a server with the page, the process of the loop, and the thread that draws."""

from __future__ import annotations

import threading
import time as clock
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from sidestep.scenario import Scenario
from sidestep.scenario.assembly import load_robot
from sidestep.studio import guard as g
from sidestep.studio import messages as m
from sidestep.studio.clearance_monitor import ExactClearanceMonitor
from sidestep.studio.gallery import ends_of
from sidestep.studio.server import HOST, address_of, check_port, guarded_server
from sidestep.studio.session_process import Beginning, Served, SessionProcess

if TYPE_CHECKING:
    from sidestep.studio.page.view import View

PORT = 8890
NOTEBOOK_HEIGHT = 640  # [px]
NOTEBOOK_SCALE = (
    0.7  # the output of a cell is narrow: at full size the panels would leave little of the scene
)
REPLAY_FRAME = 1.0 / 30.0  # [s] between two pictures of a replay; the paused loop sends few states
STEP_OF_TRUTH = 0.05  # [s] between two measurements on the exact meshes, at least


class Studio:
    """The page and the loop behind it; stop it with `stop`, or use it as a context.

    Who opens `address`, which has a random token of this start in it, can move the arm; without it, the page and its
    websocket are refused.

    Args:
        scenario: what is on the stage at first.
        to_and_fro: whether the arm goes to and fro between start and goal from the beginning.
        method: one of `sidestep.studio.methods.METHODS`. numbers: parameters of methods, by method and name.
        host, port: where to listen; by default this machine alone can connect.
        ellipsoids: per link of a covering body; None: as `Body.cover` finds best, which takes longer.
        served: an arm that another program serves, in place of a simulation; the scenario says what it looks like.

    Raises:
        OSError: the port is taken, or the address is not one of this machine.
        ValueError: that names what is wrong with the scenario or the method.
        ModuleNotFoundError: viser is not installed; says what to install.
        RuntimeError: a viser whose server cannot be guarded by the token.
    """

    def __init__(
        self,
        scenario: Scenario,
        *,
        to_and_fro: bool = False,
        method: str = "controller",
        numbers: Mapping[str, Mapping[str, Any]] | None = None,
        host: str = HOST,
        port: int = PORT,
        ellipsoids: int | None = None,
        served: Served | None = None,
    ) -> None:
        from sidestep.studio.methods import method_named

        method_named(method)
        check_port(host, port)
        robot = load_robot(scenario)
        guard = g.Guard(host)
        server = guarded_server(host, port, guard)
        from sidestep.studio.page.view import View

        self.server, self.host, self.port = server, host, server.get_port()
        self._token = guard.token
        self._stopping = threading.Event()
        self.snapshot: m.Snapshot | None = None
        self.error = ""
        goals = ends_of(scenario, robot) if to_and_fro else ()
        self._loop = SessionProcess(
            Beginning(scenario, method, dict(numbers or {}), ellipsoids, goals, served)
        )
        self.view: View = View(server, scenario, robot, self.send)
        self._truth = ExactClearanceMonitor(self.view.take_clearances, self.view.loop.report)
        self._last_truth = 0.0
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def __enter__(self) -> Studio:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    @property
    def address(self) -> str:
        """What to open in a browser; whoever knows it can move the arm."""
        return f"{address_of(self.host, self.port)}/{self._token}/"

    def _repr_html_(self) -> str:
        """The page inside a notebook whose browser runs on this machine."""
        share = 100.0 / NOTEBOOK_SCALE
        return (
            f'<div style="height:{NOTEBOOK_HEIGHT}px;overflow:hidden"><iframe src="{self.address}" style="border:0;'
            f"width:{share:.2f}%;height:{NOTEBOOK_HEIGHT / NOTEBOOK_SCALE:.0f}px;transform:scale({NOTEBOOK_SCALE});"
            'transform-origin:0 0"></iframe></div>'
        )

    def send(self, command: m.Command) -> None:
        """Hands a command to the loop."""
        self._loop.send(command)

    def wait_ready(self, timeout: float) -> m.Snapshot:
        """The first snapshot of the running loop.

        Raises:
            RuntimeError: the loop failed. TimeoutError: it takes longer than `timeout` [s].
        """
        end = clock.monotonic() + timeout
        while self.snapshot is None:
            if self._loop.ended:
                raise RuntimeError(self.error or "the process of the loop ended")
            if clock.monotonic() > end:
                raise TimeoutError(f"the loop is not ready after {timeout:.0f} s")
            clock.sleep(0.02)
        return self.snapshot

    def wait(self) -> None:
        """Returns when the loop ends or the studio is stopped."""
        while not self._stopping.wait(0.2) and not self._loop.ended:
            pass

    def stop(self) -> None:
        """Ends loop, threads and server."""
        self._stopping.set()
        self._loop.stop()
        self._truth.stop()
        self._thread.join(timeout=2.0)
        self.view.stop()
        self.server.stop()

    def _run(self) -> None:
        while not self._stopping.is_set():
            fresh = self._loop.wait(REPLAY_FRAME if self.view.recorder.replaying else 0.1)
            for note in self._loop.take_notes():
                if isinstance(note, m.Failed):
                    self.error = note.message
                self.view.tell(note)
            snapshot = fresh or (self.snapshot if self.view.recorder.replaying else None)
            if snapshot is not None:
                try:
                    self._draw(snapshot)
                except Exception as error:  # the page goes on with the next state
                    self.view.loop.report("drawing failed", error)
                if self.snapshot is None or snapshot.edition != self.snapshot.edition:
                    self.send(m.Drawn(snapshot.edition))
                self.snapshot = snapshot  # after it is on the page
            if self._loop.ended:
                self.view.tell(m.Failed(self.error or "the process of the loop ended", fatal=True))
                return

    def _draw(self, snapshot: m.Snapshot) -> None:
        self.view.take_rows(self._loop.take_rows())
        row, now = self.view.show(snapshot), clock.monotonic()
        if now - self._last_truth > STEP_OF_TRUTH and self.view.loop.robot.num_coordinates == len(row.q):
            self._last_truth = now
            self._truth.look(self.view.loop.robot, row, self.view.clearances.epoch)
