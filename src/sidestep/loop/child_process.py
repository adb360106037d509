"""Processes that this one has started."""

from __future__ import annotations

import subprocess
from typing import Any


def end_process(process: subprocess.Popen[Any], patience: float) -> None:
    """Asks a process to end, waits so long at most [s], then kills it; one that has ended is left as it is."""
    if process.poll() is not None:
        return
    process.terminate()
    try:
        process.wait(patience)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
