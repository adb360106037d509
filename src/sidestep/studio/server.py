"""The server of a page: viser, which answers on this machine alone unless told otherwise, behind a guard."""

from __future__ import annotations

import contextlib
import errno
import socket
from typing import TYPE_CHECKING

from sidestep.studio import guard as g

if TYPE_CHECKING:
    import viser

HOST = "127.0.0.1"


def address_of(host: str, port: int) -> str:
    """The address of a page that is served at a host, a name or number of this machine.

    A number stays one: the name localhost may lead to a number at which another user listens, who would get the token.
    """
    name = {"0.0.0.0": "127.0.0.1", "::": "[::1]"}.get(host)
    if name is None:
        name = f"[{host}]" if ":" in host else host
    return f"http://{name}:{port}"


def check_port(host: str, port: int) -> None:
    """Raises OSError with what to do when nothing can listen at this address."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except socket.gaierror as error:
        raise OSError(f"--host {host}: {error.strerror or error}") from error
    with contextlib.closing(socket.socket(family, kind, protocol)) as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            trial.bind(address)
        except OSError as error:
            if error.errno == errno.EADDRINUSE:
                raise OSError(
                    f"port {port} is taken, perhaps by another studio; choose another with --port"
                ) from error
            raise OSError(f"cannot listen at {host}:{port}: {error.strerror}") from error


def guarded_server(host: str, port: int, guard: g.Guard) -> viser.ViserServer:
    """A viser server that asks `guard` first.

    Raises:
        ModuleNotFoundError: viser is not installed; says what to install.
        RuntimeError: a viser whose server cannot be guarded.
    """
    import rich
    import viser

    quiet = rich.get_console().quiet
    rich.get_console().quiet = True  # viser prints a banner of its own
    try:
        with g.placed(guard):
            server = viser.ViserServer(host=host, port=port, label="Sidestep", verbose=False)
        if not guard.placed:
            server.stop()
            raise RuntimeError(
                f"viser {viser.__version__} starts its server in a way that the studio cannot guard; "
                "pip install 'viser==1.1.*'"
            )
        return server
    finally:
        rich.get_console().quiet = quiet
