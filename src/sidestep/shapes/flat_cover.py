"""Balls that cover surfaces of large flat faces, such as plates, sheets and boxes: squares in each plane, no search.

A plane is cut into squares of half a diagonal h. A ball of radius D inside the solid that touches the plane at a point
m, grown to D + excess, holds what is within h of m where h^2 = 2 D excess + excess^2. So a square needs one ball where
a ball of that D fits behind its middle; else it is halved. What has h <= excess needs nothing behind it. A square that
lies across the border of a triangle takes the point of the triangle nearest to its middle: of a convex set, that point
is nearer to each other point than the middle is.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sidestep.shapes.ball_cover import MAX_CELLS
from sidestep.shapes.nearest_on_mesh import nearest_on_triangles

Array = NDArray[np.float64]
Fits = Callable[[Array, float], NDArray[np.bool_]]

FACE_SQUARES = (
    100.0  # of an edge of the excess, on a large face: on smaller ones too many lie across a border
)
FEW_FACES = 100  # of a surface: so few cost little, however small they are
LEVELS_UP = 2  # squares two and four times as large as most take are tried first: parts may be thicker
SAME = 1e-9  # of the size: planes and centres that near are the same; balls are larger by twice that
IN_METRES = 20.0  # [m] more than a cell around an arm measures


def on_large_faces(triangles: Array, excess: float) -> NDArray[np.bool_]:
    """Which of triangles (F, 3, 3) lie in planes of which the surface has so much that squares are worth it."""
    plane = _planes(triangles)[0]
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.bincount(plane, 0.5 * np.linalg.norm(cross, axis=1))
    return np.asarray((areas[plane] >= FACE_SQUARES * excess**2) | (len(areas) <= FEW_FACES))


def flat_balls(
    triangles: Array, inward: Array, fits: Fits, excess: float, depth: float
) -> tuple[Array, Array]:
    """Centres (N, 3) and radii (N,) of balls that hold triangles (F, 3, 3) and reach out by at most `excess` [m].

    Args:
        triangles: [m]. inward: normals (F, 3) into the solid, 0 where there is none.
        fits: whether balls around centres (N, 3) of a radius [m] hold no point of the surface.
        depth: of balls that fit behind most of the surface [m].

    Raises:
        ValueError: more than `MAX_CELLS` balls; says which excess needs fewer.
    """
    plane, across, along, normal = _planes(triangles)
    size = float(np.abs(triangles).max())
    slack = 2.0 * SAME * size
    excess = max(excess - slack, 0.5 * excess)
    most = np.sqrt(2.0 * depth * excess + excess**2)
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = 0.5 * float(np.linalg.norm(cross, axis=1).sum())
    _check(area / (2.0 * most**2), excess, size)
    half = most * 2.0**LEVELS_UP
    edge = np.full(2, np.sqrt(2.0) * half * (1.0 - 1e-8))
    flat = np.stack([np.einsum("fci,fi->fc", triangles, axis) for axis in (across, along)], axis=2)
    owner, cell = _first_cells(flat, edge)
    centres, radii = [np.zeros((0, 3))], [np.zeros(0)]
    while len(owner):
        _check(sum(map(len, radii)) + 0.5 * len(owner), excess, size)
        height = np.einsum("ni,ni->n", triangles[owner, 0], normal[owner])
        half = 0.5 * float(np.hypot(*edge)) * (1.0 + 1e-9)
        behind = max((half**2 - excess**2) / (2.0 * excess), 0.0)
        place = (cell + 0.5) * edge
        middle = place[:, :1] * across[owner] + place[:, 1:] * along[owner] + height[:, None] * normal[owner]
        touched = nearest_on_triangles(middle, triangles[owner])
        apart = np.linalg.norm(touched - middle, axis=1)
        kept = apart <= half
        owner, cell, touched, apart = owner[kept], cell[kept], touched[kept], apart[kept]
        if not len(owner):
            break
        # One ball for a square whose middle is on a triangle, else one for each triangle in it.
        low, spans = cell.min(axis=0), np.ptp(cell, axis=0) + 1
        number = (plane[owner] * spans[0] + cell[:, 0] - low[0]) * spans[1] + cell[:, 1] - low[1]
        _, square = np.unique(number, return_inverse=True)
        within = np.flatnonzero(apart <= SAME * size)
        whole = np.full(square.max() + 1, -1)
        whole[square[within]] = within
        speaker = np.where(whole[square] >= 0, whole[square], np.arange(len(owner)))
        proposing = np.unique(speaker)
        centre = touched[proposing] + behind * inward[owner[proposing]]
        taken = np.ones(len(proposing), dtype=bool)
        if behind > 0.0:
            taken = inward[owner[proposing]].any(axis=1)
            if taken.any():
                taken[taken] = fits(centre[taken], behind)
        centres.append(centre[taken])
        radii.append(np.full(int(taken.sum()), np.hypot(behind, half) + slack))
        held = np.zeros(len(owner), dtype=bool)
        held[proposing[taken]] = True
        left = ~held[speaker]
        owner, cell = owner[left], cell[left]
        across_it = np.eye(2, dtype=np.int64)[int(edge.argmax())]  # halves of squares, then squares again
        cell = (cell[:, None] * (1 + across_it) + np.array([[0], [1]]) * across_it).reshape(-1, 2)
        owner = np.repeat(owner, 2)
        edge = edge / (1 + across_it)
    return _distinct(np.concatenate(centres), np.concatenate(radii), SAME * size)


def _check(count: float, excess: float, size: float) -> None:
    if count <= MAX_CELLS:
        return
    enough = excess * float(np.sqrt(count / MAX_CELLS))
    raise ValueError(
        f"the excess of {1e3 * excess:.3g} mm asks for about {count:.2g} balls, allowed are {MAX_CELLS}; "
        f"an excess of {1.1e3 * enough:.2g} mm needs few enough"
        + (f"; it reaches {size:.4g} m far: is the shape in metres?" if size > IN_METRES else "")
    )


def _planes(triangles: Array) -> tuple[NDArray[np.int64], Array, Array, Array]:
    """Of triangles (F, 3, 3): the number of their plane, and its axes and normal (F, 3), alike for parallel planes."""
    first, second = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    normal = np.cross(first, second)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    longest = np.where((np.abs(first).max(axis=1) >= np.abs(second).max(axis=1))[:, None], first, second)
    thin = length[:, 0] <= 1e-14 * np.maximum(np.square(longest).sum(axis=1), 1e-300)
    normal = np.where(thin[:, None], _beside(longest), normal / np.where(length > 0.0, length, 1.0))
    leading = np.take_along_axis(normal, np.abs(normal).argmax(axis=1)[:, None], axis=1)
    normal = normal * np.sign(leading)
    across = _beside(normal)
    along = np.cross(normal, across)
    size = max(float(np.abs(triangles).max()), 1e-300)
    height = np.einsum("fi,fi->f", triangles[:, 0], normal) / size
    key = np.round(np.column_stack([normal, height]) / SAME).astype(np.int64)
    _, plane = np.unique(key, axis=0, return_inverse=True)
    return plane.reshape(-1), across, along, normal


def _beside(vectors: Array) -> Array:
    """Unit vectors (N, 3) at right angles to vectors (N, 3)."""
    axis = np.eye(3)[np.abs(vectors).argmin(axis=1)]
    beside = np.cross(vectors, axis)
    length = np.linalg.norm(beside, axis=1, keepdims=True)
    found: Array = np.where(length > 0.0, beside / np.where(length > 0.0, length, 1.0), [1.0, 0.0, 0.0])
    return found


def _first_cells(flat: Array, edge: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Triangles (N,) and squares (N, 2) of their bounding rectangles; `flat` (F, 3, 2) in their planes [m]."""
    low = np.floor(flat.min(axis=1) / edge - 1e-6).astype(np.int64)
    spans = np.floor(flat.max(axis=1) / edge + 1e-6).astype(np.int64) - low + 1
    counts = spans.prod(axis=1)
    owner = np.repeat(np.arange(len(flat)), counts)
    number = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return owner, low[owner] + np.stack(np.divmod(number, spans[owner, 1]), axis=1)


def _distinct(centres: Array, radii: Array, same: float) -> tuple[Array, Array]:
    """Without balls that are there twice: those of both faces of a plate."""
    key = np.round(np.column_stack([centres, radii]) / max(100.0 * same, 1e-300)).astype(np.int64)
    order = np.lexsort(key.T)
    other = np.ones(len(key), dtype=bool)
    other[1:] = (np.diff(key[order], axis=0) != 0).any(axis=1)
    first = np.sort(order[other])
    return centres[first], radii[first]
