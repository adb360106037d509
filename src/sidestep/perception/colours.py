"""Colours of what cameras see, one meaning each: in pictures, reports and the studio (Okabe and Ito's palette)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sidestep._core import PixelLabel

# The palette's own module stands in a room that loads Matplotlib; a live view needs these alone.
_BLACK, _SKY, _GREEN = "#000000", "#56B4E9", "#009E73"
_YELLOW, _BLUE, _VERMILLION, _PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"

PIXELS: dict[str, str] = {
    "nothing": _BLACK,
    "obstacle": _VERMILLION,
    "arm": _SKY,
    "edge": "#FFFFFF",
    "explained": _GREEN,
    "left_out": "#7A4A2B",
    "outside": "#4D4D4D",
}
"""What a pixel shows, by the names of `PixelLabel`."""

CELLS: dict[str, str] = {
    "seen": _VERMILLION,
    "remembered": _YELLOW,
    "hidden": _PURPLE,
    "moving": _BLUE,
    "unseen": "#B0B0B0",
}
"""What a cell of the map is: seen now; seen before and out of view; seen before and hidden; moving; never seen."""

MEANINGS: dict[str, str] = {
    "nothing": "no depth",
    "obstacle": "obstacle",
    "arm": "the arm, taken out",
    "edge": "flying pixel, taken out",
    "explained": "a shape that was told",
    "left_out": "left out",
    "outside": "beyond the range",
    "seen": "seen now",
    "remembered": "remembered, not hidden",
    "hidden": "remembered, hidden",
    "moving": "moving",
    "unseen": "never seen",
}
"""What each name means, in words."""


def rgb(colour: str) -> tuple[int, int, int]:
    """A colour #RRGGBB as whole numbers from 0 to 255."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def label_palette() -> npt.NDArray[np.uint8]:
    """Colours (num_labels, 3) by the number of a `PixelLabel`: `label_palette()[labels]` is a picture (H, W, 3)."""
    palette = np.zeros((1 + max(int(label) for label in PixelLabel), 3), dtype=np.uint8)
    for label in PixelLabel:
        palette[int(label)] = rgb(PIXELS[label.name])
    return palette
