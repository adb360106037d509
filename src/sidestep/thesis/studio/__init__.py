"""The thesis's methods in the studio. See `OtherMethods`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sidestep.scenario import Scenario
from sidestep.thesis.studio.adapter import adapter_of
from sidestep.thesis.studio.methods import METHODS, custom_scenario, numbers_of_custom

if TYPE_CHECKING:
    from sidestep.studio.messages import Snapshot


def custom_code(snapshot: Snapshot, written: Scenario) -> list[str]:
    """Python that makes what moves the arm, of a scenario of method custom."""
    from sidestep.thesis.studio import (
        snippet,  # here: it needs the studio's list of methods, which needs this module
    )

    return snippet.custom_code(snapshot, written)


__all__ = ["METHODS", "adapter_of", "custom_code", "custom_scenario", "numbers_of_custom"]
