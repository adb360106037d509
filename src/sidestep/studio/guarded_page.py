"""A page of this machine behind a guard: what the pages that look share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Self

from sidestep.studio.guard import Guard
from sidestep.studio.server import HOST, address_of, check_port, guarded_server

if TYPE_CHECKING:
    import viser


class GuardedPage(ABC):
    """A page that is refused without the token in its address; stop it with `stop`, or use it as a context.

    Args:
        port: where to listen on this machine; 0: any that is free.

    Raises:
        OSError: the port is taken. ModuleNotFoundError: viser is not installed.
    """

    def __init__(self, port: int) -> None:
        check_port(HOST, port)
        guard = Guard(HOST)
        self.server: viser.ViserServer = guarded_server(HOST, port, guard)
        self.port, self._token = self.server.get_port(), guard.token

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    @property
    def address(self) -> str:
        """What to open in a browser."""
        return f"{address_of(HOST, self.port)}/{self._token}/"

    @abstractmethod
    def stop(self) -> None:
        """Ends the server, and what runs beside it."""
