"""Sidestep: reactive whole-arm obstacle avoidance on the curved configuration space of a manipulator."""

from sidestep._core import __version__

__all__ = ["__version__"]
