"""Server and client of the core."""

from sidestep._core import (
    Client,
    ClientInfo,
    ConnectionLost,
    Cycle,
    Server,
    link_address,
    link_magic,
    link_messages,
    link_token,
    link_version,
)

__all__ = [
    "Client",
    "ClientInfo",
    "ConnectionLost",
    "Cycle",
    "Server",
    "link_address",
    "link_magic",
    "link_messages",
    "link_token",
    "link_version",
]
