"""Angles that were probably written in degrees where radians are expected."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence

from sidestep._core import looks_like_degrees

__all__ = ["DEGREES_HINT", "degrees_hint", "looks_like_degrees", "warn_of_degrees"]

DEGREES_HINT = "looks like degrees; radians are expected"
_LISTED = 3  # angles in a warning


def degrees_hint(angles: Iterable[float]) -> str:
    """What an error about angles [rad] adds, "" where none of them looks like degrees."""
    odd = [angle for angle in angles if looks_like_degrees(angle)]
    return f"; {odd[0]:g} {DEGREES_HINT}" if odd else ""


def warn_of_degrees(label: str, odd: Sequence[str], *, stacklevel: int) -> None:
    """One warning of all angles of a description that look like degrees, in words; none without such angles."""
    if odd:
        more = f" and {len(odd) - _LISTED} more" if len(odd) > _LISTED else ""
        warnings.warn(
            f"{label}: {', '.join(odd[:_LISTED])}{more} {DEGREES_HINT}",
            RuntimeWarning,
            stacklevel=stacklevel + 1,
        )
