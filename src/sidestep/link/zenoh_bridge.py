"""Served arms on other machines: the messages of the local protocol, carried by Zenoh.

Keys, below `sidestep/NAME/`:
    request/ID   messages of client ID, in its order
    reply/ID     messages to it
    cycle        CycleMessage for everybody, at the bridge's rate
    client/ID    liveliness of client ID: where it ends, so does its connection
    alive        liveliness of the bridge
    served       answers a query while the arm is served
"""

from __future__ import annotations

import contextlib
import secrets
import socket
import struct
import threading
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import Any

import zenoh

from .core import Client, link_address, link_magic, link_messages, link_version

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
LEASE_MS = 1000  # a peer that is silent for so long is gone
FIND_TIMEOUT = 5.0  # [s]
HEADER = struct.Struct("<IHHIQ")  # magic, version, type, payload [B], sequence; as in link/message.hpp
CHUNK = 1 << 16  # [B] read at once
LARGEST_PAYLOAD = max(message["largest"] for message in link_messages())  # [B]
TYPES = {message["name"]: message["type"] for message in link_messages()}
HELLO, SUBSCRIBE, CYCLE = TYPES["Hello"], TYPES["Subscribe"], TYPES["CycleMessage"]


class ZenohBridge:
    """Makes an arm that is served on this machine reachable over Zenoh, until it is closed.

    Each client gets a connection of its own to the server, so the same rules hold: who may command, who is in command,
    what is refused. A client that is lost loses its connection within about a second.

    Args:
        address: of the server on this machine.
        name: under which it is found, sidestep/NAME.
        endpoint: where Zenoh listens; by default on the loopback alone. Zenoh has no secrecy here: the token and all
            messages go over the network as they are.
        rate: of cycles for those who only listen to sidestep/NAME/cycle [Hz]; 0: none.

    Raises:
        ValueError: the address or the name is none.
        ConnectionError: nobody serves there, or Zenoh cannot listen at the endpoint.
    """

    def __init__(
        self, address: str, name: str, *, endpoint: str = DEFAULT_ENDPOINT, rate: float = 50.0
    ) -> None:
        _check_name(name)
        self.prefix = f"sidestep/{name}"
        self._address = link_address(address)
        self._connections: dict[str, socket.socket] = {}
        self._lock = threading.Lock()
        self._is_closed = False
        self._watching = _watch(self._address, rate) if rate > 0.0 else None  # whose cycles are for everybody
        try:
            self._session = _open_session("peer", listen=endpoint)
        except zenoh.ZError as error:
            _end(self._watching)
            raise ConnectionError(f"Zenoh cannot listen at {endpoint}: {error}") from error
        self._declared = [
            self._session.liveliness().declare_subscriber(f"{self.prefix}/client/*", self._on_life),
            self._session.declare_subscriber(f"{self.prefix}/request/*", self._on_request),
            self._session.liveliness().declare_token(f"{self.prefix}/alive"),
            self._session.declare_queryable(f"{self.prefix}/served", self._on_query),
        ]
        if self._watching is not None:
            _in_background(self._publish, self._watching, f"{self.prefix}/cycle", CYCLE)

    def _on_query(self, query: Any) -> None:
        query.reply(f"{self.prefix}/served", str(link_version))

    def _on_life(self, sample: Any) -> None:
        if sample.kind == zenoh.SampleKind.DELETE:
            self._drop(str(sample.key_expr).rpartition("/")[2])

    def _on_request(self, sample: Any) -> None:
        client = str(sample.key_expr).rpartition("/")[2]
        try:
            self._connection(client).sendall(bytes(sample.payload))
        except OSError:
            self._drop(client)

    def _connection(self, client: str) -> socket.socket:
        with self._lock:
            if self._is_closed:
                raise ConnectionError("the bridge is closed")
            found = self._connections.get(client)
            if found is None:
                found = self._connections[client] = _open_socket(self._address)
                _in_background(self._relay, found, client)
            return found

    def _relay(self, connection: socket.socket, client: str) -> None:
        """Carries what the server says to a client, until either is gone."""
        self._publish(connection, f"{self.prefix}/reply/{client}")
        self._drop(client)

    def _publish(self, connection: socket.socket, key: str, wanted: int | None = None) -> None:
        """Puts the messages of a connection, or those of one type, at a key until the connection ends."""
        with contextlib.suppress(OSError, ValueError, zenoh.ZError):
            for kind, message in _messages(connection):
                if wanted in (None, kind):
                    drops = zenoh.CongestionControl.DROP if kind == CYCLE else zenoh.CongestionControl.BLOCK
                    self._session.put(key, message, congestion_control=drops, express=True)

    def _drop(self, client: str) -> None:
        with self._lock:
            connection = self._connections.pop(client, None)
        _end(connection)

    def close(self) -> None:
        """Takes no more requests, and ends all connections."""
        for declared in self._declared:
            declared.undeclare()
        self._declared = []
        with self._lock:
            self._is_closed = True
        for client in list(self._connections):
            self._drop(client)
        _end(self._watching)
        self._session.close()

    def __enter__(self) -> ZenohBridge:
        return self

    def __exit__(
        self, type: type[BaseException] | None, value: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()


def connect_over_zenoh(
    served: str, token: str, *, name: str, rate: float, timeout: float, endpoint: str | None
) -> Client:
    """A client, called `name`, of an arm that a ZenohBridge serves as `served`; see `sidestep.connect`."""
    _check_name(served)
    endpoint = endpoint or DEFAULT_ENDPOINT
    try:
        session = _open_session("client", connect=endpoint)
    except zenoh.ZError as error:
        raise ConnectionError(f"no Zenoh can be reached at {endpoint}: {error}") from error
    prefix, number = f"sidestep/{served}", secrets.token_hex(8)
    if not any(reply.ok is not None for reply in session.get(f"{prefix}/served", timeout=FIND_TIMEOUT)):
        session.close()
        raise ConnectionError(
            f"no arm is served as {served!r} at {endpoint}: start `sidestep serve --zenoh {served}`"
        )
    inside, outside = socket.socketpair()
    _in_background(_carry, session, outside, prefix, number)
    return Client.over(inside.detach(), token, name=name, rate=rate, timeout=timeout)


def _carry(session: Any, outside: socket.socket, prefix: str, number: str) -> None:
    """Carries messages between a client of this process and Zenoh, until the client is closed."""

    def on_reply(sample: Any) -> None:
        with contextlib.suppress(OSError):
            outside.sendall(bytes(sample.payload))

    def on_life(sample: Any) -> None:
        if sample.kind == zenoh.SampleKind.DELETE:
            with contextlib.suppress(OSError):
                outside.shutdown(socket.SHUT_RDWR)

    with contextlib.suppress(OSError, ValueError, zenoh.ZError):
        replies = session.declare_subscriber(f"{prefix}/reply/{number}", on_reply)
        life = session.liveliness().declare_token(f"{prefix}/client/{number}")
        server_life = session.liveliness().declare_subscriber(f"{prefix}/alive", on_life)
        for _, message in _messages(outside):
            session.put(
                f"{prefix}/request/{number}",
                message,
                congestion_control=zenoh.CongestionControl.BLOCK,
                express=True,
            )
        server_life.undeclare()
        life.undeclare()
        replies.undeclare()
    outside.close()
    session.close()


def _messages(connection: socket.socket) -> Iterator[tuple[int, bytes]]:
    """The messages that a connection carries, whole, with their types, until it ends.

    Raises:
        ValueError: what comes is no message.
    """
    held = bytearray()
    while chunk := connection.recv(CHUNK):
        held += chunk
        while len(held) >= HEADER.size:
            magic, version, kind, payload, _ = HEADER.unpack_from(held)
            if magic != link_magic or version != link_version or payload > LARGEST_PAYLOAD:
                raise ValueError("this is no message of Sidestep")
            size = HEADER.size + payload
            if len(held) < size:
                break
            yield kind, bytes(held[:size])
            del held[:size]


def _message(kind: int, payload: bytes) -> bytes:
    return HEADER.pack(link_magic, link_version, kind, len(payload), kind) + payload


def _text(text: str) -> bytes:
    content = text.encode()
    return struct.pack("<I", len(content)) + content


def _check_name(name: str) -> None:
    if not name or not all(letter.isalnum() or letter in "-_." for letter in name):
        raise ValueError(f"name is {name!r}; allowed: letters, digits, '-', '_' and '.'")


def _open_socket(address: str) -> socket.socket:
    kind, _, place = address.partition(":")
    try:
        if kind == "unix":
            opened = socket.socket(socket.AF_UNIX)
            opened.connect(place)
        else:
            host, _, port = place.rpartition(":")
            opened = socket.create_connection((host, int(port)))
            opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    except (FileNotFoundError, ConnectionRefusedError) as error:
        raise ConnectionError(f"nobody serves an arm at {address}") from error
    return opened


def _watch(address: str, rate: float) -> socket.socket:
    """A connection to a server that sends cycles at a rate [Hz]."""
    opened = _open_socket(address)
    opened.sendall(_message(HELLO, _text("zenoh") + _text("")))
    opened.sendall(_message(SUBSCRIBE, struct.pack("<d", rate)))
    return opened


def _end(connection: socket.socket | None) -> None:
    """Closes a connection; whoever reads it in another thread wakes."""
    if connection is not None:
        with contextlib.suppress(OSError):
            connection.shutdown(socket.SHUT_RDWR)
        connection.close()


def _in_background(work: Callable[..., None], *arguments: Any) -> None:
    threading.Thread(target=work, args=arguments, daemon=True).start()


def _open_session(mode: str, *, listen: str | None = None, connect: str | None = None) -> Any:
    """A session that neither looks for others nor answers those who look."""
    config = zenoh.Config()
    settings = {
        "mode": f'"{mode}"',
        "scouting/multicast/enabled": "false",
        "scouting/gossip/enabled": "false",
        "listen/endpoints": f'["{listen}"]' if listen else "[]",
        "connect/endpoints": f'["{connect}"]' if connect else "[]",
        "transport/link/tx/lease": str(LEASE_MS),
    }
    for key, value in settings.items():
        config.insert_json5(key, value)
    return zenoh.open(config)
