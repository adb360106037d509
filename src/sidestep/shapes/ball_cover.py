"""Few balls that hold the whole surface of a solid, and reach out of it by no more than a given excess.

A point c inside a solid at depth delta(c) is the centre of a ball of radius delta(c) + excess, which reaches at most
`excess` out of the solid. The surface is cut into cells, each inside the convex hull of its corners; balls are convex,
so a ball that holds the corners of a cell holds the cell. Every cell proposes the largest ball that touches the surface
from inside at the middle of the cell, grown by the excess: with half a diagonal h and depth d it holds the cell where
h^2 <= 2 d excess + excess^2. A cell that its ball does not hold is halved; that ends where h <= excess. Of the balls
that are proposed, those that hold most cells are taken first (greedy set cover).
"""

from __future__ import annotations

import heapq
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

EXCESS = 0.002  # [m] by default: less than half the clearance that the controller keeps by default
MAX_CELLS = 300_000  # more balls than a controller can use; stops a file in millimetres from filling memory


class Surface(Protocol):
    """A surface in cells: rows of numbers whose meaning only the surface knows."""

    def cells(self, excess: float) -> Array:
        """The cells (N, P) to begin with; together they are the surface."""

    def corners(self, cells: Array) -> Array:
        """Points (N, K, 3) whose convex hull holds the cell."""

    def middles(self, cells: Array) -> Array:
        """A point (N, 3) of each cell."""

    def inside(self, cells: Array) -> tuple[Array, Array]:
        """Centres (N, 3) of balls inside the solid that touch it at the middles of cells, and their radii (N,)."""

    def halves(self, cells: Array) -> Array:
        """The halves (2N, P) of cells."""


def cover(surface: Surface, excess: float, *, batch: int | None = None) -> tuple[Array, Array]:
    """Centres (N, 3) and radii (N,) of balls that hold a surface and reach out of its solid by at most `excess` [m].

    Args:
        surface: in cells.
        excess: [m] > 0.
        batch: number of cells that propose balls at first; None: all at once, best where a proposal costs little.

    Raises:
        ValueError: the excess is not positive, or so small that the number of balls is of no use.
    """
    check_excess(excess)
    left = surface.cells(excess)
    centres, radii = [np.zeros((0, 3))], [np.zeros(0)]
    rng = np.random.default_rng(0)
    while len(left):
        check_count(len(left) + sum(map(len, radii)))
        if batch is not None:
            left = left[rng.permutation(len(left))]
        proposing, others = np.split(left, [len(left) if batch is None else batch])
        middle, depth = surface.inside(proposing)
        reach = np.linalg.norm(surface.corners(proposing) - middle[:, None], axis=2).max(axis=1)
        fits = reach <= depth + excess
        left = np.concatenate([proposing[fits], surface.halves(proposing[~fits]), others])
        if fits.any():
            corners, middles = surface.corners(left), surface.middles(left)
            taken, size, held = _fewest(middle[fits], depth[fits] + excess, corners, middles)
            centres.append(middle[fits][taken])
            radii.append(size)
            left = left[~held]
        batch = None if batch is None else 2 * batch
    return np.concatenate(centres), np.concatenate(radii)


def check_excess(excess: float) -> None:
    """Raises ValueError unless the excess is a positive length [m]."""
    if not (np.isfinite(excess) and excess > 0.0):
        raise ValueError(f"excess is {excess}, must be positive and finite [m]")


def check_count(count: float) -> None:
    """Raises ValueError for a number of cells that is of no use."""
    if count > MAX_CELLS:
        raise ValueError(
            f"the excess asks for more than {MAX_CELLS} balls; a larger excess needs fewer; is the shape in metres?"
        )


def cell_size(depth: float, excess: float) -> float:
    """Edge of the largest square that a ball of this depth holds, less some rounding."""
    return (1.0 - 1e-9) * float(np.sqrt(2.0 * (2.0 * depth * excess + excess**2)))


def _fewest(
    centres: Array, radii: Array, corners: Array, middles: Array
) -> tuple[list[int], Array, NDArray[np.bool_]]:
    """Of balls, each of which holds a cell, those that are taken; their radii, no larger than needed; the cells held.

    The first cells are those of the balls, in order. Greedy: always the ball that holds most of the cells left.
    """
    from scipy.spatial import cKDTree

    near = cKDTree(middles).query_ball_point(centres, radii * (1.0 + 1e-9))
    reach: list[Array] = []
    for ball, cells in enumerate(near):
        cells = np.union1d(np.asarray(cells, dtype=np.int64), [ball])
        far = np.linalg.norm(corners[cells] - centres[ball], axis=2).max(axis=1)
        inside = (far <= radii[ball]) | (cells == ball)
        near[ball], far = cells[inside], far[inside]
        reach.append(far)
    held = np.zeros(len(corners), dtype=bool)
    heap = [(-len(cells), ball) for ball, cells in enumerate(near)]
    heapq.heapify(heap)
    taken, sizes = [], []
    while heap:
        before, ball = heapq.heappop(heap)
        if held[ball]:
            continue
        new = ~held[near[ball]]
        gain = int(new.sum())
        if gain < -before and heap and gain < -heap[0][0]:
            heapq.heappush(heap, (-gain, ball))
            continue
        taken.append(ball)
        sizes.append(reach[ball][new].max())
        held[near[ball]] = True
    return taken, np.array(sizes), held


def halved(cells: Array, low: NDArray[np.int64], high: NDArray[np.int64]) -> Array:
    """Cells cut half-way between their columns `low` and `high`."""
    rows = np.arange(len(cells))
    middle = 0.5 * (cells[rows, low] + cells[rows, high])
    first, second = cells.copy(), cells.copy()
    first[rows, high], second[rows, low] = middle, middle
    return np.concatenate([first, second])
