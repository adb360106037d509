"""Methods of the studio beside the controller, whose scenarios have the method "custom"."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any, Protocol

from sidestep.body import Body
from sidestep.plugins import plugins
from sidestep.robot import Robot
from sidestep.scenario import Scenario
from sidestep.studio.adapter import Adapter
from sidestep.studio.parameters import Method, Numbers

if TYPE_CHECKING:
    from sidestep.studio.messages import Snapshot


class OtherMethods(Protocol):
    """What a package brings, by an entry point of the group "sidestep.studio" called "custom"."""

    METHODS: tuple[Method, ...]

    def custom_scenario(self, method: str, numbers: Mapping[str, Any], scenario: Scenario) -> Scenario:
        """The scenario by method custom that one of these methods is, without its numbers but for those of a switch."""

    def numbers_of_custom(self, scenario: Scenario) -> tuple[str, Numbers]:
        """The method that a scenario of method custom is written for, and its numbers."""

    def adapter_of(self, written: Scenario, robot: Robot, body: Body, tip: str) -> Adapter:
        """What moves the arm, of a scenario of method custom; raises ValueError that names the number at fault."""

    def custom_code(self, snapshot: Snapshot, written: Scenario) -> list[str]:
        """The same as lines of Python."""


@cache
def other_methods() -> OtherMethods | None:
    """None where no package brings any."""
    found: dict[str, OtherMethods] = plugins("sidestep.studio")
    return found.get("custom")


def methods_of_custom() -> OtherMethods:
    """Raises ValueError where no package brings any."""
    found = other_methods()
    if found is None:
        raise ValueError("method is custom, which needs the room sidestep.thesis; it is not installed")
    return found
