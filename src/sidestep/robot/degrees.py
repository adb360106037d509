"""Angles that were probably written in degrees where radians are expected."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Sequence

DEGREES_HINT = "looks like degrees; radians are expected"
_LEAST = 3.0 * math.pi  # [rad] one and a half turns: no arm's joint turns farther, but for cables of a wrist
_MOST = 1080.0  # three turns in degrees
_MANY_TURNS = 100.0  # [rad] below, whole quarter turns are taken as such: limits of wrists are written so
_ROUNDING = 2e-3  # [rad] to which those are written
_LISTED = 3  # angles in a warning


def looks_like_degrees(angle: float) -> bool:
    """Whether an angle is implausible in radians and plausible in degrees."""
    size = abs(angle)
    if not _LEAST + _ROUNDING < size <= _MOST:
        return False
    quarter = 0.5 * math.pi
    return size > _MANY_TURNS or abs(size - quarter * round(size / quarter)) > _ROUNDING


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
