"""The dashboard of a UR: what the box is, and the end of a protective stop."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

ANSWER = 2000  # [ms] in which it must answer a connection


@dataclass(frozen=True)
class Box:
    """What a controller box is.

    Attributes:
        model: for example "UR10". software: its version. major: of the software: 3 (CB3) or 5 (e-Series).
    """

    model: str
    software: str
    major: int


def ask(address: str) -> Box:
    """What box answers at an address.

    Raises:
        ConnectionError: none does.
    """
    with _connected(address) as dashboard:
        try:
            model, software = dashboard.getRobotModel().strip(), dashboard.polyscopeVersion().strip()
        except RuntimeError as error:
            raise ConnectionError(f"the dashboard at {address} does not answer: {error}") from error
    numbers = re.search(r"(\d+)\.\d+", software)
    return Box(model, software, int(numbers[1]) if numbers else 0)


def unlock(address: str) -> str:
    """Asks to end a protective stop; what the robot says against it, or "".

    Raises:
        ConnectionError: nobody answers at the address.
    """
    with _connected(address) as dashboard:
        try:
            dashboard.closeSafetyPopup()
            dashboard.unlockProtectiveStop()
        except (RuntimeError, ValueError) as error:  # a refusal, in the robot's words
            return str(error)
    return ""


@contextmanager
def _connected(address: str) -> Iterator[Any]:
    import dashboard_client

    dashboard = dashboard_client.DashboardClient(address)
    try:
        dashboard.connect(ANSWER)
    except RuntimeError as error:
        raise ConnectionError(f"no UR answers at {address}: {error}") from error
    try:
        yield dashboard
    finally:
        dashboard.disconnect()
