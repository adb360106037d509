"""The page's side of the loop: what all panels share."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from sidestep.extras import MissingExtraError
from sidestep.robot import Robot, tip_of
from sidestep.scenario import Scenario
from sidestep.scenario.assembly import load_robot
from sidestep.studio import messages as m
from sidestep.studio.gallery import ends_of
from sidestep.studio.systems import numbers_of

if TYPE_CHECKING:
    import viser


class LoopLink:
    """Sends commands to the loop, and has its last state and the robot that is shown.

    Args:
        send: hands a command to the loop. robot: shown at first.
    """

    def __init__(self, server: viser.ViserServer, send: Callable[[m.Command], None], robot: Robot) -> None:
        self._server = server
        self._receivers = [send]
        self._reported = ""
        self.last: m.Snapshot | None = None
        self.robot = robot

    @property
    def tip(self) -> str:
        """The frame that goals are about."""
        return tip_of(self.robot)

    def send(self, command: m.Command) -> None:
        """Hands a command to the loop, and to the other one of a comparison."""
        for receive in self._receivers:
            receive(command)

    def send_also_to(self, receive: Callable[[m.Command], None]) -> None:
        """Adds somebody who gets every command after the loop."""
        self._receivers.append(receive)

    def load(self, scenario: Scenario, *, to_and_fro: bool = False) -> None:
        """Another scenario for loop and page, with the method that it is written for; `to_and_fro` between its ends."""
        goals = ends_of(scenario, load_robot(scenario)) if to_and_fro else ()
        self.send(m.Load(scenario, numbers_of(scenario)[0], goals))

    @contextlib.contextmanager
    def telling(self, client: Any) -> Iterator[None]:
        """Shows what is refused inside to the person who asked for it."""
        try:
            yield
        except (ValueError, OSError, MissingExtraError) as error:
            refuse(client, str(error))

    def refused(self, message: str) -> None:
        """Shows everybody what is not possible."""
        for client in self._server.get_clients().values():
            refuse(client, message)

    def report(self, what: str, error: Exception) -> None:
        """Logs what went wrong, with where, and says it on the page; the same not twice in a row."""
        text = f"{what}: {type(error).__name__}: {error}"
        if text != self._reported:
            self._reported = text
            logging.getLogger(__name__).error(text, exc_info=error)
            self.refused(text)


def refuse(client: Any, message: str) -> None:
    """Shows one person what is not possible."""
    client.add_notification("Not possible", message, color="red", auto_close_seconds=8.0)
