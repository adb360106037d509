"""What goes wrong in a depth image, and where: shadows, edges, flat surfaces, and noise that neighbours share."""

from __future__ import annotations

from functools import lru_cache
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.ndimage import uniform_filter

Depth: TypeAlias = npt.NDArray[np.float32]
Mask: TypeAlias = npt.NDArray[np.bool_]

POOL = 1.5  # sides of the stored noise over those of the image, of which every image takes a part
EDGE = 0.03  # step between neighbouring pixels over the nearer depth: a plane of 30 mm/m a pixel is seen at 85 degrees
BESIDE = 0.75  # [pixel] of a hidden column up to which what hides it is looked for
NEARER = 0.5  # [pixel] of disparity by which a surface is nearer than one that it hides


def hidden(depth: Depth, scale: float, *, border: bool) -> Mask:
    """Pixels (H, W) of a depth image [m] that a second viewpoint at the right does not see.

    Pixel u of a row is at column u - scale / z there. It is hidden if a nearer pixel of its row is at that column, and
    with `border` if the column is left of the image.

    Args:
        depth: (H, W) [m], 0 where nothing is.
        scale: focal length times baseline [pixel m].
        border: whether the second image has the limits of the first.
    """
    height, width = depth.shape
    disparity = np.divide(np.float32(scale), depth, out=np.zeros_like(depth), where=depth > 0.0)
    column = np.arange(width, dtype=np.float32) - disparity
    # Only where the order of columns changes does one pixel hide another: few pixels, which are then compared.
    least_after = np.minimum.accumulate(column[:, ::-1], axis=1)[:, ::-1]
    most_before = np.maximum.accumulate(column, axis=1)
    candidates = np.zeros(depth.shape, dtype=bool)
    candidates[:, 1:] = column[:, 1:] < most_before[:, :-1] + BESIDE
    front = np.nonzero(candidates & (column >= -1.0))
    nearest = np.zeros(
        (height, width + 2), dtype=np.float32
    )  # disparity by column of the second image, from -1 on
    place = np.floor(column[front]).astype(np.intp) + 1
    for beside in (0, 1):
        np.maximum.at(nearest, (front[0], place + beside), disparity[front])
    mask: Mask = (column < -0.5) & (depth > 0.0) if border else np.zeros(depth.shape, dtype=bool)
    behind = np.nonzero((column > least_after) & (depth > 0.0) & (column >= 0.0))
    place = np.rint(column[behind]).astype(np.intp) + 1
    mask[behind] |= nearest[behind[0], place] > disparity[behind] + NEARER
    return mask


def correlated(shape: tuple[int, ...], window: int, rng: np.random.Generator) -> Depth:
    """Normal noise of variance 1 (H, W), correlated over windows of `window` pixels: a random part of a stored field,
    turned over at random."""
    pool = _pool(shape[0], shape[1], window)
    row, column = (int(rng.integers(long - short + 1)) for long, short in zip(pool.shape, shape, strict=True))
    flips = rng.integers(0, 2, size=3) * 2 - 1
    cut = pool[row : row + shape[0], column : column + shape[1]][:: flips[0], :: flips[1]]
    return np.asarray(cut if flips[2] > 0 else -cut)


@lru_cache(maxsize=8)
def _pool(height: int, width: int, window: int) -> Depth:
    rng = np.random.default_rng(window)
    white = rng.standard_normal((round(POOL * height), round(POOL * width)), dtype=np.float32)
    field: Depth = white if window == 1 else np.float32(window) * uniform_filter(white, window, mode="wrap")
    field.setflags(write=False)
    return field


def slopes(depth: Depth, steepest: float) -> tuple[Mask, Mask]:
    """Pixels beside a step in depth, and those on surfaces whose relative slope per pixel is beyond `steepest`."""
    edges, flat = np.zeros((2, *depth.shape), dtype=bool)
    for first, second in (
        (np.s_[:, :-1], np.s_[:, 1:]),
        (np.s_[:-1], np.s_[1:]),
    ):
        nearer = np.minimum(depth[first], depth[second])
        change = np.abs(depth[first] - depth[second])
        steps = change > np.float32(EDGE) * nearer
        edges[first] |= steps
        edges[second] |= steps
        if steepest < EDGE:
            steep = (change > np.float32(steepest) * nearer) & ~steps
            flat[first] |= steep
            flat[second] |= steep
    return edges, flat


def grown(mask: Mask, reach: int) -> Mask:
    """The pixels within a square of `reach` around those of a mask of pixels beside an edge, which are 1 from it."""
    for axis in (0, 1):
        grown = mask.copy()
        for shift in range(1, reach):
            lower, upper = [slice(None)] * 2, [slice(None)] * 2
            lower[axis], upper[axis] = slice(None, -shift), slice(shift, None)
            grown[tuple(upper)] |= mask[tuple(lower)]
            grown[tuple(lower)] |= mask[tuple(upper)]
        mask = grown
    return mask
