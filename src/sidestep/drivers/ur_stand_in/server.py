"""The sockets of the stand-in, and its clock: one thread that serves them and steps the box in time."""

from __future__ import annotations

import ipaddress
import select
import socket
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from types import TracebackType
from typing import Protocol

from sidestep.drivers.ur_stand_in.box import Box
from sidestep.drivers.ur_stand_in.dashboard import GREETING, Dashboard
from sidestep.drivers.ur_stand_in.rtde import RtdeClient

RTDE, DASHBOARD, SCRIPT = 30004, 29999, 30003  # ports, as every UR has them
CHUNK = 65536  # [bytes] read at once
MOST_TEXT = 1 << 20  # [bytes] of a script or a line


class _Client(Protocol):
    def receive(self, data: bytes) -> bytes: ...


class _Lines:
    """A dashboard's client."""

    def __init__(self, dashboard: Dashboard) -> None:
        self._dashboard, self._text = dashboard, b""

    def receive(self, data: bytes) -> bytes:
        *lines, self._text = (self._text + data).split(b"\n")
        if len(self._text) > MOST_TEXT:
            raise ValueError("a line without an end")
        return b"".join(self._dashboard.answer(line.decode("ascii")).encode() + b"\n" for line in lines)


class _Scripts:
    """A client of the script port: what it sends runs when its last line has come."""

    def __init__(self, box: Box) -> None:
        self._box, self._text = box, b""

    def receive(self, data: bytes) -> bytes:
        self._text += data
        if len(self._text) > MOST_TEXT:
            raise ValueError("a script without an end")
        if self._text.endswith(b"\nend\n"):
            self._box.run_script(self._text.decode("utf-8"))
            self._text = b""
        return b""


class Server:
    """Serves the three ports at an address of this machine; a context manager.

    Attributes:
        box: the robot. deaf: nothing is received or sent while it is true, as with a cable that is out.
    """

    def __init__(
        self,
        box: Box,
        *,
        address: str = "127.0.0.1",
        model: str,
        version: tuple[int, int, int, int],
        on_tick: Callable[[], None] = lambda: None,
    ) -> None:
        """Listens.

        Args:
            box: the robot. model: its name for the dashboard. version: of its software.
            address: of the loopback interface.
            on_tick: called after each step of the box.

        Raises:
            ValueError: the address is not of the loopback interface.
            OSError: a port is in use.
        """
        if not ipaddress.ip_address(address).is_loopback:
            raise ValueError(
                f"the stand-in listens at addresses of this machine only (127.x.x.x), not at {address}"
            )
        self.box, self.deaf, self._on_tick = box, False, on_tick
        dashboard = Dashboard(box, model=model, version=".".join(map(str, version)))
        self._makers: dict[int, Callable[[], _Client]] = {
            RTDE: lambda: RtdeClient(box, version),
            DASHBOARD: lambda: _Lines(dashboard),
            SCRIPT: lambda: _Scripts(box),
        }
        self._clients: dict[socket.socket, _Client] = {}
        with ExitStack() as stack:
            self._listeners = {
                stack.enter_context(socket.create_server((address, port))): port for port in self._makers
            }
            self._open = stack.pop_all()
        self.watched: dict[int, Callable[[], bool]] = {}
        self._next = time.monotonic()

    def __enter__(self) -> Server:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.disconnect()
        self._open.close()

    def disconnect(self) -> None:
        """Ends all connections; clients may come again."""
        for client in list(self._clients):
            self._drop(client)

    def serve(self) -> None:
        """Serves and steps until one of `watched` returns false.

        A box that is behind its time takes one step after another, and serves between two: it hears all the same.

        `watched`: file descriptors, and what is called where one can be read.
        """
        self._next = time.monotonic() + self.box.period
        while True:
            wait = max(0.0, self._next - time.monotonic())
            sources: list[socket.socket | int] = list(self.watched)
            if not self.deaf:
                sources += [*self._listeners, *self._clients]
            ready, _, _ = select.select(sources, [], [], wait)
            for source in ready:
                if isinstance(source, int):
                    if not self.watched[source]():
                        return
                elif source in self._listeners:
                    self._accept(source)
                else:
                    self._receive(source)
            if time.monotonic() >= self._next:
                self._next += self.box.period
                self._tick()

    def _tick(self) -> None:
        self.box.step()
        self._on_tick()
        if not self.deaf:
            for connection, client in list(self._clients.items()):
                if isinstance(client, RtdeClient):
                    self._send(connection, client.package())

    def _accept(self, listener: socket.socket) -> None:
        connection, _ = listener.accept()
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._clients[connection] = self._makers[self._listeners[listener]]()
        if self._listeners[listener] == DASHBOARD:
            self._send(connection, GREETING.encode() + b"\n")

    def _receive(self, connection: socket.socket) -> None:
        if connection not in self._clients:
            return
        try:
            data = connection.recv(CHUNK)
            if not data:
                self._drop(connection)
                return
            self._send(connection, self._clients[connection].receive(data))
        except (BlockingIOError, InterruptedError):
            return
        except (OSError, ValueError, UnicodeDecodeError) as error:  # a client that does not know the protocol
            self.box.log(f"a client is refused: {error}")
            self._drop(connection)

    def _send(self, connection: socket.socket, data: bytes) -> None:
        if data:
            try:
                connection.sendall(data)
            except OSError:  # gone, or does not read what it is sent
                self._drop(connection)

    def _drop(self, connection: socket.socket) -> None:
        self._clients.pop(connection, None)
        with suppress(OSError):
            connection.close()
