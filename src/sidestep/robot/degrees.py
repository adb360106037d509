"""Angles that were probably written in degrees where radians are expected."""

from __future__ import annotations

import math
from collections.abc import Iterable

DEGREES_HINT = "looks like degrees; radians are expected"
_LEAST = 3.0 * math.pi  # [rad] one and a half turns: no arm's joint turns farther, but for cables of a wrist
_MOST = 1080.0  # three turns in degrees
_MANY_TURNS = 100.0  # [rad] below, whole quarter turns are taken as such: limits of wrists are written so
_ROUNDING = 2e-3  # [rad] to which those are written


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
