"""Who may talk to the studio: those who know the token of this start, from pages of this server alone."""

from __future__ import annotations

import dataclasses
import http
import ipaddress
import secrets
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

    Answer = Callable[[ServerConnection, Request], Response | None]

LOCAL = frozenset({"localhost", "127.0.0.1", "::1"})  # names of this machine that no other machine can have
HTTP_PORT = 80  # which addresses leave out
_placing = threading.Lock()


class Guard:
    """Refuses, with 403, each request to a studio's server that is not meant for it: pages and websockets alike.

    The token is the first part of the path, `/TOKEN/`. The page opens its websocket at its own address less the query,
    so the token comes along; a cookie would go to every port of this machine, and not at all to a page inside
    a notebook of another site.

    Args:
        host: where the server listens.
    """

    def __init__(self, host: str) -> None:
        self.token = secrets.token_urlsafe()
        self.placed = False
        number = _number(host)
        self._any_address = number is not None and number.is_unspecified
        self._names = {_plain(host)}
        if self._any_address:
            name = socket.gethostname().lower()
            self._names |= {*LOCAL, name, f"{name}.local"}
        elif _plain(host) == "localhost" or (number is not None and number.is_loopback):
            self._names |= LOCAL

    def before(self, answer: Answer) -> Answer:
        """What answers requests as `answer` does, and is asked first; `answer` sees the path after the token."""

        def guarded(connection: ServerConnection, request: Request) -> Response | None:
            path = self._path_after_token(request.path)
            if path is None or not self._is_from_here(request, connection.local_address[1]):
                return connection.respond(
                    http.HTTPStatus.FORBIDDEN, "Open the address that the studio has printed.\n"
                )
            return answer(connection, dataclasses.replace(request, path=path))

        return guarded

    def _path_after_token(self, path: str) -> str | None:
        first, _, rest = path.partition("?")[0].removeprefix("/").partition("/")
        told, known = first.encode("utf-8", "replace"), self.token.encode()
        return f"/{rest}" if secrets.compare_digest(told, known) else None

    def _is_from_here(self, request: Request, port: int) -> bool:
        """Whether Host is this server (a foreign name may lead here, too), and Origin, if there is one, the same."""
        hosts, origins = (request.headers.get_all(name) for name in ("Host", "Origin"))
        if len(hosts) != 1 or not self.is_own(hosts[0], port):
            return False
        return origins in ([], [f"http://{hosts[0]}"])

    def is_own(self, place: str, port: int) -> bool:
        """Whether NAME:PORT is this server, which listens at `port`."""
        try:
            parts = urlsplit(f"//{place}")
            name, told = parts.hostname, parts.port or HTTP_PORT
        except ValueError:
            return False
        if name is None or parts.netloc != place or "@" in place or told != port:
            return False
        if self._any_address and _number(name) is not None:
            return True  # no server of names has a say in a number
        return _plain(name) in self._names


@contextmanager
def placed(guard: Guard) -> Iterator[None]:
    """Has the server that viser starts meanwhile ask a guard first; other servers are left alone.

    viser hands websockets a function of its own that answers requests, and has no place for another one. Where
    `guard.placed` is False afterwards, viser started no server, or not in this way.
    """
    import websockets.asyncio.server as module

    serve: Any = module.serve

    def start(*args: Any, **options: Any) -> Any:
        answer = options.get("process_request")
        if getattr(answer, "__module__", "").startswith("viser."):
            options["process_request"] = guard.before(answer)  # type: ignore[arg-type]
            guard.placed = True
        return serve(*args, **options)

    with _placing:
        module.serve = start  # type: ignore[assignment, misc]
        try:
            yield
        finally:
            module.serve = serve  # type: ignore[misc]


def _number(host: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(host)
    except ValueError:
        return None


def _plain(host: str) -> str:
    """The one way to write a name or number."""
    number = _number(host)
    return host.lower() if number is None else str(number)
