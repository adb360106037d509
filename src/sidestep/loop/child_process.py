"""Processes that this one has started."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from typing import Any

_HEARS = "import os, signal, sys; signal.signal(signal.SIGINT, signal.SIG_DFL); os.execvp(sys.argv[1], sys.argv[1:])"


def hearing_ctrl_c(command: Sequence[str]) -> list[str]:
    """The command of a program that hears Ctrl-C, even where this process ignores it, as in the background.

    A `preexec_fn` would run between fork and exec, where a process with threads may wait for ever.
    """
    return [sys.executable, "-I", "-S", "-c", _HEARS, *command]


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
