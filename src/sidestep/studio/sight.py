"""What a depth camera of the studio has seen, for the page. Plain values only."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from sidestep.perception.seen_stages import CELL_KINDS
from sidestep.studio.camera_choice import CameraChoice

Array = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float32]

KINDS = CELL_KINDS
SEEN, REMEMBERED, HIDDEN = range(len(KINDS))  # what a cell is
STAGES = ("depth and edges", "arm mask", "points and map", "unseen space", "to the controller")


@dataclass(frozen=True, eq=False)
class Sight:
    """What became of one image.

    Attributes:
        number: of the image, from 1 on. time: of its capture [s], on the clock of the controller.
        pose: (4, 4) of the optical frame in the world.
        depth: (H, W) [m], 0: nothing seen. labels: (H, W), a `PixelLabel` each.
        centres, radii: (N, 3), (N,) of the cells that are obstacles [m]; kinds: (N,) of `KINDS`; ages: (N,) [s].
        unseen: (M, 3) middles of cells where nobody has looked [m].
        pixels: share of the pixels by `PixelLabel`'s names. explained: number of cells that told shapes explain.
        times: of `STAGES` [s]; rendering: of the image [s].
        question: what is hard to believe, in words; empty: nothing.
    """

    number: int
    time: float
    pose: Array
    depth: npt.NDArray[np.float16]
    labels: npt.NDArray[np.uint8]
    centres: Floats
    radii: Floats
    kinds: npt.NDArray[np.uint8]
    ages: Floats
    unseen: Floats
    pixels: dict[str, float]
    explained: int
    times: tuple[float, ...]
    rendering: float
    question: str


@dataclass(frozen=True, eq=False)
class CameraState:
    """The camera of a session at one moment.

    Attributes:
        choice: what is chosen; None: it is off. error: why it could not be switched on; empty: nothing went wrong.
        sight: of the last image; None before the first. age: since its capture [s].
        lost: images that were not rendered, since the one before took too long.
        moving: (K, 4) middle and radius [m] of obstacles that move; speeds: (K,) of them [m/s].
    """

    choice: CameraChoice | None = None
    error: str = ""
    sight: Sight | None = None
    age: float = 0.0
    lost: int = 0
    moving: Array = field(default_factory=lambda: np.zeros((0, 4)))
    speeds: Array = field(default_factory=lambda: np.zeros(0))
