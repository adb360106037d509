"""A Python module in a process of its own, and the connection to it."""

from __future__ import annotations

import contextlib
import os
import secrets
import subprocess
import sys
import threading
from collections.abc import Mapping
from multiprocessing.connection import Client, Connection, Listener
from typing import Any


def start_process(
    module: str, environment: Mapping[str, str] | None = None
) -> tuple[subprocess.Popen[bytes], Connection[Any, Any]]:
    """Starts `python -m module ADDRESS`, which connects by `connect_to_parent`; environment: variables beside our own.

    Raises:
        RuntimeError: the process did not start.
    """
    key = secrets.token_bytes(32)
    listener = Listener(authkey=key)
    address = listener.address
    assert isinstance(address, str)
    process = subprocess.Popen(
        [sys.executable, "-m", module, address],
        stdin=subprocess.PIPE,
        env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", **(environment or {})},
    )
    assert process.stdin is not None
    process.stdin.write(key.hex().encode() + b"\n")
    process.stdin.flush()
    connection = _accept(listener, process)
    listener.close()
    return process, connection


def connect_to_parent() -> Connection[Any, Any]:
    """The other end: the address is the first argument, the key the first line of stdin."""
    return Client(sys.argv[1], authkey=bytes.fromhex(sys.stdin.readline().strip()))


def _accept(listener: Listener, process: subprocess.Popen[bytes]) -> Connection[Any, Any]:
    """The connection of the process; it is asked for in a thread, so that a process that dies is noticed."""
    accepted: list[Connection[Any, Any]] = []

    def accept() -> None:
        with contextlib.suppress(OSError, EOFError):
            accepted.append(listener.accept())

    thread = threading.Thread(target=accept, daemon=True)
    thread.start()
    while thread.is_alive():
        thread.join(0.1)
        if process.poll() is not None and not accepted:
            raise RuntimeError(f"the process ended with exit code {process.returncode}")
    if not accepted:
        raise RuntimeError("the process did not connect")
    return accepted[0]
