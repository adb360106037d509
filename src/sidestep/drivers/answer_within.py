"""Calls that may wait for a robot without end."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any


def answer_within(seconds: float, who: str, call: Callable[..., Any], *arguments: Any) -> Any:
    """What a call returns; what it raises is raised. One that takes longer goes on in a thread of its own.

    Args:
        seconds: how long it may take [s]. who: must answer, for the error.

    Raises:
        ConnectionError: it took longer.
    """
    ended: list[tuple[Any, BaseException | None]] = []  # result and error

    def work() -> None:
        try:
            ended.append((call(*arguments), None))
        except BaseException as error:
            ended.append((None, error))

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(seconds)
    if not ended:
        raise ConnectionError(f"{who} did not answer within {seconds:g} s")
    result, error = ended[0]
    if error is not None:
        raise error
    return result
