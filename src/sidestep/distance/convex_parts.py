"""A solid as a union of convex parts, for a simulator that can only collide convex shapes."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.spatial import ConvexHull, QhullError

Array = npt.NDArray[np.float64]

MOST_PARTS = 16  # per mesh; contact search grows with their number
LEAST_GAIN = 0.02  # of the whole hull's volume: a cut that removes less air than this is not worth a part
CUTS = (0.2, 0.35, 0.5, 0.65, 0.8)  # places tried along each axis, in parts of the extent


def convex_parts(triangles: Array) -> tuple[Array, ...]:
    """Covers a closed surface by the convex hulls of slices of it.

    The piece whose best axis-parallel cut removes the most hull volume is cut, again and again. Each hull
    holds its slice, so the union holds the whole solid, and lies within the hull of the whole.

    Args:
        triangles: (F, 3, 3) [m].

    Returns:
        Corners (N, 3) of each convex part, at most `MOST_PARTS`; none for a flat surface.
    """
    return _parts(np.ascontiguousarray(triangles, dtype=np.float64).tobytes())


@lru_cache(maxsize=128)  # by content: the same robot is built again and again
def _parts(content: bytes) -> tuple[Array, ...]:
    triangles = np.frombuffer(content).reshape(-1, 3, 3)
    whole = _hull(triangles)
    if whole is None:
        return ()
    pieces = [(triangles, whole, _best_cut(triangles, whole.volume))]
    while len(pieces) < MOST_PARTS:
        index = max(range(len(pieces)), key=lambda k: pieces[k][2][0])
        surface, _, (gain, axis, place) = pieces[index]
        if gain < LEAST_GAIN * whole.volume:
            break
        pieces.pop(index)
        for side in (1.0, -1.0):
            half = _clipped(surface, axis, place, side)
            hull = _hull(half)
            assert hull is not None  # _best_cut only offers cuts into two solid halves
            pieces.append((half, hull, _best_cut(half, hull.volume)))
    return tuple(np.array(hull.points[hull.vertices]) for _, hull, _ in pieces)


def _best_cut(triangles: Array, volume: float) -> tuple[float, int, float]:
    """Hull volume removed by the best cut, its axis and its place."""
    best = (0.0, 0, 0.0)
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    for axis in range(3):
        for fraction in CUTS:
            place = float(low[axis] + fraction * (high[axis] - low[axis]))
            hulls = [_hull(_clipped(triangles, axis, place, side)) for side in (1.0, -1.0)]
            left = sum(hull.volume if hull is not None else np.inf for hull in hulls)
            if volume - left > best[0]:
                best = (volume - left, axis, place)
    return best


def _hull(triangles: Array) -> ConvexHull | None:
    """The convex hull; None where there is no volume."""
    if len(triangles) == 0:
        return None
    corners = np.ascontiguousarray(triangles).reshape(-1, 3).view("V24").ravel().tolist()
    try:
        return ConvexHull(np.frombuffer(b"".join(dict.fromkeys(corners))).reshape(-1, 3))  # each corner once
    except QhullError:
        return None


def _clipped(triangles: Array, axis: int, place: float, side: float) -> Array:
    """The part of a surface where side * (coordinate - place) <= 0; triangles across the plane are cut."""
    height = side * (triangles[:, :, axis] - place)
    kept = height <= 0.0
    number = kept.sum(axis=1)
    parts = [triangles[number == 3]]
    for count, lone in ((1, kept), (2, ~kept)):  # the corner that is alone on its side comes first
        cut, corner = triangles[number == count], lone[number == count].argmax(axis=1)
        rows = np.arange(len(cut))
        order = (corner[:, None] + np.arange(3)) % 3
        a, b, c = (cut[rows, order[:, k]] for k in range(3))
        levels = height[number == count]
        ha, hb, hc = (levels[rows, order[:, k]][:, None] for k in range(3))
        ab, ac = a + ha / (ha - hb) * (b - a), a + ha / (ha - hc) * (c - a)
        if count == 1:
            parts.append(np.stack([a, ab, ac], axis=1))
        else:
            parts += [np.stack([ab, b, c], axis=1), np.stack([ab, c, ac], axis=1)]
    return np.concatenate(parts)
