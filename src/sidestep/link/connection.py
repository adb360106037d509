"""`sidestep.connect`: a client of an arm that another program serves."""

from __future__ import annotations

import os

from .core import Client, link_address, link_token

ADDRESS_VARIABLE = "SIDESTEP_ADDRESS"
DEFAULT_ADDRESS = "arm"
ZENOH = "zenoh/"


def connect(
    address: str | None = None,
    token: str | None = None,
    *,
    name: str | None = None,
    rate: float = 100.0,
    timeout: float = 2.0,
    endpoint: str | None = None,
) -> Client:
    """Connects to an arm that `sidestep serve`, or a `sidestep.link.Server`, serves.

    Args:
        address: a name ("arm"), "unix:/PATH", "tcp:PORT" of this machine, or "zenoh/NAME" of another one; None: what
            the environment variable SIDESTEP_ADDRESS says, else "arm".
        token: of the server, without which the client only looks; None: the one that the server has left for this
            user, where there is one.
        name: of this client, for messages to others; None: that of the process.
        rate: how often state and command come [Hz]; inf: every cycle; 0: never.
        timeout: for an answer [s].
        endpoint: of Zenoh, with "zenoh/NAME"; None: "tcp/127.0.0.1:7447".

    Returns:
        a client with the methods of a Controller; a context manager.

    Raises:
        ValueError: the address is none, or the token is wrong.
        ConnectionError: nobody serves there.
    """
    address = address or os.environ.get(ADDRESS_VARIABLE) or DEFAULT_ADDRESS
    name = name if name is not None else f"process {os.getpid()}"
    if address.startswith(ZENOH):
        from .zenoh_bridge import connect_over_zenoh

        return connect_over_zenoh(
            address.removeprefix(ZENOH), token or "", name=name, rate=rate, timeout=timeout, endpoint=endpoint
        )
    if endpoint is not None:
        raise ValueError(
            f"endpoint is {endpoint!r}: it goes with an address zenoh/NAME, not with {address!r}"
        )
    full = link_address(address)
    try:
        return Client(full, _token(full) if token is None else token, name=name, rate=rate, timeout=timeout)
    except (FileNotFoundError, ConnectionRefusedError) as error:
        raise ConnectionError(f"nobody serves an arm at {full}: start `sidestep serve`") from error


def _token(address: str) -> str:
    """What the server has left for this user; empty where it has not."""
    try:
        return link_token(address)
    except OSError:
        return ""
